//! Equal parts that share their place in the UV square.

use std::collections::BTreeMap;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::marks::ComponentMarks;
use crate::{ComponentLayout, MeshInput};
use fam_surface::congruence::{Congruence, copies};
use fam_surface::{Component, TriangleMesh, UvMap};

/// Which components share their place in the square.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stack {
    /// None: every component has texels of its own.
    #[default]
    None,
    /// Those that are the same up to a rotation and a translation.
    Identical,
    /// These, and those that are mirror images of each other: one lies mirrored on the other's place,
    /// with all its triangles clockwise. With a [`Symmetry`](crate::Symmetry) the halves of symmetric
    /// components do so as well.
    Mirrored,
}

/// A component that shares the place of another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stacked {
    /// The component whose place it shares, the first of its kind.
    pub on: usize,
    /// Whether it is mirrored, on purpose.
    pub is_mirrored: bool,
}

/// Which components are copies of earlier ones and may lie on their places: those that go into the
/// same square at the same size, have the same marks and paint, and the same map if there is one.
pub(super) fn stacked(stack: Stack, input: &MeshInput) -> Vec<Option<Congruence>> {
    let list = &input.components.list;
    if stack == Stack::None {
        return list.iter().map(|_| None).collect();
    }
    let meshes: Vec<&TriangleMesh> = list.iter().map(|component| &component.mesh).collect();
    let groups = groups(input);
    let marks: Vec<ComponentMarks> = list
        .par_iter()
        .map(|component| input.marks.of_component(component))
        .collect();
    let fits = |i: usize, copy: &Congruence| {
        let has_same_map = input.map.is_none_or(|map| {
            let (own, of) = (&map[i], &map[copy.original]);
            let is_same = |(uv, &v): (&[f32; 2], &u32)| *uv == of[v as usize];
            own.iter().zip(&copy.vertices).all(is_same)
        });
        let paint = |of: usize, v: u32| {
            let vertex = list[of].vertices[v as usize];
            input.marks.paint().get(vertex as usize)
        };
        let mut vertices = (0..).zip(&copy.vertices);
        let has_same_paint = vertices.all(|(own, &of)| paint(i, own) == paint(copy.original, of));
        has_same_map
            && has_same_paint
            && marks[i].are_those_of(&marks[copy.original], &copy.vertices)
    };
    copies(&meshes, &groups, stack == Stack::Mirrored, &fits)
}

/// A number for every component: the same for those that go into one square at one size.
fn groups(input: &MeshInput) -> Vec<u32> {
    let mut numbers: BTreeMap<(u32, u64), u32> = BTreeMap::new();
    let number = |component: &Component| {
        let own = input.belonging(component.label);
        let next = numbers.len() as u32;
        *numbers
            .entry((own.square, own.weight.to_bits()))
            .or_insert(next)
    };
    input.components.list.iter().map(number).collect()
}

/// The layout of a component that lies on the place of another: bit for bit where that lies.
pub(super) fn laid_upon(
    component: &Component,
    copy: &Congruence,
    original: &Component,
    layout: &ComponentLayout,
) -> ComponentLayout {
    let corners = |(own, &t): (&[u32; 3], &u32)| {
        let of = original.mesh.triangles()[t as usize];
        let uvs = layout.uvs.triangles()[t as usize];
        own.map(|v| {
            let on = copy.vertices[v as usize];
            let corner = of.iter().position(|&w| w == on);
            corner.map_or(uvs[0], |corner| uvs[corner])
        })
    };
    let triangles = component.mesh.triangles().iter().zip(&copy.triangles);
    let triangles: Vec<[u32; 3]> = triangles.map(corners).collect();
    let uvs = UvMap::new(layout.uvs.uvs().to_vec(), triangles);
    ComponentLayout {
        uvs: uvs.unwrap_or_else(|error| unreachable!("{error}")),
        stacked: Some(Stacked {
            on: copy.original,
            is_mirrored: copy.is_mirrored,
        }),
        ..layout.clone()
    }
}
