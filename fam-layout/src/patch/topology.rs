//! Half-edges of an oriented manifold.

use fam_surface::TriangleMesh;
use fam_surface::orientation::{NONE, across, ends, turned};

/// The triangles of an oriented manifold (with or without boundary) and who neighbours whom.
///
/// Half-edge `3 t + c` runs along triangle `t` from its corner `c` to the next; its twin runs
/// the other way in the triangle beyond. Cutting leaves triangles and half-edges their
/// numbers; only vertices are split and twins lost.
#[derive(Debug, Clone)]
pub struct Topology {
    triangles: Vec<[u32; 3]>,
    twins: Vec<u32>,
    vertices: usize,
}

/// A manifold that was cut.
#[derive(Debug, Clone)]
pub struct Opened {
    /// What it is now.
    pub topology: Topology,
    /// For every vertex the one that it was.
    pub source: Vec<u32>,
}

impl Topology {
    /// The half-edges of a manifold mesh, coherently oriented: in each part as most of its
    /// triangles are. Where it is not orientable, as a Möbius strip, it comes cut.
    pub fn oriented(mesh: &TriangleMesh) -> Opened {
        let triangles = mesh.triangles();
        let across = across(triangles);
        let turned = turned(triangles, &across);
        let coherent: Vec<[u32; 3]> = (0..triangles.len())
            .map(|t| match (turned[t], triangles[t]) {
                (true, [a, b, c]) => [a, c, b],
                (false, corners) => corners,
            })
            .collect();
        // A turned triangle has its edges in the other order: 0, 1, 2 become 2, 1, 0.
        let renumbered = |h: u32| match turned[h as usize / 3] {
            true => h - h % 3 + (2 - h % 3),
            false => h,
        };
        let mut twins = vec![NONE; 3 * triangles.len()];
        for h in 0..twins.len() as u32 {
            let twin = across[h as usize];
            if twin == NONE {
                continue;
            }
            let (h, twin) = (renumbered(h), renumbered(twin));
            if ends(&coherent, h)[0] == ends(&coherent, twin)[1] {
                twins[h as usize] = twin;
            }
        }
        let whole = Self {
            triangles: coherent,
            twins,
            vertices: mesh.positions().len(),
        };
        whole.open(|_| false)
    }

    /// Some of the triangles by themselves, with the vertices that they have, and for every
    /// vertex the one that it was. Edges to other triangles become boundary.
    pub fn part(&self, triangles: &[u32]) -> Opened {
        // Sorted, so that a small part of a large surface takes no longer for its size.
        let mut places: Vec<(u32, u32)> = triangles.iter().copied().zip(0..).collect();
        places.sort_unstable();
        let place = |t: u32| {
            let found = places.binary_search_by_key(&t, |&(t, _)| t);
            found.ok().map(|i| places[i].1)
        };
        let moved = |h: u32| {
            let twin = self.twin(h);
            let inside = twin.and_then(|twin| Some(3 * place(twin / 3)? + twin % 3));
            inside.unwrap_or(NONE)
        };
        let part = Self {
            triangles: triangles
                .iter()
                .map(|&t| self.triangles[t as usize])
                .collect(),
            twins: triangles
                .iter()
                .flat_map(|&t| (3 * t..3 * t + 3).map(moved))
                .collect(),
            vertices: self.vertices.min(3 * triangles.len()),
        };
        part.open(|_| false)
    }

    /// Makes two half-edges each other's twin; where one is missing the other comes to lie on
    /// the boundary.
    pub(crate) fn join(&mut self, one: Option<u32>, other: Option<u32>) {
        for (h, twin) in [(one, other), (other, one)] {
            if let Some(h) = h {
                self.twins[h as usize] = twin.unwrap_or(NONE);
            }
        }
    }

    /// Makes a half-edge that leaves a vertex leave another.
    pub(crate) fn set_origin(&mut self, h: u32, v: u32) {
        self.triangles[h as usize / 3][h as usize % 3] = v;
    }

    /// Cuts along the half-edges (and their twins) for which `cut` holds.
    pub fn open(&self, cut: impl Fn(u32) -> bool) -> Opened {
        let twins: Vec<u32> = (0..self.twins.len() as u32)
            .map(|h| match self.twin(h) {
                Some(twin) if !cut(h) && !cut(twin) => twin,
                _ => NONE,
            })
            .collect();
        let mut open = Self {
            triangles: vec![[NONE; 3]; self.triangles.len()],
            twins,
            vertices: 0,
        };
        let mut source = Vec::with_capacity(self.vertices);
        for h in 0..open.twins.len() as u32 {
            if open.origin(h) != NONE {
                continue;
            }
            let vertex = source.len() as u32;
            source.push(self.origin(h));
            for corner in open.fan(h) {
                open.triangles[corner as usize / 3][corner as usize % 3] = vertex;
            }
        }
        open.vertices = source.len();
        Opened {
            topology: open,
            source,
        }
    }

    /// With a fan of triangles over each of the boundary loops `holes`, around a vertex of its
    /// own. What there was keeps its numbers.
    pub fn capped(&self, holes: &[Vec<u32>]) -> Self {
        let mut capped = self.clone();
        for rim in holes {
            let start = capped.half_edges();
            let side = |i: usize| start + 3 * (i % rim.len()) as u32;
            for (i, &h) in rim.iter().enumerate() {
                let corners = [self.target(h), self.origin(h), capped.vertices as u32];
                capped.triangles.push(corners);
                capped.twins[h as usize] = side(i);
                capped
                    .twins
                    .extend([h, side(i + rim.len() - 1) + 2, side(i + 1) + 1]);
            }
            capped.vertices += 1;
        }
        capped
    }

    /// The triangles by their vertices, counter-clockwise.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// How many vertices there are.
    pub fn vertices(&self) -> usize {
        self.vertices
    }

    /// How many half-edges there are.
    pub fn half_edges(&self) -> u32 {
        self.twins.len() as u32
    }

    /// The vertex that a half-edge starts from.
    pub fn origin(&self, h: u32) -> u32 {
        self.triangles[h as usize / 3][h as usize % 3]
    }

    /// The vertex that a half-edge runs to.
    pub fn target(&self, h: u32) -> u32 {
        self.origin(next(h))
    }

    /// The half-edge on the other side; none on the boundary.
    pub fn twin(&self, h: u32) -> Option<u32> {
        Some(self.twins[h as usize]).filter(|&twin| twin != NONE)
    }

    /// One half-edge of every edge.
    pub fn edges(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.half_edges()).filter(|&h| self.twin(h).is_none_or(|twin| h < twin))
    }

    /// The half-edges that leave the origin of `h`, clockwise around it; on the boundary all
    /// from the one that has no twin behind it.
    pub fn fan(&self, h: u32) -> Vec<u32> {
        let mut fan = vec![h];
        let mut last = h;
        while let Some(twin) = self.twin(last) {
            last = next(twin);
            if last == h {
                return fan;
            }
            fan.push(last);
        }
        let mut first = h;
        let mut before = Vec::new();
        while let Some(twin) = self.twin(previous(first)) {
            first = twin;
            before.push(first);
        }
        before.reverse();
        before.extend(fan);
        before
    }

    /// The boundary: its loops of half-edges, each with the surface on its left.
    pub fn boundary_loops(&self) -> Vec<Vec<u32>> {
        let mut seen = vec![false; self.twins.len()];
        let mut loops = Vec::new();
        for start in 0..self.half_edges() {
            if self.twin(start).is_some() || seen[start as usize] {
                continue;
            }
            let mut edges = Vec::new();
            let mut h = start;
            while !seen[h as usize] {
                seen[h as usize] = true;
                edges.push(h);
                h = next(h);
                while let Some(twin) = self.twin(h) {
                    h = next(twin);
                }
            }
            loops.push(edges);
        }
        loops
    }

    /// Vertices less edges plus triangles: 2 for a sphere, 1 for a disk, 0 for a torus.
    pub fn euler_characteristic(&self) -> i64 {
        self.vertices as i64 - self.edges().count() as i64 + self.triangles.len() as i64
    }

    /// The connected pieces: for every triangle the number of its own, and how many there are.
    pub fn pieces(&self) -> (Vec<u32>, usize) {
        let mut piece = vec![NONE; self.triangles.len()];
        let mut count = 0;
        for start in 0..piece.len() {
            if piece[start] != NONE {
                continue;
            }
            piece[start] = count;
            let mut stack = vec![start as u32];
            while let Some(t) = stack.pop() {
                for twin in (3 * t..3 * t + 3).filter_map(|h| self.twin(h)) {
                    if piece[twin as usize / 3] == NONE {
                        piece[twin as usize / 3] = count;
                        stack.push(twin / 3);
                    }
                }
            }
            count += 1;
        }
        (piece, count as usize)
    }
}

/// The half-edge that follows in the same triangle.
pub fn next(h: u32) -> u32 {
    if h % 3 == 2 { h - 2 } else { h + 1 }
}

/// The half-edge that precedes in the same triangle.
pub fn previous(h: u32) -> u32 {
    if h.is_multiple_of(3) { h + 2 } else { h - 1 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fam_surface::shapes;

    #[test]
    fn shapes_have_their_euler_characteristic_and_boundary() {
        let of = |mesh: &TriangleMesh| {
            let topology = Topology::oriented(mesh).topology;
            (topology.euler_characteristic(), topology.boundary_loops())
        };
        let (torus, loops) = of(&shapes::torus(1.0, 0.4, 12, 8));
        assert_eq!((torus, loops.len()), (0, 0));
        let (cylinder, loops) = of(&shapes::open_cylinder(1.0, 2.0, 12, 5));
        assert_eq!((cylinder, loops.len()), (0, 2));
        assert!(loops.iter().all(|edges| edges.len() == 12));
        let (sheet, loops) = of(&shapes::rectangle(1.0, 2.0, 3, 4));
        assert_eq!((sheet, loops.len(), loops[0].len()), (1, 1, 14));
    }

    /// Cut where its sides do not fit, it is an orientable strip.
    #[test]
    fn a_moebius_strip_comes_cut() {
        let strip = shapes::moebius_strip(0.5, 40, 4);
        let opened = Topology::oriented(&strip);
        let topology = &opened.topology;
        assert_eq!(topology.euler_characteristic(), 1);
        assert_eq!(topology.boundary_loops().len(), 1);
        for h in 0..topology.half_edges() {
            if let Some(twin) = topology.twin(h) {
                assert_eq!(topology.origin(h), topology.target(twin));
            }
        }
    }

    #[test]
    fn turned_triangles_are_turned_back() {
        let sheet = shapes::rectangle(1.0, 1.0, 6, 5);
        let mixed: Vec<[u32; 3]> = sheet
            .triangles()
            .iter()
            .enumerate()
            .map(|(t, &[a, b, c])| if t % 7 == 3 { [a, c, b] } else { [a, b, c] })
            .collect();
        let mixed = TriangleMesh::new(sheet.positions().to_vec(), mixed).unwrap();
        let (one, other) = (Topology::oriented(&sheet), Topology::oriented(&mixed));
        assert_eq!(one.topology.boundary_loops()[0].len(), 22);
        let by_source = |opened: &Opened, t: usize| {
            let mut corners = opened.topology.triangles()[t].map(|v| opened.source[v as usize]);
            let least = (0..3).min_by_key(|&c| corners[c]).unwrap_or(0);
            corners.rotate_left(least);
            corners
        };
        for t in 0..sheet.triangles().len() {
            assert_eq!(by_source(&one, t), by_source(&other, t));
        }
    }

    #[test]
    fn a_capped_cylinder_is_a_sphere() {
        let cylinder = Topology::oriented(&shapes::open_cylinder(1.0, 2.0, 12, 5)).topology;
        let loops = cylinder.boundary_loops();
        assert_eq!(cylinder.capped(&loops[..1]).euler_characteristic(), 1);
        let sphere = cylinder.capped(&loops);
        assert_eq!(sphere.euler_characteristic(), 2);
        for h in 0..sphere.half_edges() {
            let twin = sphere.twin(h).unwrap();
            assert_eq!(sphere.twin(twin), Some(h));
            assert_eq!(sphere.origin(h), sphere.target(twin));
        }
    }

    #[test]
    fn a_slit_splits_the_vertices_along_it_but_not_its_ends() {
        let sheet = Topology::oriented(&shapes::rectangle(1.0, 1.0, 6, 6)).topology;
        let inner = |v: u32| (1..6).contains(&(v % 7)) && (1..6).contains(&(v / 7));
        let slit: Vec<u32> = sheet
            .edges()
            .filter(|&h| {
                let (a, b) = (sheet.origin(h), sheet.target(h));
                inner(a) && inner(b) && a / 7 == 3 && b / 7 == 3
            })
            .collect();
        assert_eq!(slit.len(), 4);
        let opened = sheet.open(|h| slit.contains(&h));
        assert_eq!(opened.topology.vertices(), sheet.vertices() + 3);
        assert_eq!(opened.topology.boundary_loops().len(), 2);
        assert_eq!(opened.topology.pieces().1, 1);
    }
}
