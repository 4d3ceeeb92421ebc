//! Colours: linear in a scene, sRGB in the files of most formats.

/// The name of the mean of red, green and blue, as an attribute of the vertices.
pub(crate) const COLOR: &str = "color";

/// The mean of red, green and blue.
pub(crate) fn mean([r, g, b]: [f64; 3]) -> f64 {
    (r + g + b) / 3.0
}

/// A component of a colour in sRGB as a linear one, both from 0 to 1.
fn linear(srgb: f64) -> f32 {
    let srgb = unit(srgb);
    let linear = if srgb <= 0.04045 {
        srgb / 12.92
    } else {
        ((srgb + 0.055) / 1.055).powf(2.4)
    };
    linear as f32
}

/// A linear component as sRGB, both from 0 to 1.
fn srgb(linear: f32) -> f64 {
    let linear = unit(linear.into());
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

/// The nearest number from 0 to 1; 0 for NaN.
fn unit(component: f64) -> f64 {
    if component.is_nan() {
        0.0
    } else {
        component.clamp(0.0, 1.0)
    }
}

/// A colour with components from 0 to 1: the nearest, and 0 for NaN.
pub(crate) fn unit_color(color: [f32; 4]) -> [f32; 4] {
    color.map(|c| unit(c.into()) as f32)
}

/// A colour in sRGB, with its opacity, as a linear one.
pub(crate) fn linear_color(srgb: [f64; 3], opacity: f64) -> [f32; 4] {
    let [r, g, b] = srgb.map(linear);
    [r, g, b, unit(opacity) as f32]
}

/// Red, green and blue in text: six digits are more than any image has.
pub(crate) fn srgb_text(linear: [f32; 4]) -> String {
    let [r, g, b] = [0, 1, 2].map(|at| (srgb(linear[at]) * 1e6).round() / 1e6);
    format!("{r} {g} {b}")
}

/// Red, green, blue and opacity as bytes.
pub(crate) fn srgb_bytes(linear: [f32; 4]) -> [u8; 4] {
    let [r, g, b, opacity] = linear;
    [srgb(r), srgb(g), srgb(b), unit(opacity.into())].map(|c| (c * 255.0).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_is_that_of_the_standard() {
        // IEC 61966-2-1: the linear value of the byte 188 is 0.502886.
        assert_eq!(srgb_bytes([0.502_886, 0.0, 1.0, 0.5]), [188, 0, 255, 128]);
        assert_eq!(srgb_text([0.0, 1.0, 0.001, 0.3]), "0 1 0.01292");
        assert!((linear(0.5) - 0.214_041).abs() < 1e-6);
        assert!((linear(0.04045) - 0.003_130_8).abs() < 1e-6);
        assert!((srgb(0.003_130_8) - srgb(0.003_130_9)).abs() < 1e-5);
        for byte in 0..=u8::MAX {
            let gray = linear_color([f64::from(byte) / 255.0; 3], 1.0);
            assert_eq!(srgb_bytes(gray), [byte, byte, byte, 255]);
        }
    }

    #[test]
    fn components_are_between_0_and_1() {
        assert_eq!(linear_color([0.0, 1.0, 2.0], 0.25), [0.0, 1.0, 1.0, 0.25]);
        assert_eq!(
            linear_color([f64::NAN, -1.0, 1.0], 9.0),
            [0.0, 0.0, 1.0, 1.0]
        );
        assert_eq!(srgb_bytes([7.0, -1.0, f32::NAN, 2.0]), [255, 0, 0, 255]);
        assert_eq!(unit_color([7.0, -1.0, f32::NAN, 0.5]), [1.0, 0.0, 0.0, 0.5]);
    }
}
