//! Where a layout is distorted most.

use crate::patch::topology::Topology;
use crate::refine::diffusion::Diffusion;

/// A place that a cut should reach.
pub struct Peak {
    /// The vertex of the highest density.
    pub vertex: u32,
    /// The distortion of all that lies around it.
    pub mass: f64,
    /// Vertices around it that are both dense and far from the cut.
    pub deep: Vec<u32>,
}

/// The local maxima of the diffused distortion, those with most distortion around them first.
///
/// `excess` is the energy of every triangle above that of an isometry, times its area. A
/// vertex belongs to the peak that steepest ascent leads to.
pub fn peaks(
    topology: &Topology,
    diffusion: &Diffusion,
    excess: &[f64],
    depth: &[f64],
) -> Vec<Peak> {
    let mut amounts = vec![0.0; topology.vertices()];
    for (triangle, e) in topology.triangles().iter().zip(excess) {
        for &v in triangle {
            amounts[v as usize] += e / 3.0;
        }
    }
    let density = diffusion.spread(&amounts);
    let mut uphill: Vec<u32> = (0..density.len() as u32).collect();
    for h in topology.edges() {
        let (a, b) = (topology.origin(h), topology.target(h));
        for (from, to) in [(a, b), (b, a)] {
            if density[to as usize] > density[uphill[from as usize] as usize] {
                uphill[from as usize] = to;
            }
        }
    }
    // Downhill, so that the way up is known to its end.
    let mut order: Vec<u32> = (0..density.len() as u32).collect();
    order.sort_by(|&a, &b| {
        density[b as usize]
            .total_cmp(&density[a as usize])
            .then(a.cmp(&b))
    });
    let mut summit: Vec<u32> = (0..density.len() as u32).collect();
    let mut mass = vec![0.0; density.len()];
    for &v in &order {
        summit[v as usize] = summit[uphill[v as usize] as usize];
        mass[summit[v as usize] as usize] += amounts[v as usize];
    }
    let n = density.len();
    let mut deepest: Vec<[(f64, u32); 2]> = vec![[(0.0, 0); 2]; n];
    for v in 0..n {
        let d = depth[v];
        for (k, score) in [density[v] * d, density[v] * d * d].into_iter().enumerate() {
            let best = &mut deepest[summit[v] as usize][k];
            if score > best.0 {
                *best = (score, v as u32);
            }
        }
    }
    let is_summit = |v: &u32| uphill[*v as usize] == *v;
    let mut peaks: Vec<Peak> = order
        .into_iter()
        .filter(is_summit)
        .map(|vertex| Peak {
            vertex,
            mass: mass[vertex as usize],
            deep: deepest[vertex as usize]
                .iter()
                .filter(|d| d.0 > 0.0)
                .map(|d| d.1)
                .collect(),
        })
        .collect();
    peaks.sort_by(|a, b| b.mass.total_cmp(&a.mass));
    peaks
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::patch::Patch;
    use fam_surface::shapes;
    use fam_surface::vector::{length, sub};

    #[test]
    fn peaks_are_where_distortion_is() {
        let patch = Patch::of(&shapes::rectangle(1.0, 1.0, 24, 24));
        let flow = Diffusion::new(&patch.topology, &patch.lengths, &patch.areas, 0.05 * 0.05);
        let triangle = |column: usize, row: usize| 2 * (24 * column + row);
        let mut excess = vec![0.0; patch.areas.len()];
        let places = [
            (triangle(5, 6), 1.0),
            (triangle(17, 18), 3.0),
            (triangle(18, 4), 2.0),
        ];
        for (t, amount) in places {
            excess[t] = amount;
        }
        let depth = vec![1.0; patch.positions.len()];
        let found = peaks(&patch.topology, &flow, &excess, &depth);
        let corner = |t: usize| patch.positions[patch.topology.triangles()[t][0] as usize];
        let order = [places[1], places[2], places[0]];
        for (peak, (t, amount)) in found.iter().zip(order) {
            let away = length(sub(patch.positions[peak.vertex as usize], corner(t)));
            assert!(away < 0.1, "{away}");
            assert!((peak.mass - amount).abs() < 0.05, "{}", peak.mass);
        }
        let sum: f64 = found.iter().map(|peak| peak.mass).sum();
        assert!((sum - 6.0).abs() < 1e-9);
    }

    /// With nothing but depth to choose by, the deep vertices lie away from the summit.
    #[test]
    fn deep_vertices_are_far_from_the_cut() {
        let patch = Patch::of(&shapes::rectangle(2.0, 1.0, 24, 12));
        let flow = Diffusion::new(&patch.topology, &patch.lengths, &patch.areas, 0.1);
        let excess: Vec<f64> = (0..patch.areas.len()).map(|t| f64::from(t == 0)).collect();
        let depth: Vec<f64> = patch.positions.iter().map(|p| p[0].powi(4)).collect();
        let found = peaks(&patch.topology, &flow, &excess, &depth);
        let at = |v: u32| patch.positions[v as usize][0];
        let first = &found[0];
        assert_eq!(first.deep.len(), 2);
        assert!(first.deep.iter().all(|&v| at(v) > at(first.vertex) + 0.1));
        let none = peaks(&patch.topology, &flow, &excess, &vec![0.0; depth.len()]);
        assert!(none.iter().all(|peak| peak.deep.is_empty()));
    }

    #[test]
    fn without_distortion_nothing_is_high() {
        let patch = Patch::of(&shapes::torus(1.0, 0.4, 12, 8));
        let flow = Diffusion::new(&patch.topology, &patch.lengths, &patch.areas, 0.01);
        let nothing = vec![0.0; patch.areas.len()];
        let found = peaks(&patch.topology, &flow, &nothing, &vec![1.0; 96]);
        assert!(found.iter().all(|peak| peak.mass == 0.0));
    }
}
