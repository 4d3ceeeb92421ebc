//! A piece of a component's mesh.

use std::collections::HashMap;

use fam_surface::TriangleMesh;

/// A part of the component that is still to be flattened.
pub struct Part {
    pub mesh: TriangleMesh,
    /// The component's vertex for every vertex of `mesh`.
    pub vertices: Vec<u32>,
    /// The component's triangle for every triangle of `mesh`.
    pub triangles: Vec<u32>,
    /// Where the corners of the triangles lie in a layout of the larger part that this one comes
    /// from, in units of the surface.
    pub placed: Option<Vec<[[f64; 2]; 3]>>,
}

impl Part {
    /// All of a component's mesh.
    pub fn whole(mesh: &TriangleMesh) -> Self {
        Self {
            mesh: mesh.clone(),
            vertices: (0..mesh.positions().len() as u32).collect(),
            triangles: (0..mesh.triangles().len() as u32).collect(),
            placed: None,
        }
    }

    /// Some of the triangles, by their numbers in the part. Vertices at one position stay apart if
    /// they were. `None` if there are no triangles.
    pub fn subset(&self, chosen: &[u32]) -> Option<Self> {
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
            .map(|&t| self.mesh.triangles()[t as usize].map(&mut compact))
            .collect();
        let position = |&v: &u32| self.mesh.positions()[v as usize];
        let positions = vertices.iter().map(position).collect();
        let chosen = chosen.iter().map(|&t| t as usize);
        Some(Self {
            mesh: TriangleMesh::new(positions, triangles).ok()?,
            vertices: vertices
                .iter()
                .map(|&v| self.vertices[v as usize])
                .collect(),
            triangles: chosen.clone().map(|t| self.triangles[t]).collect(),
            placed: self
                .placed
                .as_ref()
                .map(|placed| chosen.map(|t| placed[t]).collect()),
        })
    }
}

/// The two parts that a part falls into when it is divided.
pub fn halves(part: &Part, beyond: &[bool]) -> Vec<Part> {
    let half = |side: bool| {
        let all = 0..beyond.len() as u32;
        let chosen: Vec<u32> = all.filter(|&t| beyond[t as usize] == side).collect();
        part.subset(&chosen)
    };
    [false, true].into_iter().filter_map(half).collect()
}
