//! Colours of files as linear ones.

/// A component of a colour in sRGB, from 0 to 1, as a linear one.
pub(crate) fn linear_from_srgb(value: f64) -> f32 {
    let value = value.clamp(0.0, 1.0);
    let linear = if value <= 0.04045 {
        value / 12.92
    } else {
        ((value + 0.055) / 1.055).powf(2.4)
    };
    linear as f32
}

/// A colour in sRGB, with opacity or without, as a linear one; unknown components are zero.
pub(crate) fn linear_color(srgb: [f64; 3], opacity: f64) -> [f32; 4] {
    let known = |value: f64| if value.is_nan() { 0.0 } else { value };
    let [r, g, b] = srgb.map(|c| linear_from_srgb(known(c)));
    [r, g, b, known(opacity).clamp(0.0, 1.0) as f32]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_goes_through_known_values() {
        assert_eq!(linear_color([0.0, 1.0, 2.0], 0.25), [0.0, 1.0, 1.0, 0.25]);
        assert_eq!(
            linear_color([f64::NAN, -1.0, 1.0], 9.0),
            [0.0, 0.0, 1.0, 1.0]
        );
        // By the definition in IEC 61966-2-1.
        assert!((linear_from_srgb(0.5) - 0.214_041).abs() < 1e-6);
        assert!((linear_from_srgb(0.04045) - 0.003_130_8).abs() < 1e-6);
    }
}
