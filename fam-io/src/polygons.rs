//! Faces of any number of corners, their fan triangulation, and how UVs given per triangle
//! go back to them.

use std::collections::HashMap;

use fam_surface::UvMap;

use crate::ReadFault;

/// The faces of a mesh, as lists of vertices.
#[derive(Debug, Default, Clone, PartialEq)]
pub(crate) struct Polygons {
    corners: Vec<u32>,
    ends: Vec<usize>,
}

impl Polygons {
    /// Adds a face; the caller leaves out those of fewer than three corners.
    pub fn push(&mut self, corners: impl IntoIterator<Item = u32>) {
        self.corners.extend(corners);
        self.ends.push(self.corners.len());
    }

    /// The number of faces.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// The corners of all faces, in order.
    pub fn corners(&self) -> &[u32] {
        &self.corners
    }

    /// The faces, in order.
    pub fn iter(&self) -> impl Iterator<Item = &[u32]> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts
            .zip(&self.ends)
            .map(|(start, &end)| &self.corners[start..end])
    }

    /// Every face as a fan around its first corner.
    pub fn triangles(&self) -> Vec<[u32; 3]> {
        self.iter().flat_map(fan).collect()
    }

    /// The edges along which fans divide their polygons.
    pub fn diagonals(&self) -> Vec<[u32; 2]> {
        let across = |face: &[u32]| -> Vec<[u32; 2]> {
            let inner = 2..face.len() - 1;
            inner.map(|k| [face[0], face[k]]).collect()
        };
        self.iter().flat_map(across).collect()
    }
}

/// A vertex of a face by its index in a file that counts from 0.
pub(crate) fn vertex(index: i64, face: usize, count: usize) -> Result<u32, ReadFault> {
    let exists = usize::try_from(index).is_ok_and(|index| index < count);
    let vertex = u32::try_from(index).ok().filter(|_| exists);
    vertex.ok_or(ReadFault::VertexOutOfRange {
        face,
        index,
        count,
        numbering: ", numbered from 0",
    })
}

/// A polygon as a fan of triangles around its first corner.
pub(crate) fn fan<T: Copy>(corners: &[T]) -> impl Iterator<Item = [T; 3]> {
    corners
        .windows(2)
        .skip(1)
        .map(|pair| [corners[0], pair[0], pair[1]])
}

/// Part of a polygon: which of its corners, each with the index of its UV.
pub(crate) type Piece = Vec<(usize, u32)>;

/// Deals the UV triangles of a mesh out to its polygons, in order.
pub(crate) struct Pieces<'a> {
    uvs: &'a UvMap,
    used: usize,
}

impl<'a> Pieces<'a> {
    pub fn of(uvs: &'a UvMap) -> Self {
        Self { uvs, used: 0 }
    }

    /// How many triangles are left.
    pub fn remaining(&self) -> usize {
        self.uvs.triangles().len() - self.used
    }

    /// The next polygon, of so many corners: in one piece, or as its triangles if their UVs
    /// disagree at a shared corner (a seam along a diagonal of the polygon).
    pub fn next(&mut self, corners: usize) -> Vec<Piece> {
        let fan = &self.uvs.triangles()[self.used..self.used + corners - 2];
        self.used += fan.len();
        let uv = |index: u32| self.uvs.uvs()[index as usize];
        let whole = fan
            .windows(2)
            .all(|pair| uv(pair[0][0]) == uv(pair[1][0]) && uv(pair[0][2]) == uv(pair[1][1]));
        if whole {
            let first = [(0, fan[0][0]), (1, fan[0][1])];
            let others = fan
                .iter()
                .enumerate()
                .map(|(k, triangle)| (k + 2, triangle[2]));
            vec![first.into_iter().chain(others).collect()]
        } else {
            fan.iter()
                .enumerate()
                .map(|(k, t)| vec![(0, t[0]), (k + 1, t[1]), (k + 2, t[2])])
                .collect()
        }
    }
}

/// A mesh with exactly one UV per vertex: vertices on a seam are there several times.
pub(crate) struct Split {
    /// The UVs of the original vertices and then of the added ones; zero for a vertex that
    /// is in no face.
    pub uvs: Vec<[f32; 2]>,
    /// For every added vertex, the one it is a copy of.
    pub added: Vec<u32>,
    /// For every polygon, its pieces as lists of vertices.
    pub faces: Vec<Vec<Vec<u32>>>,
}

impl Split {
    /// Splits the vertices of `polygons` where the UVs require it.
    pub fn at_seams(vertices: usize, polygons: &Polygons, uvs: &UvMap) -> Self {
        let mut first: Vec<Option<[f32; 2]>> = vec![None; vertices];
        let mut copies: HashMap<(u32, [u32; 2]), u32> = HashMap::new();
        let mut added = Vec::new();
        let mut added_uvs = Vec::new();
        let mut place = |vertex: u32, uv: [f32; 2]| {
            if *first[vertex as usize].get_or_insert(uv) == uv {
                return vertex;
            }
            // Adding zero makes −0 and 0 one.
            let key = (vertex, uv.map(|c| (c + 0.0).to_bits()));
            *copies.entry(key).or_insert_with(|| {
                added.push(vertex);
                added_uvs.push(uv);
                (vertices + added.len() - 1) as u32
            })
        };
        let mut pieces = Pieces::of(uvs);
        let faces = polygons
            .iter()
            .map(|polygon| {
                let pieces = pieces.next(polygon.len());
                let vertices = pieces.iter().map(|piece| {
                    piece
                        .iter()
                        .map(|&(corner, uv)| place(polygon[corner], uvs.uvs()[uv as usize]))
                        .collect()
                });
                vertices.collect()
            })
            .collect();
        let first = first.into_iter().map(Option::unwrap_or_default);
        Self {
            uvs: first.chain(added_uvs).collect(),
            added,
            faces,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Polygons {
        let mut polygons = Polygons::default();
        polygons.push([0, 1, 2, 3]);
        polygons
    }

    #[test]
    fn faces_become_fans() {
        let mut polygons = square();
        polygons.push([4, 1, 0]);
        assert_eq!(polygons.triangles(), [[0, 1, 2], [0, 2, 3], [4, 1, 0]]);
        polygons.push([4, 5, 6, 7, 8]);
        assert_eq!(polygons.diagonals(), [[0, 2], [4, 6], [4, 7]]);
        assert_eq!(
            polygons.iter().collect::<Vec<_>>(),
            [&[0, 1, 2, 3][..], &[4, 1, 0], &[4, 5, 6, 7, 8]]
        );
    }

    #[test]
    fn a_polygon_stays_whole_unless_a_seam_crosses_it() {
        // Equal values under several indices are no seam.
        let uvs = vec![[0., 0.], [1., 0.], [1., 1.], [0., 1.], [0., 0.], [5., 5.]];
        let whole = UvMap::new(uvs.clone(), vec![[0, 1, 2], [4, 2, 3]]).unwrap();
        let pieces = Pieces::of(&whole).next(4);
        assert_eq!(pieces, [[(0, 0), (1, 1), (2, 2), (3, 3)]]);
        let torn = UvMap::new(uvs, vec![[0, 1, 2], [0, 5, 3]]).unwrap();
        let pieces = Pieces::of(&torn).next(4);
        assert_eq!(pieces, [[(0, 0), (1, 1), (2, 2)], [(0, 0), (2, 5), (3, 3)]]);
    }

    #[test]
    fn seam_vertices_are_split_once_per_uv() {
        let mut polygons = square();
        polygons.push([0, 3, 4]);
        polygons.push([3, 0, 5]);
        let uvs = vec![[0., 0.], [1., 0.], [1., 1.], [0., 1.], [-0., 0.], [9., 9.]];
        let map = UvMap::new(uvs, vec![[0, 1, 2], [0, 2, 3], [4, 5, 1], [5, 0, 2]]).unwrap();
        let split = Split::at_seams(7, &polygons, &map);
        let faces = [
            vec![vec![0, 1, 2, 3]],
            vec![vec![0, 7, 4]],
            vec![vec![7, 0, 5]],
        ];
        assert_eq!(split.faces, faces);
        assert_eq!(split.added, [3]);
        assert_eq!(
            split.uvs[3..],
            [[0., 1.], [1., 0.], [1., 1.], [0., 0.], [9., 9.]]
        );
    }

    #[test]
    fn positive_and_negative_zero_are_one_uv() {
        let mut polygons = Polygons::default();
        (0..3).for_each(|_| polygons.push([0, 1, 2]));
        let uvs = vec![[9., 9.], [0., 1.], [-0., 1.]];
        let map = UvMap::new(uvs, vec![[0; 3], [1; 3], [2; 3]]).unwrap();
        assert_eq!(Split::at_seams(3, &polygons, &map).added, [0, 1, 2]);
    }
}
