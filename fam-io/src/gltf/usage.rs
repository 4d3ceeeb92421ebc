//! What of a document is in use.

use std::collections::BTreeSet;

use serde_json::Value;

use super::package::Package;

/// Extensions that refer neither to accessors nor to buffer views, by how their names start;
/// any number in another one may be such a reference.
const WITHOUT_REFERENCES: [&str; 4] = [
    "KHR_lights_",
    "KHR_materials_",
    "KHR_texture_",
    "EXT_texture_",
];

/// The accessors that something refers to.
pub(super) fn used_accessors(package: &Package) -> BTreeSet<usize> {
    let primitives = package
        .entries("meshes")
        .iter()
        .flat_map(|mesh| elements(&mesh["primitives"]));
    let vertices = primitives.flat_map(|primitive| {
        let targets = elements(&primitive["targets"]);
        std::iter::once(&primitive["attributes"])
            .chain(targets)
            .filter_map(Value::as_object)
            .flat_map(|attributes| attributes.values())
            .chain([&primitive["indices"]])
    });
    let skins = package.entries("skins").iter();
    let skins = skins.map(|skin| &skin["inverseBindMatrices"]);
    let samplers = package
        .entries("animations")
        .iter()
        .flat_map(|animation| elements(&animation["samplers"]));
    let samplers = samplers.flat_map(|sampler| [&sampler["input"], &sampler["output"]]);
    let mut used: BTreeSet<_> = indices(vertices.chain(skins).chain(samplers)).collect();
    numbers_in_extensions(&package.json, &mut used);
    used
}

/// The buffer views that something refers to.
pub(super) fn used_views(package: &Package) -> BTreeSet<usize> {
    let accessors = package.entries("accessors").iter().flat_map(|accessor| {
        let sparse = &accessor["sparse"];
        [
            &accessor["bufferView"],
            &sparse["indices"]["bufferView"],
            &sparse["values"]["bufferView"],
        ]
    });
    let images = package.entries("images").iter();
    let images = images.map(|image| &image["bufferView"]);
    let mut used: BTreeSet<_> = indices(accessors.chain(images)).collect();
    numbers_in_extensions(&package.json, &mut used);
    used
}

fn elements(list: &Value) -> impl Iterator<Item = &Value> {
    list.as_array().into_iter().flatten()
}

fn indices<'a>(values: impl Iterator<Item = &'a Value>) -> impl Iterator<Item = usize> {
    values.filter_map(Value::as_u64).map(|index| index as usize)
}

/// Adds all whole numbers in extensions, wherever they are.
fn numbers_in_extensions(value: &Value, used: &mut BTreeSet<usize>) {
    match value {
        Value::Array(list) => list
            .iter()
            .for_each(|value| numbers_in_extensions(value, used)),
        Value::Object(object) => {
            for (key, value) in object {
                match value {
                    Value::Object(extensions) if key == "extensions" => {
                        let may_refer = |name: &str| {
                            !WITHOUT_REFERENCES
                                .iter()
                                .any(|start| name.starts_with(start))
                        };
                        let all = extensions.iter().filter(|(name, _)| may_refer(name));
                        all.for_each(|(_, extension)| numbers(extension, used));
                    }
                    _ => numbers_in_extensions(value, used),
                }
            }
        }
        _ => {}
    }
}

fn numbers(value: &Value, found: &mut BTreeSet<usize>) {
    match value {
        Value::Array(list) => list.iter().for_each(|value| numbers(value, found)),
        Value::Object(object) => object.values().for_each(|value| numbers(value, found)),
        _ => found.extend(indices(std::iter::once(value))),
    }
}
