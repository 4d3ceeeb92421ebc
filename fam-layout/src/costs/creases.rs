//! Sharp edges and corners of a surface, where seams are welcome or wanted.

use std::f64::consts::{FRAC_PI_2, TAU};

use crate::patch::Patch;
use fam_surface::TriangleMesh;
use fam_surface::vector::{cross, dot, length, sub};

/// By what share of its length an edge is cheaper at which the surface turns by a right angle or
/// more, and by less in proportion where it turns less, at a weight of 1. It decides between ways of
/// about equal length; seams get no longer by it than they vary otherwise.
pub const DISCOUNT: f64 = 0.1;

/// By how many radians less than the angle that is asked for an edge may turn and still count as sharp:
/// positions are rounded.
const ROUNDING: f64 = 1e-5;

/// The square of the angle that a corner has at least, in multiples of what the bound is above 4.
/// At a bound of 4.01 the corners of a cube, of a quarter turn, count as such; at 4.1 it is
/// cheaper to smooth them over.
const LEAST_CORNER: f64 = 100.0;

/// For every half-edge what a cut along it costs: its price, or somewhat less on a crease.
pub fn crease_costs(patch: &Patch) -> Vec<f64> {
    let discount = patch.crease_weight * DISCOUNT;
    let share = |h: u32| 1.0 - discount * (turn(patch, h) / FRAC_PI_2).min(1.0);
    (0..patch.topology.half_edges())
        .map(|h| patch.prices[h as usize] * share(h))
        .collect()
}

/// The edges between two triangles of a mesh whose planes differ by at least an angle in radians, each by
/// its vertices, the smaller first.
pub fn sharp_edges(mesh: &TriangleMesh, angle: f64) -> Vec<[u32; 2]> {
    let patch = Patch::of(mesh);
    let topology = &patch.topology;
    let is_sharp = |&h: &u32| topology.twin(h).is_some() && turn(&patch, h) >= angle - ROUNDING;
    let source = |v: u32| patch.source[v as usize];
    topology
        .edges()
        .filter(is_sharp)
        .map(|h| [source(topology.origin(h)), source(topology.target(h))])
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect()
}

/// The vertices inside the surface where it is so pointed that no layout within a bound is flat
/// there, unless the cut goes through them.
pub fn corners(patch: &Patch, bound: f64) -> Vec<u32> {
    let least = (LEAST_CORNER * (bound - 4.0)).sqrt();
    let defects = angle_defects(patch);
    let vertices = 0..patch.topology.vertices() as u32;
    vertices
        .filter(|&v| defects[v as usize].abs() > least)
        .collect()
}

/// The angle between the planes of the triangles beside an edge; 0 on the boundary.
fn turn(patch: &Patch, h: u32) -> f64 {
    let normal = |h: u32| {
        let [a, b, c] = patch.topology.triangles()[h as usize / 3];
        let at = |v: u32| patch.positions[v as usize];
        cross(sub(at(b), at(a)), sub(at(c), at(a)))
    };
    patch.topology.twin(h).map_or(0.0, |twin| {
        let (m, n) = (normal(h), normal(twin));
        length(cross(m, n)).atan2(dot(m, n))
    })
}

/// For every vertex by how much the angles around it are less than a full turn; 0 on the
/// boundary.
fn angle_defects(patch: &Patch) -> Vec<f64> {
    let topology = &patch.topology;
    let at = |v: u32| patch.positions[v as usize];
    let mut defects = vec![TAU; topology.vertices()];
    for &[a, b, c] in topology.triangles() {
        for [v, one, other] in [[a, b, c], [b, c, a], [c, a, b]] {
            let (one, other) = (sub(at(one), at(v)), sub(at(other), at(v)));
            defects[v as usize] -= length(cross(one, other)).atan2(dot(one, other));
        }
    }
    for h in (0..topology.half_edges()).filter(|&h| topology.twin(h).is_none()) {
        defects[topology.origin(h) as usize] = 0.0;
    }
    defects
}

#[cfg(test)]
mod tests {
    use super::*;
    use fam_surface::shapes;

    #[test]
    fn the_creases_of_a_cube_are_cheaper_and_its_corners_are_found() {
        let patch = Patch::of(&shapes::cube(3));
        let costs = crease_costs(&patch);
        let middle = patch.positions.iter().fold(0.0_f64, |m, p| m.max(p[0])) / 2.0;
        let on_sides = |v: u32| {
            let p = patch.positions[v as usize];
            [0, 1, 2]
                .map(|k| ((p[k] - middle).abs() / middle > 1.0 - 1e-9).then_some(p[k] > middle))
        };
        for h in 0..patch.topology.half_edges() {
            let [a, b] = [patch.topology.origin(h), patch.topology.target(h)].map(on_sides);
            let common = (0..3).filter(|&k| a[k].is_some() && a[k] == b[k]).count();
            let share = if common == 2 { 1.0 - DISCOUNT } else { 1.0 };
            let difference = costs[h as usize] - share * patch.lengths[h as usize];
            assert!(difference.abs() < 1e-9);
        }
        let is_corner = |&v: &u32| on_sides(v).iter().all(Option::is_some);
        let all = 0..patch.topology.vertices() as u32;
        assert_eq!(
            corners(&patch, 4.01),
            all.filter(is_corner).collect::<Vec<u32>>()
        );
        assert!(corners(&patch, 4.1).is_empty());
    }

    #[test]
    fn a_flat_sheet_has_neither() {
        let patch = Patch::of(&shapes::rectangle(1.0, 2.0, 4, 6));
        assert_eq!(crease_costs(&patch), patch.lengths);
        assert!(corners(&patch, 4.001).is_empty());
    }
}
