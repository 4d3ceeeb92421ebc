//! `--symmetry`: the plane in which a layout is mirrored.

use fam_layout::Symmetry;

/// `off`, `auto`, an axis, or a plane: three numbers for its normal, and its offset along that.
pub fn symmetry(text: &str) -> Result<Symmetry, String> {
    match text {
        "off" => return Ok(Symmetry::Off),
        "auto" => return Ok(Symmetry::Auto),
        "x" => return Ok(Symmetry::X),
        "y" => return Ok(Symmetry::Y),
        "z" => return Ok(Symmetry::Z),
        _ => {}
    }
    let numbers: Option<Vec<f64>> = text.split(',').map(|n| n.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[x, y, z, offset]) => Ok(Symmetry::Plane {
            normal: [x, y, z],
            offset,
        }),
        _ => Err(
            "it is off, auto, x, y, z, or a plane: its normal and offset, as in 1,0,0,0.5"
                .to_owned(),
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_have_names_or_four_numbers() {
        for (text, expected) in [
            ("off", Symmetry::Off),
            ("auto", Symmetry::Auto),
            ("z", Symmetry::Z),
            (
                "1, 0,0,-0.5",
                Symmetry::Plane {
                    normal: [1.0, 0.0, 0.0],
                    offset: -0.5,
                },
            ),
        ] {
            assert_eq!(symmetry(text), Ok(expected), "{text}");
        }
        for text in ["", "w", "1,0,0", "1,0,0,0,0", "a,b,c,d"] {
            assert!(symmetry(text).is_err(), "{text}");
        }
    }
}
