use std::ops::ControlFlow;

use crate::patch::topology::{Topology, previous};

use super::Boundary;
use super::plane::{Point, along, cross, dot, length, minus, orientation};

/// How far the sides of a slit move off it, as a fraction of the length of the edges there.
const OPENING: f64 = 0.05;

/// What a vertex may move of the way to where a triangle of its would collapse.
const SAFETY: f64 = 0.25;

/// How often a move is halved at most; less than its last length is lost in rounding.
const HALVINGS: usize = 40;

/// The sides of a cut cannot be moved apart: the layout had collapsed or overlapping parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the sides of a cut cannot be moved apart")]
pub(crate) struct SlitsStuck;

/// Moves the two sides of closed slits apart, so that the boundary is simple.
///
/// A layout that was injective keeps its UVs when it is cut, so that the vertices on both
/// sides of the cuts coincide. Each of them moves a little into the triangles around it, and
/// less where a triangle would flip or edges would meet. `boundary` is that of `topology`,
/// `source` has the vertex before the cut (see [`crate::patch::topology::Opened`]) and `uv`
/// the position for each of its vertices. On an error the UVs are as they were.
pub(crate) fn open_slits(
    topology: &Topology,
    source: &[u32],
    boundary: &Boundary,
    uv: &mut [Point],
) -> Result<(), SlitsStuck> {
    let moves = moves(topology, source, boundary, uv);
    moved_apart(topology, boundary, uv, moves)
}

/// The same wherever the boundary touches itself, as along T-junctions, where a long edge lies
/// on several short ones without being joined to them.
pub(crate) fn open_contacts(
    topology: &Topology,
    boundary: &Boundary,
    uv: &mut [Point],
) -> Result<(), SlitsStuck> {
    let mut touches = vec![false; boundary.vertices.len()];
    let _: ControlFlow<()> = boundary.for_each_touching_pair(uv, |i, j| {
        for k in [i, j] {
            touches[k] = true;
            touches[boundary.next(k)] = true;
        }
        ControlFlow::Continue(())
    });
    let moves = touches
        .iter()
        .enumerate()
        .map(|(i, &touches)| match touches {
            true => inward(topology, boundary, uv, i),
            false => Move::NONE,
        });
    let moves = moves.collect();
    moved_apart(topology, boundary, uv, moves)
}

/// Makes moves, or shorter ones, after which the boundary is simple.
fn moved_apart(
    topology: &Topology,
    boundary: &Boundary,
    uv: &mut [Point],
    mut moves: Vec<Move>,
) -> Result<(), SlitsStuck> {
    let closed = uv.to_vec();
    for _ in 0..HALVINGS {
        for (i, step) in moves.iter().enumerate() {
            let v = boundary.vertices[i] as usize;
            uv[v] = along(closed[v], step.length, step.direction);
        }
        let stuck = stuck(topology, boundary, uv, &moves);
        if stuck.is_empty() {
            if boundary.is_simple(uv) {
                return Ok(());
            }
            break;
        }
        if stuck.iter().all(|&i| moves[i].length == 0.0) {
            break;
        }
        for i in stuck {
            moves[i].length *= 0.5;
        }
    }
    uv.copy_from_slice(&closed);
    Err(SlitsStuck)
}

#[derive(Clone, Copy)]
struct Move {
    direction: Point,
    length: f64,
}

impl Move {
    const NONE: Self = Self {
        direction: [0.0; 2],
        length: 0.0,
    };
}

/// A move for every boundary vertex; without length for those that are on no closed slit.
fn moves(topology: &Topology, source: &[u32], boundary: &Boundary, uv: &[Point]) -> Vec<Move> {
    let mut by_source: Vec<(u32, usize)> = (0..boundary.vertices.len())
        .map(|i| (source[boundary.vertices[i] as usize], i))
        .collect();
    by_source.sort_unstable();
    let mut moves = vec![Move::NONE; by_source.len()];
    for copies in by_source.chunk_by(|a, b| a.0 == b.0) {
        for &(_, i) in copies {
            let here = boundary.point(uv, i);
            let coincides = |&(_, j): &(u32, usize)| i != j && boundary.point(uv, j) == here;
            if copies.iter().any(coincides) {
                moves[i] = inward(topology, boundary, uv, i);
            }
        }
    }
    moves
}

/// The move of a boundary vertex along the bisector of its fan.
fn inward(topology: &Topology, boundary: &Boundary, uv: &[Point], i: usize) -> Move {
    let h = boundary.half_edges[i];
    let here = boundary.point(uv, i);
    let spokes = |g: u32| {
        [topology.target(g), topology.origin(previous(g))].map(|v| minus(uv[v as usize], here))
    };
    let fan: Vec<[Point; 2]> = topology.fan(h).into_iter().map(spokes).collect();
    let angle: f64 = fan.iter().map(|&[x, y]| cross(x, y).atan2(dot(x, y))).sum();
    let (sin, cos) = (0.5 * angle).sin_cos();
    // The fan runs clockwise and ends at the edge that leaves along the boundary.
    let [[first, _], [_, last]] = [fan[fan.len() - 1], fan[0]];
    let shortest = length(first).min(length(last));
    let direction = [
        (cos * first[0] - sin * first[1]) / length(first),
        (sin * first[0] + cos * first[1]) / length(first),
    ];
    let collapse = fan.iter().filter_map(|&[x, y]| {
        let rate = cross(direction, minus(y, x));
        (rate > 0.0).then(|| cross(x, y) / rate)
    });
    let wanted = OPENING * boundary.scales[i].min(shortest) / sin.max(0.5);
    let length = collapse.fold(wanted, |least, t| least.min(SAFETY * t));
    Move { direction, length }
}

/// The boundary vertices of triangles that are not positive and of edges that meet.
fn stuck(topology: &Topology, boundary: &Boundary, uv: &[Point], moves: &[Move]) -> Vec<usize> {
    let mut stuck = Vec::new();
    for i in (0..moves.len()).filter(|&i| moves[i].length > 0.0) {
        let is_negative = |g: &u32| {
            let [a, b, c] = topology.triangles()[*g as usize / 3].map(|v| uv[v as usize]);
            orientation(a, b, c) <= 0.0
        };
        if topology.fan(boundary.half_edges[i]).iter().any(is_negative) {
            stuck.push(i);
        }
    }
    let _: ControlFlow<()> = boundary.for_each_touching_pair(uv, |i, j| {
        stuck.extend([i, j].iter().flat_map(|&i| [i, boundary.next(i)]));
        ControlFlow::Continue(())
    });
    stuck.sort_unstable();
    stuck.dedup();
    stuck
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    use super::*;
    use crate::patch::topology::{Opened, next};
    use fam_surface::{TriangleMesh, shapes};

    /// A chart and where its vertices are.
    struct Chart {
        topology: Topology,
        uv: Vec<Point>,
    }

    impl Chart {
        fn of(mesh: &TriangleMesh, place: impl Fn([f64; 3]) -> Point) -> Self {
            let Opened { topology, source } = Topology::oriented(mesh);
            let place = |&v: &u32| place(mesh.positions()[v as usize]);
            let uv = source.iter().map(place).collect();
            Self { topology, uv }
        }

        fn triangle(&self, t: u32) -> [Point; 3] {
            self.topology.triangles()[t as usize].map(|v| self.uv[v as usize])
        }

        fn is_positive(&self) -> bool {
            (0..self.topology.triangles().len() as u32).all(|t| {
                let [a, b, c] = self.triangle(t);
                orientation(a, b, c) > 0.0
            })
        }

        fn boundary(&self) -> Boundary {
            Boundary::new(&self.topology, |h| {
                let [a, b] = [self.topology.origin(h), self.topology.target(h)];
                length(minus(self.uv[a as usize], self.uv[b as usize]))
            })
        }

        /// Moves every vertex up to `size`, where its triangles stay positive.
        fn jitter(&mut self, rng: &mut Pcg64Mcg, size: f64) {
            for h in 0..self.topology.half_edges() {
                let v = self.topology.origin(h) as usize;
                let before = self.uv[v];
                self.uv[v] = before.map(|x| x + rng.random_range(-size..=size));
                let fan = self.topology.fan(h);
                let negative = fan.iter().any(|g| {
                    let [a, b, c] = self.triangle(g / 3);
                    orientation(a, b, c) <= 1e-4 * size * size
                });
                if negative || !self.boundary().is_simple(&self.uv) {
                    self.uv[v] = before;
                }
            }
        }

        /// The half-edges of a random walk from a random vertex; none that part the chart
        /// with the rest of them.
        fn walk(&self, rng: &mut Pcg64Mcg, steps: usize) -> BTreeSet<u32> {
            let mut cut = BTreeSet::new();
            let mut h = rng.random_range(0..self.topology.half_edges());
            for _ in 0..steps {
                if self.topology.twin(h).is_some() {
                    cut.insert(h);
                    if self.topology.open(|h| cut.contains(&h)).topology.pieces().1 > 1 {
                        cut.remove(&h);
                    }
                }
                let fan = self.topology.fan(next(h));
                h = fan[rng.random_range(0..fan.len())];
            }
            cut
        }

        /// Cut open, with the sides moved apart.
        fn cut(&self, cut: &BTreeSet<u32>) -> Result<Self, SlitsStuck> {
            let Opened { topology, source } = self.topology.open(|h| cut.contains(&h));
            let uv = source.iter().map(|&v| self.uv[v as usize]).collect();
            let mut chart = Self { topology, uv };
            let boundary = chart.boundary();
            open_slits(&chart.topology, &source, &boundary, &mut chart.uv)?;
            assert!(boundary.is_simple(&chart.uv));
            assert!(chart.is_positive());
            Ok(chart)
        }
    }

    fn sheet(cells: u32) -> Chart {
        let mesh = shapes::rectangle(1.0, 1.0, cells, cells);
        Chart::of(&mesh, |[x, y, _]| [x, y])
    }

    fn ring() -> Chart {
        let mesh = shapes::open_cylinder(1.0, 1.0, 12, 4);
        let place = |[x, y, z]: [f64; 3]| [(1.0 - 0.9 * z) * x, (1.0 - 0.9 * z) * y];
        let chart = Chart::of(&mesh, place);
        match chart.is_positive() {
            true => chart,
            false => Chart::of(&mesh, |q| place([q[0], q[1], -q[2]])),
        }
    }

    #[test]
    fn random_cuts_open_one_after_the_other() {
        let mut rng = Pcg64Mcg::seed_from_u64(1);
        for round in 0..60 {
            let mut chart = if round % 3 == 0 { ring() } else { sheet(6) };
            assert!(chart.is_positive());
            chart.jitter(&mut rng, 0.15);
            for steps in [1, 2, 3, 5, 8, 13] {
                let cut = chart.walk(&mut rng, steps);
                chart = chart.cut(&cut).unwrap();
            }
        }
    }

    #[test]
    fn a_cut_may_leave_nothing_but_strips_of_triangles() {
        let mut rng = Pcg64Mcg::seed_from_u64(2);
        for _ in 0..20 {
            let mut chart = sheet(5);
            chart.jitter(&mut rng, 0.15);
            let cut = chart.walk(&mut rng, 2000);
            assert!(cut.len() > 20, "{}", cut.len());
            chart.cut(&cut).unwrap();
        }
    }

    #[test]
    fn only_the_sides_of_the_slit_move_and_only_a_little() {
        let chart = sheet(6);
        let at = |h: u32| chart.uv[chart.topology.origin(h) as usize];
        let middle = |q: Point| q[1].abs() < 1e-6 && q[0].abs() < 0.4;
        let cut = chart
            .topology
            .edges()
            .filter(|&h| middle(at(h)) && middle(at(next(h))));
        let open = chart.cut(&cut.collect()).unwrap();
        let moved = |q: &&Point| !chart.uv.contains(q);
        assert_eq!(open.uv.len(), chart.uv.len() + 3);
        assert_eq!(open.uv.iter().filter(moved).count(), 6);
        for q in open.uv.iter().filter(moved) {
            let gap = q[1].abs();
            assert!(
                gap > 0.5 * OPENING / 6.0 && gap < 1.5 * OPENING / 6.0,
                "{gap}"
            );
        }
    }

    /// Without area nothing can be moved into.
    #[test]
    fn a_collapsed_layout_is_an_error_and_stays_as_it_was() {
        let mut chart = sheet(4);
        for q in &mut chart.uv {
            q[1] = 0.0;
        }
        let cut: BTreeSet<u32> = [30].into();
        assert!(chart.cut(&cut).is_err());
        let Opened { topology, source } = chart.topology.open(|h| (28..40).contains(&h));
        let mut uv: Vec<Point> = source.iter().map(|&v| chart.uv[v as usize]).collect();
        let before = uv.clone();
        let boundary = Boundary::new(&topology, |_| 1.0);
        let result = open_slits(&topology, &source, &boundary, &mut uv);
        assert_eq!(result, Err(SlitsStuck));
        assert_eq!(uv, before);
        uv.fill([f64::NAN; 2]);
        assert!(open_slits(&topology, &source, &boundary, &mut uv).is_err());
    }
}
