//! Colours: linear in a scene, sRGB in OBJ, OFF, PLY and XYZ files.

/// A number from 0 to 1: the nearest, and 0 for NaN.
pub(super) fn unit(component: f32) -> f32 {
    if component.is_nan() {
        0.0
    } else {
        component.clamp(0.0, 1.0)
    }
}

/// A linear component as sRGB, both from 0 to 1.
pub(super) fn srgb(linear: f32) -> f64 {
    let linear = f64::from(unit(linear));
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

/// Red, green and blue in text: six digits are more than any image has.
pub(super) fn srgb_text(linear: [f32; 4]) -> String {
    let [r, g, b] = [0, 1, 2].map(|at| (srgb(linear[at]) * 1e6).round() / 1e6);
    format!("{r} {g} {b}")
}

/// Red, green, blue and opacity as bytes.
pub(super) fn srgb_bytes(linear: [f32; 4]) -> [u8; 4] {
    let [r, g, b, opacity] = linear;
    let opacity = f64::from(unit(opacity));
    [srgb(r), srgb(g), srgb(b), opacity].map(|c| (c * 255.0).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_is_that_of_the_standard() {
        // IEC 61966-2-1: the linear value of the byte 188 is 0.502886.
        assert_eq!(srgb_bytes([0.502_886, 0.0, 1.0, 0.5]), [188, 0, 255, 128]);
        assert_eq!(srgb_bytes([7.0, -1.0, f32::NAN, 2.0]), [255, 0, 0, 255]);
        assert_eq!(srgb_text([0.0, 1.0, 0.001, 0.3]), "0 1 0.01292");
        assert!((srgb(0.003_130_8) - srgb(0.003_130_9)).abs() < 1e-5);
    }
}
