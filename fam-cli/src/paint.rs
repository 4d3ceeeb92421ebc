//! `--paint`: an attribute and its weight.

use serde::{Deserialize, Serialize};

/// A vertex attribute that says where seams are not wanted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Paint {
    /// The name of the attribute in the file.
    pub attribute: String,
    /// How much it counts; `None` if that is not said.
    pub weight: Option<f64>,
}

/// `ATTRIBUTE` or `ATTRIBUTE=WEIGHT`.
pub fn paint(text: &str) -> Result<Paint, String> {
    let (attribute, weight) = match text.split_once('=') {
        None => (text, None),
        Some((attribute, weight)) => match weight.parse() {
            Ok(weight) => (attribute, Some(weight)),
            Err(_) => return Err(format!("{weight:?} is no number")),
        },
    };
    match attribute.is_empty() {
        true => Err("the name of the attribute is missing".to_owned()),
        false => Ok(Paint {
            attribute: attribute.to_owned(),
            weight,
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_attribute_may_have_a_weight() {
        let of = |text: &str| paint(text).map(|paint| (paint.attribute, paint.weight));
        assert_eq!(of("_SEAMS"), Ok(("_SEAMS".to_owned(), None)));
        assert_eq!(of("a b=0.5"), Ok(("a b".to_owned(), Some(0.5))));
        for text in ["", "=2", "color=", "color=x"] {
            assert!(of(text).is_err(), "{text}");
        }
    }
}
