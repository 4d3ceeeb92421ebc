use std::ops::ControlFlow;

use super::Boundary;
use super::candidates::Bounds;
use super::plane::{Point, along, cross, dot, minus};

impl Boundary {
    /// The first t up to `step` at which a boundary vertex meets an edge if every vertex
    /// moves from `uv` to `uv` + t · `direction`; `step` if none does.
    ///
    /// Subject to rounding: a bound for a line search, not a replacement for
    /// [`Self::is_simple`].
    pub fn first_contact(&self, uv: &[Point], direction: &[Point], step: f64) -> f64 {
        let moved = |v: u32| along(uv[v as usize], step, direction[v as usize]);
        let tree = self.tree(0.0, |i| {
            let ends = [i, self.next(i)].map(|i| self.vertices[i]);
            Bounds::of(self.ends(uv, i)).union(Bounds::of(ends.map(moved)))
        });
        let mut first = step;
        let _: ControlFlow<()> = tree.for_each_pair(|i, j| {
            for [vertex, edge] in [[i, j], [j, i]] {
                let end = self.next(edge);
                if vertex == edge || vertex == end {
                    continue;
                }
                let ids = [vertex, edge, end].map(|i| self.vertices[i] as usize);
                let contact = contact(ids.map(|v| uv[v]), ids.map(|v| direction[v]));
                first = contact.map_or(first, |t| first.min(t));
            }
            ControlFlow::Continue(())
        });
        first
    }
}

/// When a moving point, the first, first lies on the moving segment between the others.
fn contact([p, a, b]: [Point; 3], [dp, da, db]: [Point; 3]) -> Option<f64> {
    let (edge, edge_speed) = (minus(b, a), minus(db, da));
    let (from, from_speed) = (minus(p, a), minus(dp, da));
    let on_line = roots(
        cross(edge_speed, from_speed),
        cross(edge, from_speed) + cross(edge_speed, from),
        cross(edge, from),
    );
    on_line.into_iter().flatten().find(|&t| {
        let (edge, from) = (along(edge, t, edge_speed), along(from, t, from_speed));
        let projection = dot(edge, from);
        t > 0.0 && 0.0 <= projection && projection <= dot(edge, edge)
    })
}

/// The real roots of a t² + b t + c in ascending order.
fn roots(a: f64, b: f64, c: f64) -> [Option<f64>; 2] {
    let discriminant = b * b - 4.0 * a * c;
    if discriminant < 0.0 {
        return [None; 2];
    }
    let q = -0.5 * (b + discriminant.sqrt().copysign(b));
    let mut roots = [q / a, c / q].map(|t| Some(t).filter(|t| t.is_finite()));
    roots.sort_by(|s, t| s.partial_cmp(t).unwrap_or(std::cmp::Ordering::Equal));
    roots
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    use super::*;
    use crate::finish::topology::Topology;
    use crate::surface::shapes;

    #[test]
    fn contact_has_its_closed_form() {
        let still = [0.0; 2];
        let above = [[0.5, 3.0], [0.0, 0.0], [1.0, 0.0]];
        let close = |t: Option<f64>, expected: f64| (t.unwrap() - expected).abs() < 1e-12;
        assert!(close(contact(above, [[0.0, -2.0], still, still]), 1.5));
        assert!(close(contact(above, [still, [0.0, 4.0], [0.0, 2.0]]), 1.0));
        assert_eq!(contact(above, [[2.0, -2.0], still, still]), None);
        assert_eq!(contact(above, [[0.0, 2.0], still, still]), None);
        // A quarter turn of an edge, as by a chord: it meets the diagonal half way.
        let beside = [[0.5, 0.5], [0.0, 0.0], [2.0, 0.0]];
        assert!(close(contact(beside, [still, still, [-2.0, 2.0]]), 0.5));
        assert_eq!(contact(above, [still; 3]), None);
    }

    /// Until the first contact the boundary stays simple, a little later it is not.
    #[test]
    fn first_contact_is_where_the_boundary_stops_being_simple() {
        let sheet = shapes::rectangle(4.0, 3.0, 8, 6);
        let opened = Topology::oriented(&sheet);
        let topology = opened.topology;
        let boundary = Boundary::new(&topology, |_| 0.5);
        let place = |&v: &u32| {
            let [x, y, _] = sheet.positions()[v as usize];
            [x, y]
        };
        let uv: Vec<Point> = opened.source.iter().map(place).collect();
        let mut rng = Pcg64Mcg::seed_from_u64(1);
        for _ in 0..100 {
            let direction: Vec<Point> = uv
                .iter()
                .map(|_| [0; 2].map(|_| rng.random_range(-1.0..1.0)))
                .collect();
            let first = boundary.first_contact(&uv, &direction, 10.0);
            assert!(first < 10.0);
            let at = |t: f64| -> Vec<Point> {
                let both = uv.iter().zip(&direction);
                both.map(|(&q, &d)| along(q, t, d)).collect()
            };
            for step in 0..20 {
                assert!(boundary.is_simple(&at(0.9999 * first * f64::from(step) / 19.0)));
            }
            assert!(!boundary.is_simple(&at(first * (1.0 + 1e-9))));
            assert_eq!(
                boundary.first_contact(&uv, &direction, 0.5 * first),
                0.5 * first
            );
        }
    }
}
