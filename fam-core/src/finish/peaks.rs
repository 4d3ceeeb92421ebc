//! Where a layout is distorted most.

use super::diffusion::Diffusion;
use super::topology::Topology;

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
pub fn peaks(topology: &Topology, diffusion: &Diffusion, excess: &[f64], depth: &[f64]) -> Vec<Peak> {
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
    order.sort_by(|&a, &b| density[b as usize].total_cmp(&density[a as usize]).then(a.cmp(&b)));
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
            if score > best.0 { *best = (score, v as u32); }
        }
    }
    let is_summit = |v: &u32| uphill[*v as usize] == *v;
    let mut peaks: Vec<Peak> = order
        .into_iter()
        .filter(is_summit)
        .map(|vertex| Peak {
            vertex,
            mass: mass[vertex as usize],
            deep: deepest[vertex as usize].iter().filter(|d| d.0 > 0.0).map(|d| d.1).collect(),
        })
        .collect();
    peaks.sort_by(|a, b| b.mass.total_cmp(&a.mass));
    peaks
}
