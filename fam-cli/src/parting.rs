//! What of a document belongs together.

use fam::Parting;
use fam_io::Labels;

use crate::failure::Failure;
use crate::weights::Weight;

/// Objects are apart; materials too, each with a square of its own, if `per_material`.
pub fn parting(labels: &Labels, per_material: bool) -> Parting {
    if per_material && !labels.materials.is_empty() {
        Parting::by_material(&labels.objects, &labels.materials)
    } else {
        Parting::by_object(&labels.objects)
    }
}

/// The same with charts of some materials or objects larger than others. Where there are any, materials
/// are apart even if they share a square. There are so many `triangles`.
///
/// # Errors
/// There is no material and no object of a name.
pub fn weighted(
    labels: &Labels,
    triangles: usize,
    parting: Parting,
    weights: &[Weight],
) -> Result<Parting, Failure> {
    if weights.is_empty() {
        return Ok(parting);
    }
    let mut parting = match parting.squares.is_empty() && !labels.materials.is_empty() {
        true => Parting {
            squares: Vec::new(),
            ..Parting::by_material(&labels.objects, &labels.materials)
        },
        false => parting,
    };
    let count = parting
        .labels
        .iter()
        .max()
        .map_or(1, |&last| last as usize + 1);
    parting.weights = vec![1.0; count];
    for weight in weights {
        for t in labels
            .named(&weight.name, triangles)
            .map_err(Failure::input)?
        {
            let label = parting.labels.get(t as usize).copied().unwrap_or(0);
            parting.weights[label as usize] = weight.factor;
        }
    }
    Ok(parting)
}
