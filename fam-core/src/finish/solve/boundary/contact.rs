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
