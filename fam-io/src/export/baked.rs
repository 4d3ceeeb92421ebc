//! All meshes at all of their places, as one list of vertices and one of faces.

use super::parts::Part;
use super::vertices::VertexTable;

pub(super) struct Baked<'a> {
    parts: &'a [Part<'a>],
    tables: Vec<VertexTable>,
}

/// A vertex in the coordinates of the scene.
pub(super) struct BakedVertex {
    pub position: [f64; 3],
    /// Zero if it is unknown.
    pub normal: [f32; 3],
    /// Linear; white if the mesh has no colours.
    pub color: [f32; 4],
    pub uv: [f32; 2],
}

impl<'a> Baked<'a> {
    pub fn of(parts: &'a [Part]) -> Self {
        Self {
            parts,
            tables: parts.iter().map(VertexTable::of).collect(),
        }
    }

    pub fn has_normals(&self) -> bool {
        self.parts.iter().any(|part| part.mesh.normals.is_some())
    }

    pub fn has_colors(&self) -> bool {
        self.parts.iter().any(|part| part.mesh.colors.is_some())
    }

    pub fn vertex_count(&self) -> usize {
        let counts = self.each().map(|(_, table)| table.vertices.len());
        counts
            .zip(self.parts)
            .map(|(n, part)| n * part.places.len())
            .sum()
    }

    pub fn face_count(&self) -> usize {
        let counts = self.parts.iter().map(|part| part.faces.len());
        counts
            .zip(self.parts)
            .map(|(n, part)| n * part.places.len())
            .sum()
    }

    pub fn most_corners(&self) -> usize {
        let faces = self.parts.iter().flat_map(|part| part.faces.iter());
        faces.map(|face| face.corners.len()).max().unwrap_or(0)
    }

    fn each(&self) -> impl Iterator<Item = (&Part<'a>, &VertexTable)> {
        self.parts.iter().zip(&self.tables)
    }

    pub fn vertices(&self) -> impl Iterator<Item = BakedVertex> {
        self.each().flat_map(|(part, table)| {
            part.places.iter().flat_map(move |place| {
                table.vertices.iter().map(move |vertex| BakedVertex {
                    position: place.position(part.mesh.positions[vertex.of as usize]),
                    normal: place.normal(vertex.normal),
                    color: part.color(vertex.of as usize).unwrap_or([1.0; 4]),
                    uv: vertex.uv,
                })
            })
        })
    }

    /// The faces, as lists of vertices.
    pub fn faces(&self) -> impl Iterator<Item = Vec<usize>> {
        let mut next = 0;
        let placed = self
            .each()
            .flat_map(|(part, table)| part.places.iter().map(move |place| (part, table, place)));
        placed.flat_map(move |(part, table, place)| {
            let first = next;
            next += table.vertices.len();
            let mut rest = table.corners.as_slice();
            part.faces.iter().map(move |face| {
                let (corners, others) = rest.split_at(face.corners.len());
                rest = others;
                place.wind(corners.iter().map(|&at| first + at as usize).collect())
            })
        })
    }
}
