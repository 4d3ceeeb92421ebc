//! The tear field: where the network cuts the surface, as costs of edges.

use super::patch::Patch;

/// A cut along a tear costs this part of its length.
const TORN: f64 = 0.9;

/// An edge is torn where its image is this many times as long as most edges' of its length.
const STRETCH: f64 = 3.0;


/// For every half-edge what a cut along it costs: its length, or a part of it where it runs
/// along a tear of the map `raw` (one UV per vertex
/// of the component), that is between two ends of torn edges.
pub fn tear_costs(patch: &Patch, raw: &[[f32; 2]]) -> Vec<f64> {
    let (topology, lengths) = (&patch.topology, &patch.lengths);
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
        return lengths.clone();
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
            lengths[h as usize] * if along { TORN } else { 1.0 }
        })
        .collect()
}
