//! One number for each vertex, of attributes of any name.

use ::gltf::json::accessor::Type;

use super::geometry::{Attribute, Geometry, Pool};
use super::package::Package;
use crate::color::mean;

/// The numbers of all vertices; `None` if no pool has such an attribute.
pub(super) fn numbers(package: &Package, geometry: &Geometry, name: &str) -> Option<Vec<f64>> {
    let of = |pool: &Pool| {
        let attribute = pool.attribute(name)?;
        of_attribute(package, attribute)
    };
    let mut pools = geometry.pools.iter();
    pools.find(|pool| pool.attribute(name).is_some_and(has_numbers))?;
    // What has no colour is white.
    let missing = if is_color(name) { 1.0 } else { 0.0 };
    let pools = geometry.pools.iter();
    Some(
        pools
            .flat_map(|pool| of(pool).unwrap_or_else(|| vec![missing; pool.vertices.len()]))
            .collect(),
    )
}

/// The names of the attributes that are such numbers, each once.
pub(super) fn names(geometry: &Geometry) -> Vec<String> {
    let attributes = geometry.pools.iter().flat_map(|pool| &pool.attributes);
    let mut names: Vec<_> = attributes
        .filter(|attribute| has_numbers(attribute))
        .map(|attribute| attribute.name.clone())
        .collect();
    names.sort_unstable();
    names.dedup();
    names
}

fn of_attribute(package: &Package, attribute: &Attribute) -> Option<Vec<f64>> {
    let (bin, elements) = (&package.bin, &attribute.elements);
    match elements.kind {
        _ if !has_numbers(attribute) => None,
        Type::Scalar => Some(elements.vectors::<1>(bin).into_iter().flatten().collect()),
        _ => {
            let colors = elements.vectors::<3>(bin).into_iter();
            Some(colors.map(mean).collect())
        }
    }
}

/// Whether an attribute is a number, or a colour: one of those of glTF, or one of the
/// application's own attributes, whose names start with an underscore.
fn has_numbers(attribute: &Attribute) -> bool {
    let name = attribute.name.as_str();
    match attribute.elements.kind {
        Type::Scalar => true,
        Type::Vec3 | Type::Vec4 => is_color(name) || name.starts_with('_'),
        _ => false,
    }
}

fn is_color(name: &str) -> bool {
    name.starts_with("COLOR_")
}
