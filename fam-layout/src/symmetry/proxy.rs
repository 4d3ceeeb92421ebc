//! An exactly symmetric surface that lies close to one that is only nearly so.

use std::collections::HashMap;

use fam_surface::TriangleMesh;
use fam_surface::orientation::{NONE, across};
use fam_surface::sets::Sets;
use fam_surface::symmetry::{Match, MirrorPlane, Pairing};
use fam_surface::vector::{length, scale, sub};

/// A vertex is moved onto the plane if it lies nearer to it than this share of its shortest edge, so
/// that the plane cuts off no slivers.
const SNAP: f64 = 0.25;

/// How high over the plane the surface is cut, in mean lengths of edges. The plane itself comes first. Where
/// a surface touches it without crossing it, the two halves would meet in single vertices or edges.
const LEVELS: [f64; 4] = [0.0, 0.2, 0.35, 0.5];

/// A piece of the half with less than this share of its area is left out: the plane cuts such pieces
/// off where a surface is not quite symmetric.
const LEAST_PIECE: f64 = 0.01;

/// One side of a surface, cut at a plane and glued to its mirror image.
pub struct Proxy {
    /// The triangles of the side, then their mirror images in the same order.
    pub mesh: TriangleMesh,
    /// Which of its vertices and triangles are mirror images.
    pub pairing: Pairing,
    /// For every vertex the one of the surface that it is or that is near to it; for mirror images that
    /// of what they mirror.
    pub origins: Vec<u32>,
    /// The ends of the surface's edge that every vertex lies on, the smaller first; twice the same for
    /// one that is a vertex of the surface. For mirror images those of what they mirror.
    pub on: Vec<[u32; 2]>,
    /// For every vertex whether it is one of the surface.
    pub is_own: Vec<bool>,
}

impl Proxy {
    /// The edge of the surface that an edge of the proxy or its mirror image lies on, by its vertices, the
    /// smaller first, if it lies on one.
    pub fn edge_under(&self, edge: [u32; 2]) -> Option<[u32; 2]> {
        let [[a, b], [c, d]] = edge.map(|v| self.on[v as usize]);
        let (low, high) = (a.min(c), b.max(d));
        let is_end = |v: u32| v == low || v == high;
        (low != high && [a, b, c, d].into_iter().all(is_end)).then_some([low, high])
    }

    /// The proxy of a surface by the side where its heights over the plane, one for each vertex, are
    /// positive. `None` if none is found that is a manifold.
    pub fn of(surface: &TriangleMesh, plane: &MirrorPlane, heights: &[f64]) -> Option<Self> {
        let spacing = mean_edge(surface);
        LEVELS.into_iter().find_map(|level| {
            let above: Vec<f64> = heights.iter().map(|h| h - level * spacing).collect();
            let side = Side::of(surface, plane, &snapped(surface, &above))?;
            let side = side.without_small_pieces()?;
            side.doubled(plane).filter(|proxy| is_manifold(&proxy.mesh))
        })
    }
}

/// The mean length of the sides of triangles.
pub fn mean_edge(surface: &TriangleMesh) -> f64 {
    let sides = surface.triangles().iter().flat_map(|&[a, b, c]| {
        [[a, b], [b, c], [c, a]].map(|edge| {
            let [p, q] = edge.map(|v| surface.positions()[v as usize]);
            length(sub(p, q))
        })
    });
    sides.sum::<f64>() / (3 * surface.triangles().len()) as f64
}

/// Heights over a plane, those being 0 of vertices that are moved onto it.
fn snapped(surface: &TriangleMesh, heights: &[f64]) -> Vec<f64> {
    let mut shortest = vec![f64::INFINITY; heights.len()];
    for &[a, b, c] in surface.triangles() {
        for [a, b] in [[a, b], [b, c], [c, a]] {
            let [p, q] = [a, b].map(|v| surface.positions()[v as usize]);
            let side = length(sub(p, q));
            for v in [a, b] {
                shortest[v as usize] = shortest[v as usize].min(side);
            }
        }
    }
    let snap = |(&height, &side): (&f64, &f64)| match height.abs() < SNAP * side {
        true => 0.0,
        false => height,
    };
    heights.iter().zip(&shortest).map(snap).collect()
}

/// What of a surface lies on one side of a plane.
struct Side {
    positions: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
    origins: Vec<u32>,
    on: Vec<[u32; 2]>,
    is_own: Vec<bool>,
    is_on_plane: Vec<bool>,
}

impl Side {
    fn of(surface: &TriangleMesh, plane: &MirrorPlane, heights: &[f64]) -> Option<Self> {
        let mut side = Self {
            positions: Vec::new(),
            triangles: Vec::new(),
            origins: Vec::new(),
            on: Vec::new(),
            is_own: Vec::new(),
            is_on_plane: Vec::new(),
        };
        let mut known = HashMap::new();
        let mut vertex = |[a, b]: [u32; 2]| {
            let ends = [a.min(b), a.max(b)];
            let add = || side.add(surface, plane, heights, ends);
            *known.entry(ends).or_insert_with(add)
        };
        let mut triangles = Vec::new();
        for corners in surface.triangles() {
            let height = |k: usize| heights[corners[k % 3] as usize];
            if !(0..3).any(|k| height(k) > 0.0) {
                continue;
            }
            let mut outline = Vec::new();
            for k in 0..3 {
                let [a, b] = [corners[k], corners[(k + 1) % 3]];
                if height(k) >= 0.0 {
                    outline.push(vertex([a, a]));
                }
                if height(k).signum() != height(k + 1).signum()
                    && height(k) != 0.0
                    && height(k + 1) != 0.0
                {
                    outline.push(vertex([a, b]));
                }
            }
            triangles.push(outline);
        }
        for outline in triangles {
            side.fill(&outline);
        }
        (!side.triangles.is_empty()).then_some(side)
    }

    /// A vertex of the surface, or the point where an edge meets the plane.
    fn add(
        &mut self,
        surface: &TriangleMesh,
        plane: &MirrorPlane,
        heights: &[f64],
        [a, b]: [u32; 2],
    ) -> u32 {
        let [p, q] = [a, b].map(|v| surface.positions()[v as usize]);
        let [of_a, of_b] = [a, b].map(|v| heights[v as usize].abs());
        let share = if a == b { 0.0 } else { of_a / (of_a + of_b) };
        let is_on_plane = a != b || of_a == 0.0;
        let at = [0, 1, 2].map(|k| p[k] + share * (q[k] - p[k]));
        self.positions.push(match is_on_plane {
            true => sub(at, scale(plane.normal(), plane.height(at))),
            false => at,
        });
        self.origins.push(if of_a <= of_b { a } else { b });
        self.on.push([a, b]);
        self.is_own.push(a == b);
        self.is_on_plane.push(is_on_plane);
        self.positions.len() as u32 - 1
    }

    /// Adds a triangle, or a quadrilateral by its shorter diagonal.
    fn fill(&mut self, outline: &[u32]) {
        match *outline {
            [a, b, c] => self.triangles.push([a, b, c]),
            [a, b, c, d] => {
                let apart = |a: u32, b: u32| {
                    let [p, q] = [a, b].map(|v| self.positions[v as usize]);
                    length(sub(p, q))
                };
                let both = match apart(a, c) <= apart(b, d) {
                    true => [[a, b, c], [a, c, d]],
                    false => [[a, b, d], [b, c, d]],
                };
                self.triangles.extend(both);
            }
            _ => {}
        }
    }

    fn without_small_pieces(mut self) -> Option<Self> {
        let mut sets = Sets::new(self.triangles.len());
        for (h, &twin) in (0..).zip(&across(&self.triangles)) {
            if twin != NONE {
                sets.join(h / 3, twin / 3);
            }
        }
        sets.settle();
        let mesh = TriangleMesh::new(self.positions.clone(), self.triangles.clone()).ok()?;
        let areas = mesh.triangle_areas();
        let mut of_piece: HashMap<u32, f64> = HashMap::new();
        for (t, area) in (0..).zip(&areas) {
            *of_piece.entry(sets.find(t)).or_default() += area;
        }
        let least = LEAST_PIECE * areas.iter().sum::<f64>();
        let mut t = 0..;
        self.triangles
            .retain(|_| t.next().is_some_and(|t| of_piece[&sets.find(t)] >= least));
        (!self.triangles.is_empty()).then_some(self)
    }

    /// This side and its mirror image, sharing the vertices on the plane.
    fn doubled(self, plane: &MirrorPlane) -> Option<Proxy> {
        let mut is_used = vec![false; self.positions.len()];
        for &v in self.triangles.iter().flatten() {
            is_used[v as usize] = true;
        }
        let own = self.positions.len();
        let mut images: Vec<Option<u32>> = vec![None; own];
        let (mut positions, mut origins) = (self.positions, self.origins);
        let (mut on, mut is_own) = (self.on, self.is_own);
        for v in 0..own {
            if !is_used[v] {
                continue;
            }
            if self.is_on_plane[v] {
                images[v] = Some(v as u32);
                continue;
            }
            images[v] = Some(positions.len() as u32);
            images.push(Some(v as u32));
            positions.push(plane.reflected(positions[v]));
            origins.push(origins[v]);
            on.push(on[v]);
            is_own.push(false);
        }
        let mirrored = |&[a, b, c]: &[u32; 3]| {
            let [a, b, c] = [a, c, b].map(|v| images[v as usize]);
            Some([a?, b?, c?])
        };
        let theirs: Vec<[u32; 3]> = self.triangles.iter().map(mirrored).collect::<Option<_>>()?;
        let count = theirs.len() as u32;
        let of = |t: u32| [3 * t, 3 * t + 2, 3 * t + 1];
        let corners = (count..2 * count).chain(0..count).map(of).collect();
        let triangles = self.triangles.into_iter().chain(theirs).collect();
        Some(Proxy {
            mesh: TriangleMesh::new(positions, triangles).ok()?,
            pairing: Pairing {
                exactness: Match::Close,
                images,
                corners,
            },
            origins,
            on,
            is_own,
        })
    }
}

/// Whether no edge has more than two triangles, and all triangles at a vertex follow one another.
fn is_manifold(mesh: &TriangleMesh) -> bool {
    let triangles = mesh.triangles();
    let mut uses: HashMap<[u32; 2], u32> = HashMap::new();
    for &[a, b, c] in triangles {
        for [a, b] in [[a, b], [b, c], [c, a]] {
            *uses.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
    }
    if uses.values().any(|&count| count > 2) {
        return false;
    }
    let mut corners = Sets::new(3 * triangles.len());
    for (h, &twin) in (0..).zip(&across(triangles)) {
        if twin != NONE {
            for [a, b] in fam_surface::orientation::meeting(triangles, h, twin) {
                corners.join(a, b);
            }
        }
    }
    corners.settle();
    let mut fans: HashMap<u32, u32> = HashMap::new();
    (0..).zip(triangles.iter().flatten()).all(|(corner, &v)| {
        let fan = corners.find(corner);
        *fans.entry(v).or_insert(fan) == fan
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::patch::topology::Topology;
    use fam_surface::shapes::{rectangle, sphere};

    fn proxy(surface: &TriangleMesh, plane: &MirrorPlane) -> Proxy {
        let positions = surface.positions().iter();
        let heights: Vec<f64> = positions.map(|&p| plane.height(p)).collect();
        Proxy::of(surface, plane, &heights).unwrap()
    }

    fn check(proxy: &Proxy, surface: &TriangleMesh, plane: &MirrorPlane) {
        let at = |v: u32| proxy.mesh.positions()[v as usize];
        let apart = |p, q| length(sub(p, q));
        for v in proxy.mesh.used_vertices() {
            let image = proxy.pairing.images[v as usize].unwrap();
            assert_eq!(proxy.pairing.images[image as usize], Some(v));
            assert!(apart(at(image), plane.reflected(at(v))) < 1e-12);
            let origin = surface.positions()[proxy.origins[v as usize] as usize];
            assert!(!proxy.is_own[v as usize] || apart(origin, at(v)) < 0.06);
        }
        for (t, corners) in proxy.pairing.corners.iter().enumerate() {
            for (&v, corner) in proxy.mesh.triangles()[t].iter().zip(corners) {
                let of = proxy.mesh.triangles()[*corner as usize / 3][*corner as usize % 3];
                assert_eq!(proxy.pairing.images[of as usize], Some(v));
            }
        }
    }

    #[test]
    fn a_ball_is_cut_anywhere() {
        let ball = sphere(9);
        let area = |mesh: &TriangleMesh| mesh.triangle_areas().iter().sum::<f64>();
        for normal in [[1.0, 0.0, 0.0], [0.6, 0.5, -0.4], [0.1, 0.2, 3.0]] {
            let plane = MirrorPlane::new(normal, 0.0).unwrap();
            let proxy = proxy(&ball, &plane);
            check(&proxy, &ball, &plane);
            let topology = Topology::oriented(&proxy.mesh).topology;
            assert_eq!(topology.euler_characteristic(), 2);
            assert!(topology.boundary_loops().is_empty());
            assert!((area(&proxy.mesh) / area(&ball) - 1.0).abs() < 0.01);
            let slivers = proxy.mesh.triangle_areas();
            assert!(slivers.iter().all(|&area| area > 1e-4), "{slivers:?}");
        }
    }

    /// Two triangles on one side, with their common edge on the plane.
    #[test]
    fn what_only_touches_the_plane_is_cut_above_it() {
        let positions = vec![
            [0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [1.0, 0.5, 0.5],
            [1.0, 0.5, -0.5],
        ];
        let tent = TriangleMesh::new(positions, vec![[0, 1, 2], [1, 0, 3]]).unwrap();
        let plane = MirrorPlane::across(0, 0.0);
        let proxy = proxy(&tent, &plane);
        check(&proxy, &tent, &plane);
        assert_eq!(proxy.mesh.triangles().len(), 4);
        assert!(is_manifold(&proxy.mesh));
    }

    /// A line of edges, 0.4 edges beside the plane.
    #[test]
    fn edges_of_the_surface_are_known_on_both_sides() {
        let mut sheet = rectangle(2.0, 1.0, 12, 6);
        let moved = |&[x, y, z]: &[f64; 3]| [x + 0.4 / 6.0, y, z];
        let positions: Vec<[f64; 3]> = sheet.positions().iter().map(moved).collect();
        sheet = TriangleMesh::new(positions, sheet.triangles().to_vec()).unwrap();
        let proxy = proxy(&sheet, &MirrorPlane::across(0, 0.0));
        let is_on = |v: u32| (sheet.positions()[v as usize][0] - 0.4 / 6.0).abs() < 1e-9;
        let mut marked: Vec<[u32; 2]> = proxy
            .mesh
            .triangles()
            .iter()
            .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
            .map(|[a, b]| [a.min(b), a.max(b)])
            .filter(|&edge| {
                proxy
                    .edge_under(edge)
                    .is_some_and(|under| under.iter().all(|&v| is_on(v)))
            })
            .collect();
        marked.sort_unstable();
        marked.dedup();
        assert_eq!(marked.len(), 12);
        let x = |v: u32| proxy.mesh.positions()[v as usize][0];
        assert!(
            marked
                .iter()
                .flatten()
                .all(|&v| (x(v).abs() - 0.4 / 6.0).abs() < 1e-9)
        );
    }

    #[test]
    fn crumbs_are_left_out() {
        let ball = sphere(6);
        let crumb = [[0.01, 3.0, 0.0], [0.05, 3.0, 0.0], [0.01, 3.05, 0.0]];
        let first = ball.positions().len() as u32;
        let positions = ball.positions().iter().copied().chain(crumb).collect();
        let triangles = ball.triangles().iter().copied();
        let triangles = triangles.chain([[first, first + 1, first + 2]]).collect();
        let mesh = TriangleMesh::new(positions, triangles).unwrap();
        let plane = MirrorPlane::across(0, 0.0);
        let whole = proxy(&ball, &plane);
        let proxy = proxy(&mesh, &plane);
        assert_eq!(proxy.mesh.triangles().len(), whole.mesh.triangles().len());
    }
}
