//! Faces of any number of corners, the triangles they become, and how UVs given per triangle go
//! back to them.

use std::collections::{BTreeMap, HashMap};

use crate::ears::ears;
use crate::uv_map::UvMap;

/// The faces of a mesh, as lists of vertices.
#[derive(Debug, Default, Clone, PartialEq)]
pub struct Polygons {
    corners: Vec<u32>,
    ends: Vec<usize>,
    divisions: Divisions,
}

/// How the faces that are no fans become triangles: for the number of a face, its triangles by
/// the numbers of its corners.
#[derive(Debug, Default, Clone, PartialEq)]
pub struct Divisions(BTreeMap<usize, Vec<[u32; 3]>>);

/// The triangles of one face.
#[derive(Debug, Clone, Copy)]
pub struct Division<'a> {
    corners: usize,
    /// Of a face that is no fan.
    triangles: Option<&'a [[u32; 3]]>,
}

impl Polygons {
    /// Adds a face; the caller leaves out those of fewer than three corners.
    pub fn push(&mut self, corners: impl IntoIterator<Item = u32>) {
        self.corners.extend(corners);
        self.ends.push(self.corners.len());
    }

    /// Divides the faces that a fan would fold over in another way, once all are there.
    ///
    /// # Panics
    /// If a vertex has no position.
    pub fn divide(&mut self, positions: &[[f64; 3]]) {
        let divided = |(face, corners): (usize, &[u32])| {
            let corners: Vec<_> = corners.iter().map(|&v| positions[v as usize]).collect();
            Some((face, ears(&corners)?))
        };
        self.divisions = Divisions(self.iter().enumerate().filter_map(divided).collect());
    }

    /// The number of faces.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// Whether there are no faces.
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
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

    /// The faces with their triangles, in order.
    pub fn divided(&self) -> impl Iterator<Item = (&[u32], Division<'_>)> {
        let faces = self.iter().enumerate();
        faces.map(|(number, face)| (face, self.divisions.of(number, face.len())))
    }

    /// How the faces that are no fans become triangles.
    pub fn divisions(&self) -> &Divisions {
        &self.divisions
    }

    /// The triangles of all faces, in order: fans around the first corner, unless they would fold
    /// over.
    pub fn triangles(&self) -> Vec<[u32; 3]> {
        self.divided()
            .flat_map(|(face, division)| division.of(face))
            .collect()
    }

    /// The edges inside of faces: those along which they are divided, and those of bridges, which
    /// a face has on both sides.
    pub fn diagonals(&self) -> Vec<[u32; 2]> {
        let inside = |(face, division): (&[u32], Division)| -> Vec<[u32; 2]> {
            let last = face.len() - 1;
            let cuts = division
                .corners()
                .flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]])
                // The other triangle has it the other way round.
                .filter(|&[a, b]| a < b && b - a > 1 && b - a < last)
                .map(|edge| edge.map(|corner| face[corner]));
            let mut inner: Vec<[u32; 2]> = cuts.collect();
            if division.triangles.is_some() {
                inner.extend(bridges(face));
            }
            inner
        };
        self.divided().flat_map(inside).collect()
    }
}

/// The edges that a face has in both directions.
fn bridges(face: &[u32]) -> impl Iterator<Item = [u32; 2]> {
    let ends = face.iter().zip(face.iter().cycle().skip(1));
    let mut edges: Vec<([u32; 2], bool)> = ends
        .map(|(&a, &b)| ([a.min(b), a.max(b)], a < b))
        .filter(|([a, b], _)| a != b)
        .collect();
    edges.sort_unstable();
    edges.dedup();
    let both: Vec<[u32; 2]> = edges
        .windows(2)
        .filter(|pair| pair[0].0 == pair[1].0)
        .map(|pair| pair[0].0)
        .collect();
    both.into_iter()
}

impl Divisions {
    /// The triangles of a face by its number and how many corners it has.
    pub fn of(&self, face: usize, corners: usize) -> Division<'_> {
        Division {
            corners,
            triangles: self.0.get(&face).map(Vec::as_slice),
        }
    }
}

impl<'a> Division<'a> {
    /// That of a face of three corners.
    pub const TRIANGLE: Self = Self {
        corners: 3,
        triangles: None,
    };

    /// How many triangles there are.
    pub fn count(self) -> usize {
        self.corners - 2
    }

    /// The triangles by the numbers of the face's corners.
    pub fn corners(self) -> impl Iterator<Item = [usize; 3]> + 'a {
        (0..self.count()).map(move |k| match self.triangles {
            Some(triangles) => triangles[k].map(|corner| corner as usize),
            None => [0, k + 1, k + 2],
        })
    }

    /// The triangles, given what the corners of the face are.
    pub fn of<T: Copy>(self, corners: &'a [T]) -> impl Iterator<Item = [T; 3]> + 'a {
        self.corners()
            .map(|triangle| triangle.map(|corner| corners[corner]))
    }
}

/// Part of a polygon: which of its corners, each with the index of its UV.
pub type Piece = Vec<(usize, u32)>;

/// Deals the UV triangles of a mesh out to its polygons, in order.
pub struct Pieces<'a> {
    uvs: &'a UvMap,
    used: usize,
}

impl<'a> Pieces<'a> {
    /// Deals out the triangles of a map, from the first on.
    pub fn of(uvs: &'a UvMap) -> Self {
        Self { uvs, used: 0 }
    }

    /// How many triangles are left.
    pub fn remaining(&self) -> usize {
        self.uvs.triangles().len() - self.used
    }

    /// The next polygon, divided in this way: in one piece, or as its triangles if their UVs
    /// disagree at a shared corner (a seam along a diagonal of the polygon).
    pub fn next(&mut self, division: Division) -> Vec<Piece> {
        let triangles = &self.uvs.triangles()[self.used..self.used + division.count()];
        self.used += triangles.len();
        let uv = |index: u32| self.uvs.uvs()[index as usize];
        let mut whole: Vec<Option<u32>> = vec![None; division.corners];
        let corners = || division.corners().zip(triangles);
        let agree = corners()
            .flat_map(|(corners, indices)| corners.into_iter().zip(*indices))
            .all(|(corner, index)| uv(*whole[corner].get_or_insert(index)) == uv(index));
        if agree {
            let with_uv = (0..).zip(whole);
            vec![with_uv.filter_map(|(c, uv)| Some((c, uv?))).collect()]
        } else {
            corners()
                .map(|(corners, indices)| corners.into_iter().zip(*indices).collect())
                .collect()
        }
    }
}

/// A mesh with exactly one UV per vertex: vertices on a seam are there several times.
pub struct Split {
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
            .divided()
            .map(|(polygon, division)| {
                let pieces = pieces.next(division);
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

    /// The triangles of one face whose corners are at these places; each has area, together they
    /// have that of the face.
    fn divided(places: &[[f64; 2]], face: &[u32]) -> Vec<[u32; 3]> {
        // Seen from the side, so that the plane is no plane of the axes.
        let place = |&[x, y]: &[f64; 2]| [x - 0.5 * y, x + y, 2.0 * y];
        let positions: Vec<_> = places.iter().map(place).collect();
        let mut polygons = Polygons::default();
        polygons.push(face.iter().copied());
        polygons.divide(&positions);
        let area = |corners: &[u32]| -> f64 {
            let at = |v: u32| places[v as usize];
            let ends = corners.iter().zip(corners.iter().cycle().skip(1));
            let cross = |(&a, &b): (&u32, &u32)| at(a)[0] * at(b)[1] - at(b)[0] * at(a)[1];
            0.5 * ends.map(cross).sum::<f64>()
        };
        let triangles = polygons.triangles();
        assert_eq!(triangles.len(), face.len() - 2);
        let sign = area(face).signum();
        assert!(
            triangles.iter().all(|t| sign * area(t) > 1e-9),
            "{triangles:?}"
        );
        let sum: f64 = triangles.iter().map(|t| area(t)).sum();
        assert!((sum / area(face) - 1.0).abs() < 1e-9);
        triangles
    }

    #[test]
    fn concave_polygons_are_divided_without_folds() {
        let dart = [[0., 0.], [2., 1.], [0., 2.], [1., 1.]];
        // Its fan around the first corner folds over where that leaves the polygon.
        assert_eq!(divided(&dart, &[3, 0, 1, 2]), [[3, 0, 1], [3, 1, 2]]);
        for face in [[0, 1, 2, 3], [3, 2, 1, 0], [2, 3, 0, 1]] {
            let triangles = divided(&dart, &face);
            assert!(triangles.iter().all(|t| t.contains(&1) && t.contains(&3)));
        }
        let comb: Vec<[f64; 2]> = (0..9)
            .flat_map(|k| [[f64::from(k), 0.0], [f64::from(k) + 0.5, 3.0]])
            .chain([[9.0, 4.0], [0.0, 4.0]])
            .collect();
        let face: Vec<u32> = (0..comb.len() as u32).collect();
        divided(&comb, &face);
        let backwards: Vec<u32> = face.iter().rev().copied().collect();
        divided(&comb, &backwards);
    }

    /// A square with two holes, bridged to one corner, whose own corners it goes through twice.
    const HOLES: [[f64; 2]; 12] = [
        [0., 0.],
        [9., 0.],
        [9., 9.],
        [0., 9.],
        [1., 1.],
        [1., 3.],
        [3., 3.],
        [3., 1.],
        [5., 5.],
        [5., 7.],
        [7., 7.],
        [7., 5.],
    ];
    const BRIDGED: [u32; 16] = [0, 1, 2, 3, 0, 4, 5, 6, 8, 9, 10, 11, 8, 6, 7, 4];

    #[test]
    fn holes_that_are_bridged_stay_open() {
        let triangles = divided(&HOLES, &BRIDGED);
        let inside =
            |center: [f64; 2], low: f64, high: f64| center.iter().all(|c| (low..=high).contains(c));
        for t in &triangles {
            let center = [0, 1].map(|k| t.iter().map(|&v| HOLES[v as usize][k]).sum::<f64>() / 3.0);
            assert!(
                !inside(center, 1.0, 3.0) && !inside(center, 5.0, 7.0),
                "{t:?}"
            );
        }
        let mut polygons = Polygons::default();
        polygons.push(BRIDGED);
        let place = |[x, y]: [f64; 2]| [x, y, 0.0];
        polygons.divide(&HOLES.map(place));
        let mut inner = polygons.diagonals();
        for bridge in [[0, 4], [6, 8]] {
            assert!(inner.contains(&bridge));
        }
        inner.iter_mut().for_each(|edge| edge.sort_unstable());
        inner.sort_unstable();
        inner.dedup();
        assert_eq!(inner.len(), 13 + 2);
        // Its corners keep the UVs that its triangles have, and it stays whole.
        let uvs: Vec<[f32; 2]> = BRIDGED
            .iter()
            .zip(0u8..)
            .map(|(_, k)| [k.into(), 0.0])
            .collect();
        let division = || polygons.divisions().of(0, BRIDGED.len());
        let corners = division().corners().map(|t| t.map(|c| c as u32)).collect();
        let map = UvMap::new(uvs, corners).unwrap();
        let whole: Piece = (0..16).map(|c| (c, c as u32)).collect();
        assert_eq!(Pieces::of(&map).next(division()), [whole]);
    }

    #[test]
    fn what_has_no_better_triangles_stays_a_fan() {
        let square = [[0., 0.], [1., 0.], [1., 1.], [0., 1.]];
        let fan = |places: &[[f64; 2]], face: &[u32]| {
            let mut polygons = Polygons::default();
            polygons.push(face.iter().copied());
            let positions: Vec<_> = places.iter().map(|&[x, y]| [x, y, 0.0]).collect();
            polygons.divide(&positions);
            polygons.divisions() == &Divisions::default()
        };
        assert!(fan(&square, &[0, 1, 2, 3]) && fan(&square, &[0, 1, 2, 3, 3]));
        assert!(fan(&square, &[0, 0, 1]) && fan(&square, &[0, 1, 0, 2]));
        let crossed = [[0., 0.], [1., 1.], [1., 0.], [0., 1.]];
        assert!(fan(&crossed, &[0, 1, 2, 3]));
        assert!(fan(
            &[[f64::INFINITY, 0.], [1., 0.], [0., 1.], [1., 1.]],
            &[0, 1, 2, 3]
        ));
        // A corner on a side of a triangle.
        assert!(fan(
            &[[0., 0.], [1., 0.], [2., 0.], [0., 2.]],
            &[0, 1, 2, 3]
        ));
    }

    #[test]
    fn a_polygon_stays_whole_unless_a_seam_crosses_it() {
        // Equal values under several indices are no seam.
        let uvs = vec![[0., 0.], [1., 0.], [1., 1.], [0., 1.], [0., 0.], [5., 5.]];
        let whole = UvMap::new(uvs.clone(), vec![[0, 1, 2], [4, 2, 3]]).unwrap();
        let pieces = Pieces::of(&whole).next(Divisions::default().of(0, 4));
        assert_eq!(pieces, [[(0, 0), (1, 1), (2, 2), (3, 3)]]);
        let torn = UvMap::new(uvs, vec![[0, 1, 2], [0, 5, 3]]).unwrap();
        let pieces = Pieces::of(&torn).next(Divisions::default().of(0, 4));
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
