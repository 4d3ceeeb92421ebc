//! A surface taken apart into regions that are nearly flat.
//!
//! Regions grow by hierarchical face clustering (Garland, Willmott and Heckbert 2001): every
//! triangle starts as a region, and the two neighbours whose union is flattest and most compact
//! become one. The error of a region is its area less the length of its vector area, the sum of
//! its normals times areas: 0 if it is flat.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

use crate::patch::Patch;
use fam_surface::vector::{add, cross, dot, scale, sub};

/// The most mean of 1 − cos θ in a region, where θ is the angle to its mean normal. A region with
/// twice as much has parts that stand upright on its plane; two sides of a cube have 0.29. With 0.2
/// and 0.45, rough surfaces have more charts and longer seams.
pub(super) const MOST_BENT: f64 = 0.28;

/// What area adds to the error of a region, so that of flat unions small and compact ones come
/// first.
const COMPACTNESS: f64 = 1e-3;

/// A region, in a tree of regions.
pub struct Facet {
    /// The two regions that it is the union of; none for a triangle.
    pub halves: Option<[u32; 2]>,
    /// Whether the halves meet in a forbidden edge.
    pub is_forced: bool,
    /// The sum of normals times areas.
    normal: [f64; 3],
    area: f64,
    /// How many triangles it has.
    count: u32,
}

impl Facet {
    /// Two directions in the plane of the region, orthogonal and of length 1, so that its normal
    /// looks at who sees the second to the left of the first.
    pub fn plane(&self) -> [[f64; 3]; 2] {
        let size = self.normal.map(f64::abs);
        let least = (0..3).fold(0, |best, k| if size[k] < size[best] { k } else { best });
        let mut axis = [0.0; 3];
        axis[least] = 1.0;
        let unit = |v: [f64; 3]| scale(v, dot(v, v).sqrt().max(f64::MIN_POSITIVE).recip());
        let normal = unit(self.normal);
        let first = unit(cross(axis, normal));
        [first, cross(normal, first)]
    }
}

/// Regions of a patch, each a leaf or the union of two. The first are the triangles, in their
/// order.
pub struct Facets {
    all: Vec<Facet>,
    /// Those that are part of no other.
    pub roots: Vec<u32>,
}

/// The border between two regions.
#[derive(Clone, Copy, Default)]
struct Border {
    length: f64,
    is_forbidden: bool,
}

impl Border {
    fn with(self, other: Self) -> Self {
        Self {
            length: self.length + other.length,
            is_forbidden: self.is_forbidden || other.is_forbidden,
        }
    }
}

impl Facets {
    /// Those of a patch. Regions on both sides of a forbidden edge become one before all others,
    /// however bent they are.
    pub fn of(patch: &Patch) -> Self {
        let topology = &patch.topology;
        let at = |v: u32| patch.positions[v as usize];
        let mut all: Vec<Facet> = topology
            .triangles()
            .iter()
            .zip(&patch.areas)
            .map(|(corners, &area)| {
                let [a, b, c] = corners.map(at);
                Facet {
                    halves: None,
                    is_forced: false,
                    normal: scale(cross(sub(b, a), sub(c, a)), 0.5),
                    area,
                    count: 1,
                }
            })
            .collect();
        let mut borders: Vec<BTreeMap<u32, Border>> = vec![BTreeMap::new(); all.len()];
        for h in 0..topology.half_edges() {
            let Some(twin) = topology.twin(h).filter(|&twin| twin / 3 != h / 3) else {
                continue;
            };
            let border = borders[h as usize / 3].entry(twin / 3).or_default();
            *border = border.with(Border {
                length: patch.lengths[h as usize],
                is_forbidden: patch.forbidden[h as usize],
            });
        }
        let mut queue = BinaryHeap::new();
        for (a, own) in (0..).zip(&borders) {
            for (&b, border) in own.range(a + 1..) {
                queue.extend(entry(&all, [a, b], border));
            }
        }
        let mut is_whole = vec![true; all.len()];
        while let Some(Reverse((_, a, b))) = queue.pop() {
            if !is_whole[a as usize] || !is_whole[b as usize] {
                continue;
            }
            let c = all.len() as u32;
            let is_forced = borders[a as usize][&b].is_forbidden;
            let [one, other] = [a, b].map(|x| &all[x as usize]);
            all.push(Facet {
                halves: Some([a, b]),
                is_forced,
                normal: add(one.normal, other.normal),
                area: one.area + other.area,
                count: one.count + other.count,
            });
            let mut own = BTreeMap::<u32, Border>::new();
            for x in [a, b] {
                is_whole[x as usize] = false;
                for (y, border) in std::mem::take(&mut borders[x as usize]) {
                    if y != a && y != b {
                        let sum = own.entry(y).or_default();
                        *sum = sum.with(border);
                    }
                }
            }
            for (&y, border) in &own {
                let beyond = &mut borders[y as usize];
                beyond.remove(&a);
                beyond.remove(&b);
                beyond.insert(c, *border);
                queue.extend(entry(&all, [y, c], border));
            }
            borders.push(own);
            is_whole.push(true);
        }
        let roots = (0..all.len() as u32).filter(|&x| is_whole[x as usize]);
        Self {
            roots: roots.collect(),
            all,
        }
    }

    /// One of the regions.
    pub fn get(&self, facet: u32) -> &Facet {
        &self.all[facet as usize]
    }

    /// Regions that a region consists of, each of at most half of its triangles, or such that it
    /// must not be divided. A region often grew by one triangle after the other, so that the two
    /// halves of it alone would be nearly as large as itself and next to nothing.
    pub fn parts(&self, facet: u32) -> Vec<u32> {
        let most = self.get(facet).count / 2;
        let (mut parts, mut open) = (Vec::new(), vec![facet]);
        while let Some(part) = open.pop() {
            let of = self.get(part);
            match of.halves {
                Some(halves) if of.count > most && !of.is_forced => open.extend(halves),
                _ => parts.push(part),
            }
        }
        parts
    }

    /// Whether no triangle of a region stands upright on its plane or upside down.
    pub fn is_upright(&self, facet: u32, triangles: &[u32]) -> bool {
        let normal = self.get(facet).normal;
        let is_upright = |&t: &u32| dot(self.get(t).normal, normal) > 0.0;
        triangles.iter().all(is_upright)
    }

    /// The triangles of a region, ascending.
    pub fn triangles(&self, facet: u32) -> Vec<u32> {
        let (mut found, mut open) = (Vec::new(), vec![facet]);
        while let Some(facet) = open.pop() {
            match self.get(facet).halves {
                Some(halves) => open.extend(halves),
                None => found.push(facet),
            }
        }
        found.sort_unstable();
        found
    }
}

/// Where the union of two regions comes in the order; none if it is too bent.
fn entry(all: &[Facet], [a, b]: [u32; 2], border: &Border) -> Option<Reverse<(u64, u32, u32)>> {
    let [one, other] = [a, b].map(|x| &all[x as usize]);
    let area = one.area + other.area;
    let normal = add(one.normal, other.normal);
    let error = (area - dot(normal, normal).sqrt()).max(0.0);
    let is_forced = border.is_forbidden;
    if !is_forced && error > MOST_BENT * area {
        return None;
    }
    let squared = (border.length * border.length).max(f64::MIN_POSITIVE);
    let cost = (error + COMPACTNESS * area) / squared;
    let cost = if is_forced { 0.0 } else { cost };
    // The bits of non-negative numbers are ordered as they are.
    Some(Reverse((cost.to_bits(), a, b)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use fam_surface::shapes;

    #[test]
    fn the_sides_of_a_cube_are_regions_of_their_own() {
        let facets = Facets::of(&Patch::of(&shapes::cube(4)));
        assert_eq!(facets.roots.len(), 6);
        for &root in &facets.roots {
            assert_eq!(facets.triangles(root).len(), 32);
        }
    }

    #[test]
    fn every_triangle_is_in_one_region() {
        let patch = Patch::of(&shapes::torus(1.0, 0.4, 30, 15));
        let facets = Facets::of(&patch);
        let mut all: Vec<u32> = facets
            .roots
            .iter()
            .flat_map(|&root| facets.triangles(root))
            .collect();
        all.sort_unstable();
        assert_eq!(all, (0..900).collect::<Vec<u32>>());
        assert!((4..60).contains(&facets.roots.len()));
    }

    #[test]
    fn forbidden_edges_lie_inside_of_regions() {
        let patch = Patch::of(&shapes::cube(2)).forbidding(|_, _| true);
        assert_eq!(Facets::of(&patch).roots.len(), 1);
    }

    #[test]
    fn a_plane_is_seen_from_the_side_of_its_normal() {
        let facets = Facets::of(&Patch::of(&shapes::cube(1)));
        for &root in &facets.roots {
            let facet = facets.get(root);
            let [u, v] = facet.plane();
            let unit = |v: [f64; 3]| (dot(v, v) - 1.0).abs() < 1e-12;
            assert!(unit(u) && unit(v) && dot(u, v).abs() < 1e-12);
            assert!(dot(cross(u, v), facet.normal) > 0.0);
        }
    }

    #[test]
    fn parts_are_small_and_have_every_triangle_once() {
        let patch = Patch::of(&shapes::torus(1.0, 0.4, 30, 15));
        let facets = Facets::of(&patch);
        for &root in &facets.roots {
            let whole = facets.triangles(root);
            let parts = facets.parts(root);
            let mut all: Vec<u32> = Vec::new();
            for &part in &parts {
                let own = facets.triangles(part);
                assert!(2 * own.len() <= whole.len() || own.len() == 1);
                all.extend(own);
            }
            all.sort_unstable();
            assert_eq!(all, whole);
        }
    }

    #[test]
    fn a_region_is_upright_if_all_of_it_faces_the_same_way() {
        let folded = shapes::cube(1);
        let facets = Facets::of(&Patch::of(&folded));
        let root = facets.roots[0];
        let own = facets.triangles(root);
        assert!(facets.is_upright(root, &own));
        let all: Vec<u32> = (0..12).collect();
        assert!(!facets.is_upright(root, &all));
    }
}
