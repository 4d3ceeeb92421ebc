//! UVs that are there and stay.

use std::collections::HashMap;

use fam_layout::Beside;
use fam_surface::charts::charts;
use fam_surface::metrics::{Metrics, for_each_overlapping_pair};
use fam_surface::{SurfaceError, TriangleMesh, UvMap};

use crate::parting::Parting;

/// UVs of a mesh, some of whose triangles keep theirs. The others are laid out beside them.
#[derive(Debug, Clone, PartialEq)]
pub struct Kept {
    uvs: UvMap,
    is_kept: Vec<bool>,
}

impl Kept {
    /// Keeps the UVs of the triangles for which `is_kept` says so.
    ///
    /// # Errors
    /// `is_kept` has not an entry for every triangle.
    pub fn new(uvs: UvMap, is_kept: Vec<bool>) -> Result<Self, SurfaceError> {
        let (expected, found) = (uvs.triangles().len(), is_kept.len());
        if expected != found {
            return Err(SurfaceError::LengthMismatch {
                attribute: "triangles to keep",
                expected,
                found,
            });
        }
        Ok(Self { uvs, is_kept })
    }

    /// Keeps the charts that are fine: at their best scale their symmetric Dirichlet energy is within
    /// `bound`, no triangle is collapsed or flipped, and none overlaps another. Where two charts overlap
    /// each other, the larger one is kept.
    ///
    /// # Errors
    /// The mesh has another number of triangles, or none with area.
    pub fn fine(mesh: &TriangleMesh, uvs: UvMap, bound: f64) -> Result<Self, SurfaceError> {
        // Checks that they fit.
        Metrics::measure(mesh, &uvs)?;
        let chart_of = charts(&uvs);
        let mut members: Vec<Vec<u32>> = Vec::new();
        for (t, &chart) in (0..).zip(&chart_of) {
            let chart = chart as usize;
            members.resize(members.len().max(chart + 1), Vec::new());
            members[chart].push(t);
        }
        let mut is_fine: Vec<bool> = members
            .iter()
            .map(|own| is_fine(mesh, &uvs, own, bound))
            .collect();
        for_each_overlapping_pair(&uvs, |pair| {
            let [a, b] = pair.map(|t| chart_of[t as usize] as usize);
            if a != b && is_fine[a] && is_fine[b] {
                let size = |chart: usize| members[chart].len();
                is_fine[if size(a) < size(b) { a } else { b }] = false;
            }
        });
        let is_kept = chart_of.iter().map(|&c| is_fine[c as usize]).collect();
        Self::new(uvs, is_kept)
    }

    /// How many triangles keep their UVs.
    pub fn count(&self) -> usize {
        self.is_kept.iter().filter(|kept| **kept).count()
    }

    /// The UVs that are there.
    pub(crate) fn uvs(&self) -> &UvMap {
        &self.uvs
    }

    /// The mesh of the other triangles, over the same vertices; none if all are kept.
    ///
    /// # Errors
    /// The mesh has another number of triangles.
    pub(crate) fn others(&self, mesh: &TriangleMesh) -> Result<Option<TriangleMesh>, SurfaceError> {
        self.check(mesh)?;
        let others = self.select(mesh.triangles(), false);
        if others.is_empty() {
            return Ok(None);
        }
        TriangleMesh::new(mesh.positions().to_vec(), others).map(Some)
    }

    /// The charts that stay; none if no triangle is kept.
    ///
    /// # Errors
    /// None that is left by [`others`](Self::others).
    pub(crate) fn there(
        &self,
        mesh: &TriangleMesh,
        parting: &Parting,
    ) -> Result<Option<There>, SurfaceError> {
        let own = self.select(self.uvs.triangles(), true);
        if own.is_empty() {
            return Ok(None);
        }
        let label = |label: &u32| parting.squares.get(*label as usize).copied().unwrap_or(0);
        let squares = match parting.squares.is_empty() || parting.labels.is_empty() {
            true => Vec::new(),
            false => self
                .select(&parting.labels, true)
                .iter()
                .map(label)
                .collect(),
        };
        let all = (0..self.is_kept.len()).filter(|&t| self.is_kept[t]);
        let in_plane = all.map(|t| self.uvs.area(t)).sum::<f64>();
        let on_surface: f64 = self.select(&mesh.triangle_areas(), true).iter().sum();
        let scale = (in_plane / on_surface).sqrt();
        Ok(Some(There {
            uvs: UvMap::new(self.uvs.uvs().to_vec(), own)?,
            squares,
            scale: if scale > 0.0 { scale } else { f64::INFINITY },
        }))
    }

    /// How the other triangles belong together.
    pub(crate) fn parting(&self, parting: &Parting) -> Parting {
        Parting {
            labels: match parting.labels.is_empty() {
                true => Vec::new(),
                false => self.select(&parting.labels, false),
            },
            ..parting.clone()
        }
    }

    /// The UVs of all triangles, those of the others as in `new`.
    ///
    /// # Errors
    /// `new` has not a triangle for each of the others.
    pub(crate) fn merged(&self, new: &UvMap) -> Result<UvMap, SurfaceError> {
        let (expected, found) = (self.is_kept.len() - self.count(), new.triangles().len());
        if expected != found {
            return Err(SurfaceError::LengthMismatch {
                attribute: "new triangles",
                expected,
                found,
            });
        }
        let mut uvs = Vec::new();
        let mut numbers: [HashMap<u32, u32>; 2] = Default::default();
        let mut rest = 0..found;
        let mut triangles = Vec::with_capacity(self.is_kept.len());
        for (t, &is_kept) in self.is_kept.iter().enumerate() {
            let (map, t) = match is_kept {
                true => (&self.uvs, t),
                false => (new, rest.next().unwrap_or_default()),
            };
            triangles.push(map.triangles()[t].map(|v| {
                *numbers[usize::from(is_kept)].entry(v).or_insert_with(|| {
                    uvs.push(map.uvs()[v as usize]);
                    uvs.len() as u32 - 1
                })
            }));
        }
        UvMap::new(uvs, triangles)
    }

    fn check(&self, mesh: &TriangleMesh) -> Result<(), SurfaceError> {
        let (expected, found) = (mesh.triangles().len(), self.is_kept.len());
        match expected == found {
            true => Ok(()),
            false => Err(SurfaceError::LengthMismatch {
                attribute: "triangles of the UVs that are there",
                expected,
                found,
            }),
        }
    }

    /// What the triangles have that are kept, or the others.
    fn select<T: Copy>(&self, of_triangles: &[T], is_kept: bool) -> Vec<T> {
        let all = of_triangles.iter().zip(&self.is_kept);
        all.filter(|(_, kept)| **kept == is_kept)
            .map(|(one, _)| *one)
            .collect()
    }
}

/// Charts that stay.
pub(crate) struct There {
    uvs: UvMap,
    /// Of every triangle; empty if all share one.
    squares: Vec<u32>,
    /// UV units per unit of length.
    scale: f64,
}

impl There {
    pub(crate) fn beside(&self) -> Beside<'_> {
        Beside {
            uvs: &self.uvs,
            squares: &self.squares,
            scale: self.scale,
        }
    }
}

/// Whether some triangles, a whole chart, are laid out well. Those without any area are.
fn is_fine(mesh: &TriangleMesh, uvs: &UvMap, own: &[u32], bound: f64) -> bool {
    let triangles = own.iter().map(|&t| mesh.triangles()[t as usize]);
    let (positions, triangles) = compact(mesh.positions(), triangles);
    let corners = own.iter().map(|&t| uvs.triangles()[t as usize]);
    let (places, corners) = compact(uvs.uvs(), corners);
    let measured = TriangleMesh::new(positions, triangles)
        .and_then(|chart| Metrics::measure(&chart, &UvMap::new(places, corners)?));
    measured.map_or(true, |metrics| {
        metrics.symmetric_dirichlet <= bound
            && metrics.flipped_triangles == 0
            && metrics.overlapping_pairs == 0
    })
}

/// Some triangles over entries of their own.
fn compact<T: Copy>(
    all: &[T],
    triangles: impl Iterator<Item = [u32; 3]>,
) -> (Vec<T>, Vec<[u32; 3]>) {
    let mut own = Vec::new();
    let mut numbers: HashMap<u32, u32> = HashMap::new();
    let mut number = |v: u32| {
        *numbers.entry(v).or_insert_with(|| {
            own.push(all[v as usize]);
            own.len() as u32 - 1
        })
    };
    let triangles = triangles.map(|t| t.map(&mut number)).collect();
    (own, triangles)
}

#[cfg(test)]
mod tests {
    use super::*;
    use fam_surface::shapes;

    /// A sheet of so many columns and its UVs: the sheet itself, at an offset.
    fn sheet(columns: u32, at: [f32; 2]) -> (TriangleMesh, UvMap) {
        let mesh = shapes::rectangle(f64::from(columns), 1.0, columns, 1);
        let place = |p: &[f64; 3]| [p[0] as f32 + at[0], p[1] as f32 + at[1]];
        let uvs = mesh.positions().iter().map(place).collect();
        let map = UvMap::new(uvs, mesh.triangles().to_vec()).unwrap();
        (mesh, map)
    }

    fn together(all: &[(TriangleMesh, UvMap)]) -> (TriangleMesh, UvMap) {
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        let (mut uvs, mut corners) = (Vec::new(), Vec::new());
        for (k, (mesh, map)) in (0..).zip(all) {
            let first = positions.len() as u32;
            triangles.extend(mesh.triangles().iter().map(|t| t.map(|v| v + first)));
            let apart = |p: &[f64; 3]| [p[0], p[1], p[2] + f64::from(k)];
            positions.extend(mesh.positions().iter().map(apart));
            let first = uvs.len() as u32;
            corners.extend(map.triangles().iter().map(|t| t.map(|v| v + first)));
            uvs.extend(map.uvs());
        }
        (
            TriangleMesh::new(positions, triangles).unwrap(),
            UvMap::new(uvs, corners).unwrap(),
        )
    }

    fn twice((mesh, map): &(TriangleMesh, UvMap)) -> (TriangleMesh, UvMap) {
        let triangles = [mesh.triangles(), mesh.triangles()].concat();
        let corners = [map.triangles(), map.triangles()].concat();
        (
            TriangleMesh::new(mesh.positions().to_vec(), triangles).unwrap(),
            UvMap::new(map.uvs().to_vec(), corners).unwrap(),
        )
    }

    fn stretched(map: &UvMap, [x, y]: [f32; 2]) -> UvMap {
        let uvs = map.uvs().iter().map(|q| [x * q[0], y * q[1]]).collect();
        UvMap::new(uvs, map.triangles().to_vec()).unwrap()
    }

    #[test]
    fn charts_that_are_stretched_folded_or_in_the_way_are_not_kept() {
        let (mesh, map) = sheet(2, [0.0, 50.0]);
        let mut folded = map.uvs().to_vec();
        folded[1][0] += 5.0;
        let folded = UvMap::new(folded, map.triangles().to_vec()).unwrap();
        let all = [
            sheet(4, [0.0, 0.0]),
            // Of any size, and mirrored.
            (mesh.clone(), stretched(&map, [-7.0, 7.0])),
            (mesh.clone(), stretched(&map, [1.0, 2.0])),
            (mesh.clone(), stretched(&folded, [1.0, -1.0])),
            // On the first.
            sheet(3, [0.3, 0.2]),
            (
                mesh,
                UvMap::new(vec![[9.0; 2]; 6], map.triangles().to_vec()).unwrap(),
            ),
            // A piece that is there twice, as the sides of a sheet are.
            twice(&sheet(1, [30.0, 0.0])),
        ];
        let sizes: Vec<usize> = all.iter().map(|(mesh, _)| mesh.triangles().len()).collect();
        let (mesh, map) = together(&all);
        let kept = Kept::fine(&mesh, map, 4.1).unwrap();
        let of_part = [true, true, false, false, false, false, true];
        let expected = of_part.iter().zip(&sizes);
        let expected: Vec<bool> = expected.flat_map(|(&is, &n)| vec![is; n]).collect();
        assert_eq!(kept.is_kept, expected);
        assert_eq!(kept.count(), 16);
    }

    #[test]
    fn kept_triangles_have_the_same_bits_and_others_the_new_uvs() {
        let (mesh, map) = sheet(3, [0.1, 0.7]);
        let is_kept = [true, false, false, true, false, true];
        let kept = Kept::new(map.clone(), is_kept.to_vec()).unwrap();
        let rest = kept.others(&mesh).unwrap().unwrap();
        assert_eq!(
            rest.triangles(),
            [1, 2, 4].map(|t: usize| mesh.triangles()[t])
        );
        let parting = Parting::by_object(&[0, 1, 2, 3, 4, 5]);
        assert_eq!(kept.parting(&parting).labels, [1, 2, 4]);
        let corners: Vec<[f32; 2]> = (0..9).map(|c| [c as f32, 0.5]).collect();
        let new = UvMap::of_corners(&corners).unwrap();
        let merged = kept.merged(&new).unwrap();
        let mut next = 0;
        for (t, is_kept) in is_kept.into_iter().enumerate() {
            let expected = if is_kept {
                map.corners(t)
            } else {
                new.corners(next)
            };
            next += usize::from(!is_kept);
            assert_eq!(merged.corners(t), expected);
        }
        assert!(kept.merged(&map).is_err());
        assert!(Kept::new(map, vec![true]).is_err());
        let (other, _) = sheet(2, [0.0; 2]);
        assert!(kept.others(&other).is_err());
    }
}
