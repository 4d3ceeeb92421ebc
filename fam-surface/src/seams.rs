//! Cutting seams: where neighbours on the surface lie far apart in the plane.

use std::collections::BTreeSet;

use crate::metrics::seam_edges;
use crate::neighbors::nearest_others;
use crate::{Components, Normalization, SurfaceError, TriangleMesh, UvMap};

/// K_cut: nearest neighbours in space that a point is compared with (the paper's appendix).
pub const K_CUT: usize = 3;

/// T_cut / L(Q) of the paper's appendix.
const PAPER_FRACTION: f64 = 0.02;

/// The number of points that the paper's threshold presumes.
const PAPER_POINTS: f64 = 10_000.0;

/// What counts as far apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SeamRule {
    /// The paper's: 2 % of the longer side of the UV bounding box, for any point spacing.
    Paper,
    /// The paper's threshold carried over from its 10,000 even points to other numbers and to
    /// uneven spacing: it scales with the distance of the neighbours in space.
    Spacing,
}

/// From which UV distance on two neighbours count as cut apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeamThreshold {
    /// The distance in UV units.
    pub distance: f64,
    /// The normalised 3D distance (see [`Normalization`]) of neighbours that `distance` is meant
    /// for, to which it grows and shrinks in proportion; without it, `distance` holds for all.
    pub spacing: Option<f64>,
}

/// The seams of a parameterization.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Seams {
    /// Points (or vertices) on a seam, ascending.
    pub points: Vec<u32>,
    /// Mesh edges that are cut, each with its smaller vertex first, ascending; none for a
    /// cloud.
    pub edges: Vec<[u32; 2]>,
}

impl SeamThreshold {
    /// The threshold of a rule, from evenly spread `points` `[N, 3]` (normalised) and their
    /// `uvs` `[N, 2]`.
    pub fn of(rule: SeamRule, points: &[[f32; 3]], uvs: &[[f32; 2]]) -> Self {
        let side = longer_side(uvs);
        match rule {
            SeamRule::Paper => Self {
                distance: PAPER_FRACTION * side,
                spacing: None,
            },
            SeamRule::Spacing => {
                let neighbors = Neighbors::of(points);
                let mut reach: Vec<f64> = (0..points.len())
                    .map(|i| {
                        let to = |&j: &u32| distance(&points[i], &points[j as usize]);
                        neighbors.of_point(i).iter().map(to).fold(0.0, f64::max)
                    })
                    .collect();
                reach.sort_unstable_by(f64::total_cmp);
                let count = points.len().max(1) as f64;
                Self {
                    distance: PAPER_FRACTION * side * (PAPER_POINTS / count).sqrt(),
                    spacing: reach.get(reach.len() / 2).copied().filter(|r| *r > 0.0),
                }
            }
        }
    }

    fn cuts(self, in_plane: f64, in_space: f64) -> bool {
        match self.spacing {
            Some(spacing) => in_plane > self.distance * in_space / spacing,
            None => in_plane > self.distance,
        }
    }
}

impl Seams {
    /// The points whose farthest image among their [`K_CUT`] nearest neighbours is beyond the
    /// threshold. `points` `[N, 3]` are normalised, `uvs` `[N, 2]` theirs.
    ///
    /// # Panics
    /// If there are fewer `uvs` than `points`.
    pub fn of_points(points: &[[f32; 3]], uvs: &[[f32; 2]], threshold: SeamThreshold) -> Self {
        let neighbors = Neighbors::of(points);
        let torn = |&i: &usize| {
            neighbors.of_point(i).iter().any(|&j| {
                let j = j as usize;
                threshold.cuts(distance(&uvs[i], &uvs[j]), distance(&points[i], &points[j]))
            })
        };
        Self {
            points: (0..points.len()).filter(torn).map(|i| i as u32).collect(),
            edges: Vec::new(),
        }
    }

    /// The seam points among the vertices of a mesh that belong to triangles, and the edges
    /// whose ends lie beyond the threshold. `uvs` has one coordinate per vertex.
    ///
    /// # Errors
    /// `uvs` is not as long as the mesh has vertices.
    pub fn of_mesh(
        mesh: &TriangleMesh,
        normalization: &Normalization,
        uvs: &[[f32; 2]],
        threshold: SeamThreshold,
    ) -> Result<Self, SurfaceError> {
        if uvs.len() != mesh.positions().len() {
            return Err(SurfaceError::LengthMismatch {
                attribute: "texture coordinates",
                expected: mesh.positions().len(),
                found: uvs.len(),
            });
        }
        let used = mesh.used_vertices();
        let place = |&v: &u32| normalization.apply(mesh.positions()[v as usize]);
        let points: Vec<_> = used.iter().map(place).collect();
        let used_uvs: Vec<_> = used.iter().map(|&v| uvs[v as usize]).collect();
        let mut seams = Self::of_points(&points, &used_uvs, threshold);
        for point in &mut seams.points {
            *point = used[*point as usize];
        }
        let edges: BTreeSet<[u32; 2]> = mesh
            .triangles()
            .iter()
            .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
            .map(|[a, b]| [a.min(b), a.max(b)])
            .collect();
        seams.edges = edges
            .into_iter()
            .filter(|[a, b]| {
                threshold.cuts(
                    distance(&uvs[*a as usize], &uvs[*b as usize]),
                    distance(&place(a), &place(b)),
                )
            })
            .collect();
        Ok(seams)
    }

    /// The edges of a mesh at which the maps of its components, one each, cut it, and `cuts`,
    /// those between components; all by the vertices of the whole mesh.
    ///
    /// # Errors
    /// A map has another number of triangles than the mesh of its component.
    pub fn of_components(
        components: &Components,
        maps: &[UvMap],
        cuts: &[[u32; 2]],
    ) -> Result<Self, SurfaceError> {
        let mut edges = cuts.to_vec();
        for (component, map) in components.list.iter().zip(maps) {
            for edge in seam_edges(&component.mesh, map)? {
                let [a, b] = edge.map(|v| component.vertices[v as usize]);
                edges.push([a.min(b), a.max(b)]);
            }
        }
        edges.sort_unstable();
        edges.dedup();
        let points: BTreeSet<u32> = edges.iter().flatten().copied().collect();
        Ok(Self {
            points: points.into_iter().collect(),
            edges,
        })
    }
}

/// The [`K_CUT`] nearest others of every point, fewer where there are not as many points.
struct Neighbors {
    k: usize,
    indices: Vec<u32>,
}

impl Neighbors {
    fn of(points: &[[f32; 3]]) -> Self {
        let k = K_CUT.min(points.len().saturating_sub(1));
        let indices = match k {
            0 => Vec::new(),
            k => nearest_others(points, k),
        };
        Self { k, indices }
    }

    fn of_point(&self, i: usize) -> &[u32] {
        &self.indices[i * self.k..(i + 1) * self.k]
    }
}

fn distance<const D: usize>(a: &[f32; D], b: &[f32; D]) -> f64 {
    let squared = |c| (f64::from(a[c]) - f64::from(b[c])).powi(2);
    (0..D).map(squared).sum::<f64>().sqrt()
}

fn longer_side(uvs: &[[f32; 2]]) -> f64 {
    let extent = |axis: usize| {
        let values = uvs.iter().map(|q| f64::from(q[axis]));
        let low = values.clone().fold(f64::INFINITY, f64::min);
        (values.fold(f64::NEG_INFINITY, f64::max) - low).max(0.0)
    };
    extent(0).max(extent(1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    fn normalized(mesh: &TriangleMesh) -> (Normalization, Vec<[f32; 3]>) {
        let normalization = Normalization::of(mesh.positions()).unwrap();
        let place = |p: &[f64; 3]| normalization.apply(*p);
        (normalization, mesh.positions().iter().map(place).collect())
    }

    fn by_spacing(mesh: &TriangleMesh, uvs: &[[f32; 2]]) -> Seams {
        let (normalization, points) = normalized(mesh);
        let threshold = SeamThreshold::of(SeamRule::Spacing, &points, uvs);
        Seams::of_mesh(mesh, &normalization, uvs, threshold).unwrap()
    }

    /// A cylinder unrolled along its columns: torn where the last column meets the first.
    #[test]
    fn an_unrolled_cylinder_is_torn_along_one_column() {
        for (around, along) in [(40, 12), (160, 50)] {
            let mesh = shapes::open_cylinder(1.0, 2.0, around, along);
            let rows = along + 1;
            let uvs: Vec<[f32; 2]> = (0..around * rows)
                .map(|v| {
                    let (column, row) = (v / rows, v % rows);
                    let u = std::f32::consts::TAU * column as f32 / around as f32;
                    [u, 2.0 * row as f32 / along as f32]
                })
                .collect();
            let seams = by_spacing(&mesh, &uvs);
            let last = (around - 1) * rows;
            let crosses = |[a, b]: &[u32; 2]| *a < rows && *b >= last;
            assert!(seams.edges.iter().all(crosses));
            // One edge along and one across each quad of the closing column.
            assert_eq!(seams.edges.len() as u32, rows + along);
            assert!(seams.points.iter().all(|&v| v < rows || v >= last));
            assert!(seams.points.len() as u32 > rows);
        }
    }

    #[test]
    fn an_identity_map_has_no_seams() {
        let mesh = shapes::rectangle(2.0, 1.0, 24, 12);
        let flat = |p: &[f64; 3]| [p[0] as f32, p[1] as f32];
        let uvs: Vec<[f32; 2]> = mesh.positions().iter().map(flat).collect();
        assert_eq!(by_spacing(&mesh, &uvs), Seams::default());
        // The paper's constant marks everything on so few points.
        let (_, points) = normalized(&mesh);
        let paper = SeamThreshold::of(SeamRule::Paper, &points, &uvs);
        let seams = Seams::of_points(&points, &uvs, paper);
        assert_eq!(seams.points.len(), points.len());
    }

    /// One quad of sixteen lies apart in the plane: cut along its four edges.
    #[test]
    fn the_seams_of_charts_are_their_common_edges() {
        let sheet = shapes::rectangle(4.0, 4.0, 4, 4);
        // The last of two components is another sheet that meets the first in one edge.
        let mut positions = sheet.positions().to_vec();
        let beyond = positions.len() as u32;
        positions.push([0.0, 0.0, 1.0]);
        let mut triangles = sheet.triangles().to_vec();
        let [a, b, _] = triangles[0];
        triangles.push([a, b, beyond]);
        let labels: Vec<u32> = (0..triangles.len() as u32)
            .map(|t| u32::from(t == triangles.len() as u32 - 1))
            .collect();
        let mesh = TriangleMesh::new(positions, triangles).unwrap();
        let components = Components::of(&mesh, &labels).unwrap();
        let flat = |mesh: &TriangleMesh| -> Vec<[f32; 2]> {
            let positions = mesh.positions().iter();
            positions.map(|p| [p[0] as f32, p[1] as f32]).collect()
        };
        let whole = components.list[0].mesh.clone();
        let mut uvs = flat(&whole);
        let mut corners = whole.triangles().to_vec();
        // Both triangles of the quad between 0 and 1 move away.
        let center = |t: &[u32; 3], axis: usize| {
            t.iter()
                .map(|&v| whole.positions()[v as usize][axis])
                .sum::<f64>()
                / 3.0
        };
        let is_apart = |t: &[u32; 3]| [0, 1].iter().all(|&a| (0.0..1.0).contains(&center(t, a)));
        let apart: Vec<usize> = (0..corners.len())
            .filter(|&t| is_apart(&whole.triangles()[t]))
            .collect();
        assert_eq!(apart.len(), 2);
        let count = uvs.len() as u32;
        uvs.extend_from_within(..);
        uvs[count as usize..].iter_mut().for_each(|uv| uv[0] += 9.0);
        for t in apart {
            corners[t] = corners[t].map(|v| v + count);
        }
        let maps = [
            UvMap::new(uvs, corners).unwrap(),
            UvMap::new(vec![[0.0; 2]; 3], vec![[0, 1, 2]]).unwrap(),
        ];
        let seams = Seams::of_components(&components, &maps, &[]).unwrap();
        assert_eq!((seams.edges.len(), seams.points.len()), (4, 4));
        for edge in &seams.edges {
            let ends = edge.map(|v| mesh.positions()[v as usize]);
            let along = |axis: usize| ends.map(|p| p[axis]);
            let is_side = |axis: usize| along(axis) == [0.0; 2] || along(axis) == [1.0; 2];
            assert!(is_side(0) || is_side(1), "{ends:?}");
        }
        let cut = [a.min(b), a.max(b)];
        let seams = Seams::of_components(&components, &maps, &[cut]).unwrap();
        assert_eq!(seams.edges.len(), 5);
        assert!(seams.edges.contains(&cut));
        assert!(Seams::of_components(&components, &[maps[1].clone()], &[]).is_err());
    }
}
