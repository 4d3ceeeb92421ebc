//! `--weight`: more texels for a material or an object.

use serde::{Deserialize, Serialize};

/// A material or an object and by which factor its texel density is higher than that of others.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Weight {
    pub name: String,
    pub factor: f64,
}

/// Most that a weight may be, and the least is one over it: charts beyond are no texel wide.
const MOST: f64 = 1000.0;

/// `NAME=FACTOR`. The name may have equals signs.
pub fn weight(text: &str) -> Result<Weight, String> {
    let (name, factor) = text.rsplit_once('=').ok_or("it has no =FACTOR")?;
    match factor.parse() {
        Ok(factor) if (1.0 / MOST..=MOST).contains(&factor) => Ok(Weight {
            name: name.to_owned(),
            factor,
        }),
        _ => Err(format!(
            "{factor:?} is no factor from {} to {MOST}",
            1.0 / MOST
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_has_a_factor() {
        let of = |text: &str| weight(text).map(|weight| (weight.name, weight.factor));
        assert_eq!(of("face=2"), Ok(("face".to_owned(), 2.0)));
        assert_eq!(of("a=b=0.5"), Ok(("a=b".to_owned(), 0.5)));
        for text in ["face", "face=", "face=0", "face=-1", "face=nan", "face=1e9"] {
            assert!(of(text).is_err(), "{text}");
        }
    }
}
