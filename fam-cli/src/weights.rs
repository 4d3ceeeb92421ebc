//! `--weight`: more texels for a material or an object.

use fam::WEIGHTS;
use fam_io::Labels;
use serde::{Deserialize, Serialize};

use crate::failure::Failure;

/// A material or an object and by which factor its texel density is higher than that of others.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Weight {
    /// The name of the material or the object.
    pub name: String,
    /// The factor, within [`WEIGHTS`].
    pub factor: f64,
}

impl Weight {
    /// Puts the factor in the place of those of the triangles that it is for; there is one for every
    /// triangle.
    ///
    /// # Errors
    /// There is no material and no object of the name.
    pub(crate) fn give(&self, labels: &Labels, factors: &mut [f64]) -> Result<(), Failure> {
        let named = labels.named(&self.name, factors.len());
        for t in named.map_err(Failure::input)? {
            factors[t as usize] = self.factor;
        }
        Ok(())
    }
}

/// `NAME=FACTOR`. The name may have equals signs.
pub fn weight(text: &str) -> Result<Weight, String> {
    let (name, factor) = text.rsplit_once('=').ok_or("it has no =FACTOR")?;
    match factor.parse() {
        Ok(factor) if WEIGHTS.contains(&factor) => Ok(Weight {
            name: name.to_owned(),
            factor,
        }),
        _ => Err(format!(
            "{factor:?} is no factor from {} to {}",
            WEIGHTS.start(),
            WEIGHTS.end()
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
