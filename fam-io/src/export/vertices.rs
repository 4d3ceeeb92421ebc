//! Vertices that have one normal and one UV each.

use std::collections::HashMap;

use super::parts::{Corner, Part};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Vertex {
    /// The vertex of the mesh.
    pub of: u32,
    /// Zero if it is unknown.
    pub normal: [f32; 3],
    /// 0 0 where no face has the vertex.
    pub uv: [f32; 2],
}

/// The vertices of a mesh, split where its corners disagree.
#[derive(Debug, Default)]
pub(super) struct VertexTable {
    /// The vertices of the mesh in their order, and then the copies.
    pub vertices: Vec<Vertex>,
    /// The vertex of every corner of the faces.
    pub corners: Vec<u32>,
}

impl VertexTable {
    pub fn of(part: &Part) -> Self {
        if part.mesh.polygons.iter().next().is_none() {
            Self::of_points(part)
        } else {
            let corners = part.faces.corners().iter();
            Self::split(part, corners.map(|corner| part.corner_normal(corner)))
        }
    }

    /// The points of a mesh without faces.
    pub fn of_points(part: &Part) -> Self {
        let vertex = |at: usize| Vertex {
            of: at as u32,
            normal: part.point_normal(at),
            uv: part.point_uvs.get(at).copied().unwrap_or_default(),
        };
        Self {
            vertices: (0..part.mesh.positions.len()).map(vertex).collect(),
            corners: Vec::new(),
        }
    }

    /// One vertex for every normal and UV that the corners of a vertex have; `normals` are
    /// those of the corners of all faces.
    pub fn split(part: &Part, normals: impl Iterator<Item = [f32; 3]>) -> Self {
        let unused = |at| Vertex {
            of: at as u32,
            normal: [0.0; 3],
            uv: [0.0; 2],
        };
        let mut vertices: Vec<Vertex> = (0..part.mesh.positions.len()).map(unused).collect();
        let mut used = vec![false; vertices.len()];
        let mut copies: HashMap<(u32, [u32; 3], [u32; 2]), u32> = HashMap::new();
        let mut place = |(corner, normal): (&Corner, [f32; 3])| {
            let vertex = Vertex {
                of: corner.vertex,
                normal,
                uv: part.uvs[corner.uv as usize],
            };
            let first = corner.vertex as usize;
            if !std::mem::replace(&mut used[first], true) {
                vertices[first] = vertex;
            }
            if vertices[first] == vertex {
                return corner.vertex;
            }
            // Adding zero makes −0 and 0 one.
            let bits = |c: f32| (c + 0.0).to_bits();
            let key = (vertex.of, vertex.normal.map(bits), vertex.uv.map(bits));
            *copies.entry(key).or_insert_with(|| {
                vertices.push(vertex);
                (vertices.len() - 1) as u32
            })
        };
        let corners = part.faces.corners().iter().zip(normals);
        Self {
            corners: corners.map(&mut place).collect(),
            vertices,
        }
    }

    /// Only the vertices that faces have, in the order of their first use.
    pub fn without_unused(self) -> Self {
        let mut vertices = Vec::new();
        let mut numbers = vec![None; self.vertices.len()];
        let mut number = |old: u32| {
            *numbers[old as usize].get_or_insert_with(|| {
                vertices.push(self.vertices[old as usize]);
                (vertices.len() - 1) as u32
            })
        };
        Self {
            corners: self.corners.iter().map(|&old| number(old)).collect(),
            vertices,
        }
    }
}
