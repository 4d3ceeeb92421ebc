//! The tear field: where the network cuts the surface, as costs of edges.

use crate::costs::creases::crease_costs;
use crate::patch::Patch;

/// By what share of what it would cost otherwise a cut along a tear is cheaper, at a weight of 1.
const DISCOUNT: f64 = 0.1;

/// An edge is torn where its image is this many times as long as most edges' of its length.
const STRETCH: f64 = 3.0;

/// For every half-edge what a cut along it costs: what its price and its crease do, or a part of
/// it where it runs along a tear of the map `raw` (one UV per vertex of the component), that is
/// between two ends of torn edges. `weight` says how much tears count.
pub fn tear_costs(patch: &Patch, raw: &[[f32; 2]], weight: f64) -> Vec<f64> {
    let torn_share = 1.0 - weight * DISCOUNT;
    let (topology, lengths) = (&patch.topology, &patch.lengths);
    let costs = crease_costs(patch);
    let at = |v: u32| raw[patch.source[v as usize] as usize].map(f64::from);
    let stretch = |h: u32| {
        let [a, b] = [at(topology.origin(h)), at(topology.target(h))];
        let image = (b[0] - a[0]).hypot(b[1] - a[1]);
        image / lengths[h as usize]
    };
    let mut stretches: Vec<f64> = topology
        .edges()
        .map(stretch)
        .filter(|s| s.is_finite())
        .collect();
    if stretches.is_empty() {
        return costs;
    }
    let middle = stretches.len() / 2;
    let median = *stretches.select_nth_unstable_by(middle, f64::total_cmp).1;
    let mut torn = vec![false; topology.vertices()];
    for h in topology.edges().filter(|&h| stretch(h) > STRETCH * median) {
        torn[topology.origin(h) as usize] = true;
        torn[topology.target(h) as usize] = true;
    }
    (0..topology.half_edges())
        .map(|h| {
            let along = torn[topology.origin(h) as usize] && torn[topology.target(h) as usize];
            costs[h as usize] * if along { torn_share } else { 1.0 }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use fam_surface::shapes;

    /// Vertices come in columns of 7; between the last column and the first the map is torn.
    #[test]
    fn the_torn_column_of_an_unrolled_cylinder_is_cheap() {
        let patch = Patch::of(&shapes::open_cylinder(1.0, 2.0, 20, 6));
        let raw: Vec<[f32; 2]> = (0..140)
            .map(|v| [(v / 7) as f32 / 20.0, (v % 7) as f32 / 20.0])
            .collect();
        let cost = tear_costs(&patch, &raw, 1.0);
        let whole = crease_costs(&patch);
        let column = |v: u32| patch.source[v as usize] / 7;
        for h in 0..patch.topology.half_edges() {
            let ends = [patch.topology.origin(h), patch.topology.target(h)].map(column);
            let torn = ends.iter().all(|c| [0, 19].contains(c));
            let expected = whole[h as usize] * if torn { 0.9 } else { 1.0 };
            assert_eq!(cost[h as usize], expected);
        }
    }

    #[test]
    fn a_map_without_extent_tells_nothing() {
        let patch = Patch::of(&shapes::torus(1.0, 0.4, 12, 8));
        assert_eq!(
            tear_costs(&patch, &[[0.3; 2]; 96], 1.0),
            crease_costs(&patch)
        );
        let sheet = shapes::rectangle(1.0, 1.0, 5, 5);
        let faithful = Patch::of(&sheet);
        let raw: Vec<[f32; 2]> = sheet
            .positions()
            .iter()
            .map(|p| [p[0] as f32, p[1] as f32])
            .collect();
        assert_eq!(tear_costs(&faithful, &raw, 1.0), faithful.lengths);
    }

    /// They have no stretch to compare.
    #[test]
    fn costs_are_finite_at_edges_without_length() {
        let sheet = shapes::rectangle(1.0, 1.0, 6, 6);
        let flat = sheet
            .positions()
            .iter()
            .map(|p| [p[0], p[1].max(0.0), 0.0])
            .collect();
        let pressed = fam_surface::TriangleMesh::new(flat, sheet.triangles().to_vec()).unwrap();
        let patch = Patch::of(&pressed);
        let raw: Vec<[f32; 2]> = (0..49)
            .map(|v| [(v % 7) as f32, (v * v % 11) as f32])
            .collect();
        let cost = tear_costs(&patch, &raw, 1.0);
        assert!(
            cost.iter()
                .zip(&patch.lengths)
                .all(|(c, l)| (0.9 * l..=*l).contains(c))
        );
    }
}
