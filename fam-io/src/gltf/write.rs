//! UVs put into the primitives of a document.

use std::collections::{BTreeMap, HashMap};

use ::gltf::json::accessor::{FLOAT, UNSIGNED_BYTE};
use ::gltf::json::buffer::ARRAY_BUFFER;
use ::gltf::json::mesh::TRIANGLES;
use fam_surface::UvMap;
use fam_surface::polygons::{Polygons, Split};
use serde_json::{Value, json};

use super::geometry::{Attribute, Geometry, Pool, Primitive};
use super::package::Package;
use super::tangents::depend_on;

/// Puts UVs into a document. What it adds is at the end of the lists.
pub(super) struct UvWriter<'a> {
    pub package: &'a mut Package,
    pub geometry: &'a Geometry,
    /// The `n` of `TEXCOORD_n`.
    pub uv_set: u32,
    /// For the accessors that were added, those whose place they take.
    pub replaced: BTreeMap<usize, usize>,
}

/// What becomes of the attributes of a pool.
#[derive(Default)]
struct Changes {
    /// Accessors with vertices added, by the ones they are made from.
    copies: HashMap<usize, usize>,
    /// Sets that are written, and the accessor of their UVs.
    uv_names: Vec<String>,
    uvs: usize,
    drop_tangents: bool,
    /// Displacements of zero for a morph target that loses all else.
    still: Option<usize>,
}

impl UvWriter<'_> {
    /// Writes one UV per vertex of the surface.
    pub fn write_points(&mut self, uvs: &[[f32; 2]]) {
        for (pool, members) in members_of(self.geometry) {
            let uvs: Vec<_> = uvs[pool.vertices.clone()].iter().map(downwards).collect();
            let members: Vec<_> = members.iter().map(|&(primitive, _)| primitive).collect();
            let changes = self.changes(pool, &members, &[], &uvs);
            for primitive in members {
                self.change_attributes(primitive, &changes);
            }
        }
    }

    /// Writes one triangle of UVs for each of the surface.
    pub fn write_mesh(&mut self, uvs: &UvMap) {
        for (pool, members) in members_of(self.geometry) {
            self.write_pool(pool, &members, uvs);
        }
    }

    /// Writes the UVs of the primitives of a pool, each given with its first triangle.
    fn write_pool(&mut self, pool: &Pool, members: &[(&Primitive, usize)], uvs: &UvMap) {
        let mut polygons = Polygons::default();
        let mut corners = Vec::new();
        for &(primitive, start) in members {
            for (t, &triangle) in primitive.triangles.iter().enumerate() {
                polygons.push(triangle);
                corners.extend(uvs.corners(start + t).iter().map(downwards));
            }
        }
        let triangles = (0..corners.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
        let uvs = UvMap::new(corners, triangles.collect())
            .expect("UVs that were finite are so with V pointing down");
        let split = Split::at_seams(pool.vertices.len(), &polygons, &uvs);
        let primitives: Vec<_> = members.iter().map(|&(primitive, _)| primitive).collect();
        let changes = self.changes(pool, &primitives, &split.added, &split.uvs);
        let mut faces = split.faces.iter().flatten();
        for primitive in primitives {
            self.change_attributes(primitive, &changes);
            let corners = faces.by_ref().take(primitive.triangles.len()).flatten();
            let corners: Vec<u32> = corners.copied().collect();
            let grown = !split.added.is_empty();
            if !primitive.triangles.iter().flatten().eq(&corners) || grown && !primitive.is_indexed
            {
                self.write_indices(primitive, &corners, split.uvs.len());
            }
        }
    }

    /// Adds the accessors that the primitives of a pool need: `added` are copies of vertices.
    fn changes(
        &mut self,
        pool: &Pool,
        members: &[&Primitive],
        added: &[u32],
        uvs: &[[f32; 2]],
    ) -> Changes {
        let sets = self.written_sets(pool);
        let mut changes = Changes {
            uv_names: sets.iter().map(|set| format!("TEXCOORD_{set}")).collect(),
            drop_tangents: members
                .iter()
                .any(|primitive| depend_on(&sets, self.package, primitive)),
            ..Changes::default()
        };
        let kept = pool.attributes.iter().filter(|a| changes.keeps(a));
        let displaced = pool.targets.iter().flatten().filter(|a| changes.keeps(a));
        let kept: Vec<_> = kept.chain(displaced).collect();
        if !added.is_empty() {
            for attribute in kept {
                let copy = changes.copies.entry(attribute.accessor);
                copy.or_insert_with(|| self.grow(attribute, added));
            }
        }
        let loses_all = |target: &Vec<Attribute>| !target.iter().any(|a| changes.keeps(a));
        if pool.targets.iter().any(loses_all) {
            changes.still = Some(self.package.push("accessors", displacements(uvs.len())));
        }
        changes.uvs = self.add_uvs(pool, uvs, sets.len() > 1);
        changes
    }

    /// The set to write, and those below it that are missing, since sets are numbered without
    /// gaps. One that an earlier run has added that way counts as missing.
    fn written_sets(&self, pool: &Pool) -> Vec<u32> {
        let accessor = |set: u32| Some(pool.attribute(&format!("TEXCOORD_{set}"))?.accessor);
        let own = accessor(self.uv_set);
        let is_shared = own.is_some_and(|own| {
            let name = &self.package.entries("accessors")[own]["name"];
            name.as_str() == Some(&format!("TEXCOORD_{}", self.uv_set))
        });
        let is_missing =
            |set: &u32| accessor(*set).is_none_or(|other| is_shared && Some(other) == own);
        let gaps = (0..self.uv_set).filter(is_missing);
        gaps.chain([self.uv_set]).collect()
    }

    /// An accessor with copies of some of its elements after its own.
    fn grow(&mut self, attribute: &Attribute, added: &[u32]) -> usize {
        let elements = attribute.elements;
        let mut accessor = self.package.json["accessors"][attribute.accessor].clone();
        accessor["count"] = (elements.count + added.len()).into();
        if !elements.is_void() {
            let size = elements.size();
            let stride = size.next_multiple_of(4);
            let old = elements.bytes(&self.package.bin);
            let copies = added.iter().map(|&v| v as usize);
            let mut bytes = Vec::with_capacity((elements.count + added.len()) * stride);
            for vertex in (0..elements.count).chain(copies) {
                bytes.extend_from_slice(&old[vertex * size..][..size]);
                bytes.resize(bytes.len().next_multiple_of(4), 0);
            }
            let padded = (stride != size).then_some(stride as u32);
            let view = self.package.add_view(&bytes, Some(ARRAY_BUFFER), padded);
            accessor["bufferView"] = view.into();
            if let Some(accessor) = accessor.as_object_mut() {
                accessor.shift_remove("byteOffset");
                accessor.shift_remove("sparse");
            }
        }
        let grown = self.package.push("accessors", accessor);
        self.replaced.insert(grown, attribute.accessor);
        grown
    }

    fn add_uvs(&mut self, pool: &Pool, uvs: &[[f32; 2]], is_shared: bool) -> usize {
        let name = format!("TEXCOORD_{}", self.uv_set);
        let old = pool.attribute(&name).map(|attribute| attribute.accessor);
        let bounded = old.is_some_and(|old| self.has_bounds(old));
        let accessor = self.package.add_vectors(uvs, bounded);
        if let Some(old) = old {
            self.take_over(accessor, old);
        }
        let entry = &mut self.package.json["accessors"][accessor];
        if is_shared && entry.get("name").is_none() {
            entry["name"] = name.into();
        }
        accessor
    }

    /// Gives a primitive a list of triangles.
    fn write_indices(&mut self, primitive: &Primitive, corners: &[u32], vertices: usize) {
        let old = self.entry(primitive)["indices"]
            .as_u64()
            .map(|old| old as usize);
        let old_type = old.map(|old| &self.package.entries("accessors")[old]["componentType"]);
        let stays_narrow =
            old_type.is_some_and(|old| *old == UNSIGNED_BYTE) && vertices <= usize::from(u8::MAX);
        let accessor = if stays_narrow {
            self.package.add_indices_as(corners, UNSIGNED_BYTE)
        } else {
            self.package.add_indices(corners, vertices)
        };
        if let Some(old) = old {
            if self.has_bounds(old) {
                let entry = &mut self.package.json["accessors"][accessor];
                entry["min"] = json!([corners.iter().min()]);
                entry["max"] = json!([corners.iter().max()]);
            }
            self.take_over(accessor, old);
        }
        let entry = self.entry(primitive);
        entry["indices"] = accessor.into();
        if entry.get("mode").is_some_and(|mode| *mode != TRIANGLES) {
            entry["mode"] = TRIANGLES.into();
        }
    }

    fn has_bounds(&self, accessor: usize) -> bool {
        self.package.entries("accessors")[accessor]
            .get("max")
            .is_some()
    }

    /// Gives an added accessor whatever another one has that does not say where and what its
    /// elements are.
    fn take_over(&mut self, added: usize, old: usize) {
        const ELEMENTS: [&str; 9] = [
            "bufferView",
            "byteOffset",
            "componentType",
            "count",
            "max",
            "min",
            "normalized",
            "sparse",
            "type",
        ];
        let accessors = &mut self.package.json["accessors"];
        let kept = accessors[old].as_object().into_iter().flatten();
        let kept = kept.filter(|(key, _)| !ELEMENTS.contains(&key.as_str()));
        let kept: Vec<_> = kept
            .map(|(key, value)| (key.clone(), value.clone()))
            .collect();
        if let Some(added) = accessors[added].as_object_mut() {
            added.extend(kept);
        }
        self.replaced.insert(added, old);
    }

    fn entry(&mut self, primitive: &Primitive) -> &mut Value {
        &mut self.package.json["meshes"][primitive.mesh]["primitives"][primitive.index]
    }

    fn change_attributes(&mut self, primitive: &Primitive, changes: &Changes) {
        let entry = self.entry(primitive);
        changes.apply(&mut entry["attributes"]);
        for name in &changes.uv_names {
            entry["attributes"][name] = changes.uvs.into();
        }
        let targets = entry.get_mut("targets").and_then(Value::as_array_mut);
        for target in targets.into_iter().flatten() {
            changes.apply(target);
            for name in &changes.uv_names {
                target
                    .as_object_mut()
                    .map(|target| target.shift_remove(name));
            }
            if let (Some(still), true) = (changes.still, *target == json!({})) {
                target["POSITION"] = still.into();
            }
        }
    }
}

impl Changes {
    fn keeps(&self, attribute: &Attribute) -> bool {
        !(self.drop_tangents && attribute.name == "TANGENT"
            || self.uv_names.contains(&attribute.name))
    }

    /// Puts the new accessors in the place of the old ones.
    fn apply(&self, attributes: &mut Value) {
        let Some(attributes) = attributes.as_object_mut() else {
            return;
        };
        if self.drop_tangents {
            attributes.shift_remove("TANGENT");
        }
        for accessor in attributes.values_mut() {
            let old = accessor.as_u64().map(|old| old as usize);
            if let Some(&copy) = old.and_then(|old| self.copies.get(&old)) {
                *accessor = copy.into();
            }
        }
    }
}

/// The pools that have vertices, with their primitives, each given with its first triangle of
/// the surface.
fn members_of(geometry: &Geometry) -> Vec<(&Pool, Vec<(&Primitive, usize)>)> {
    let pools = geometry.pools.iter();
    let mut members: Vec<_> = pools.map(|pool| (pool, Vec::new())).collect();
    let mut first_triangle = 0;
    for primitive in &geometry.primitives {
        members[primitive.pool].1.push((primitive, first_triangle));
        first_triangle += primitive.triangles.len();
    }
    members.retain(|(pool, members)| !pool.vertices.is_empty() && !members.is_empty());
    members
}

/// A UV as glTF has it.
fn downwards(&[u, v]: &[f32; 2]) -> [f32; 2] {
    [u, 1.0 - v]
}

/// An accessor of zeros.
fn displacements(count: usize) -> Value {
    let zero = [0.0; 3];
    json!({"componentType": FLOAT, "count": count, "type": "VEC3", "min": zero, "max": zero})
}
