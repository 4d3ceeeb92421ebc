//! Directions as the command line has them.

/// A direction: an axis such as `+z` or `-x`, or the vector `X,Y,Z`.
pub fn direction(text: &str) -> Result<[f64; 3], String> {
    let axis = |axis: usize, sign: f64| {
        let mut direction = [0.0; 3];
        direction[axis] = sign;
        direction
    };
    match text {
        "+x" | "x" => Ok(axis(0, 1.0)),
        "+y" | "y" => Ok(axis(1, 1.0)),
        "+z" | "z" => Ok(axis(2, 1.0)),
        "-x" => Ok(axis(0, -1.0)),
        "-y" => Ok(axis(1, -1.0)),
        "-z" => Ok(axis(2, -1.0)),
        _ => vector(text).ok_or_else(|| {
            "a direction is an axis with a sign, such as +z, or three numbers, such as 0,0.5,1"
                .to_owned()
        }),
    }
}

fn vector(text: &str) -> Option<[f64; 3]> {
    let numbers: Vec<f64> = text
        .split(',')
        .map(|number| number.trim().parse().ok())
        .collect::<Option<_>>()?;
    let vector = <[f64; 3]>::try_from(numbers).ok()?;
    let is_direction = vector.iter().all(|c| c.is_finite()) && vector != [0.0; 3];
    is_direction.then_some(vector)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_and_vectors_are_directions() {
        for (text, expected) in [
            ("+z", [0.0, 0.0, 1.0]),
            ("y", [0.0, 1.0, 0.0]),
            ("-x", [-1.0, 0.0, 0.0]),
            ("0,0.5,1", [0.0, 0.5, 1.0]),
            ("-1, 2e1, 0", [-1.0, 20.0, 0.0]),
        ] {
            assert_eq!(direction(text), Ok(expected), "{text}");
        }
        for text in [
            "", "w", "+", "1,2", "1,2,3,4", "0,0,0", "nan,0,1", "inf,0,0", "1,,2",
        ] {
            assert!(direction(text).is_err(), "{text}");
        }
    }
}
