//! Colours of vertices: the numbers after the coordinates of a `v`, sRGB between 0 and 1.

use crate::color::linear_color;
use crate::text;

use super::statements::Statement;

const WHITE: [f32; 3] = [1.0; 3];

/// Collects the colours of a file.
///
/// Six numbers are coordinates and a colour. Of seven or more, the fourth is either a weight,
/// and the colour follows, or the red of a colour with an opacity. It is a weight if it is 1
/// wherever there are that many numbers.
#[derive(Default)]
pub(super) struct Colors {
    vertices: usize,
    /// The three numbers after the coordinates, up to the last vertex that has them.
    direct: Vec<[f32; 3]>,
    /// Those after a weight, if there is one.
    weighted: Vec<[f32; 3]>,
    is_red: bool,
}

impl Colors {
    /// Takes a statement.
    pub fn push(&mut self, statement: &Statement) {
        if statement.keyword() != b"v" {
            return;
        }
        self.vertices += 1;
        let count = statement.arguments().len();
        if count < 6 {
            return;
        }
        let words = statement.words().skip(3).take(4);
        let numbers: Vec<f32> = words
            .map(|word| text::parse(word).unwrap_or(f32::NAN))
            .collect();
        let color = |at: usize| [numbers[at], numbers[at + 1], numbers[at + 2]];
        self.is_red |= count > 6 && numbers[0] != 1.0;
        for (colors, first) in [
            (&mut self.direct, 0),
            (&mut self.weighted, usize::from(count > 6)),
        ] {
            colors.resize(self.vertices - 1, WHITE);
            colors.push(color(first));
        }
    }

    /// The linear colour of every vertex, white where there is none; `None` if none has one.
    pub fn finish(self) -> Option<Vec<[f32; 4]>> {
        let colors = self.into_written()?.into_iter();
        Some(colors.map(linear).collect())
    }

    /// The same with the numbers of the file, NaN where a word is none.
    pub fn into_written(self) -> Option<Vec<[f32; 3]>> {
        let mut colors = if self.is_red {
            self.direct
        } else {
            self.weighted
        };
        (!colors.is_empty()).then(|| {
            colors.resize(self.vertices, WHITE);
            colors
        })
    }
}

/// An sRGB colour as linear red, green, blue and opacity; one that is not finite is white.
fn linear(color: [f32; 3]) -> [f32; 4] {
    let color = if color.iter().all(|c| c.is_finite()) {
        color
    } else {
        WHITE
    };
    linear_color(color.map(f64::from), 1.0)
}

#[cfg(test)]
mod tests {
    use super::super::statements::Statements;
    use super::*;

    fn colors(text: &str) -> Option<Vec<[f32; 4]>> {
        let mut colors = Colors::default();
        let mut statements = Statements::new(text.as_bytes());
        while let Some(statement) = statements.next().unwrap() {
            colors.push(&statement);
        }
        colors.finish()
    }

    const WHITE: [f32; 4] = [1.0; 4];
    const RED: [f32; 4] = [1.0, 0.0, 0.0, 1.0];
    const GREEN: [f32; 4] = [0.0, 1.0, 0.0, 1.0];

    #[test]
    fn what_is_no_colour_is_white() {
        let text = "v 0 0 0\nv 0 0 0 1 0 0\nv 0 0 0 nan 0 0\nv 0 0 0 0 x 0\nvn 0 0 0 0 0 0\n\
                    v 0 0 0 0 inf 0\nv 0 0 0 0 7 -1\nv 0 0 0 .5\nv 0 0 0 0 0\n";
        let expected = [WHITE, RED, WHITE, WHITE, WHITE, GREEN, WHITE, WHITE];
        assert_eq!(colors(text).unwrap(), expected);
        assert_eq!(colors("v 0 0 0\nv 0 0 0 1\n"), None);
    }

    #[test]
    fn srgb_becomes_linear() {
        let [r, g, b, a] = colors("v 0 0 0 0.5 0.04 1").unwrap()[0];
        assert!((r - 0.214_041).abs() < 1e-6 && (g - 0.003_095_975).abs() < 1e-8);
        assert_eq!((b, a), (1.0, 1.0));
    }

    #[test]
    fn a_fourth_number_that_is_always_one_is_a_weight() {
        let weights = "v 0 0 0 1 0 1 0\nv 0 0 0 1 0 0\nv 0 0 0 1.0 1 0 0 1\n";
        assert_eq!(colors(weights).unwrap(), [GREEN, RED, RED]);
        let opacities = "v 0 0 0 0 1 0 1\nv 0 0 0 1 0 0 1\nv 0 0 0\n";
        assert_eq!(colors(opacities).unwrap(), [GREEN, RED, WHITE]);
    }
}
