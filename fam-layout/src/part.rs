//! A piece of a component's mesh.

use std::collections::HashMap;

use fam_surface::TriangleMesh;

/// A part of the component that is still to be flattened.
pub struct Part {
    pub mesh: TriangleMesh,
    /// For every vertex and triangle that of the component.
    pub vertices: Vec<u32>,
    pub triangles: Vec<u32>,
    /// Where the corners of the triangles lie in a layout of what it is a part of, in units of
    /// the surface.
    pub placed: Option<Vec<[[f64; 2]; 3]>>,
}

/// The two parts that a part falls into when it is divided. Vertices at one position stay
/// apart if they were.
pub fn halves(part: &Part, beyond: &[bool]) -> Vec<Part> {
    let half = |side: bool| {
        let chosen: Vec<usize> = (0..beyond.len()).filter(|&t| beyond[t] == side).collect();
        let mut index: HashMap<u32, u32> = HashMap::new();
        let mut vertices = Vec::new();
        let mut compact = |v: u32| {
            *index.entry(v).or_insert_with(|| {
                vertices.push(v);
                vertices.len() as u32 - 1
            })
        };
        let triangles: Vec<[u32; 3]> = chosen
            .iter()
            .map(|&t| part.mesh.triangles()[t].map(&mut compact))
            .collect();
        let position = |&v: &u32| part.mesh.positions()[v as usize];
        let positions = vertices.iter().map(position).collect();
        Some(Part {
            mesh: TriangleMesh::new(positions, triangles).ok()?,
            vertices: vertices
                .iter()
                .map(|&v| part.vertices[v as usize])
                .collect(),
            triangles: chosen.iter().map(|&t| part.triangles[t]).collect(),
            placed: part
                .placed
                .as_ref()
                .map(|placed| chosen.iter().map(|&t| placed[t]).collect()),
        })
    };
    [false, true].into_iter().filter_map(half).collect()
}
