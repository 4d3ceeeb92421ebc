//! Diffusion of a density over a surface.

use super::topology::{Topology, next, previous};

/// Iterations of the conjugate gradient method: the system is well conditioned, and peaks
/// need no more than a few digits.
const ITERATIONS: usize = 200;
const TOLERANCE: f64 = 1e-4;

/// Bounds of a cotangent weight, so that slivers neither block nor short-circuit the flow.
const WEIGHTS: [f64; 2] = [0.02, 20.0];

/// Heat flow on a surface over a fixed time, by one implicit step.
pub struct Diffusion {
    /// Per vertex its share of the area.
    mass: Vec<f64>,
    /// Per edge: ends and time × cotangent weight.
    edges: Vec<(u32, u32, f64)>,
    diagonal: Vec<f64>,
}

impl Diffusion {
    /// Prepares the flow over `time` (in squared length) on a surface with the given lengths
    /// of half-edges and areas of triangles.
    pub fn new(topology: &Topology, lengths: &[f64], areas: &[f64], time: f64) -> Self {
        let mut mass = vec![0.0; topology.vertices()];
        for (triangle, area) in topology.triangles().iter().zip(areas) {
            for &v in triangle {
                mass[v as usize] += area / 3.0;
            }
        }
        // A vertex without area would have no equation of its own.
        let least = 1e-9 * areas.iter().sum::<f64>() / mass.len().max(1) as f64;
        mass.iter_mut().for_each(|m| *m = m.max(least));
        let cotangent = |h: u32| {
            let [a, b, c] = [h, next(h), previous(h)].map(|h| lengths[h as usize].powi(2));
            let area = areas[h as usize / 3];
            ((b + c - a) / (4.0 * area)).clamp(-WEIGHTS[1], WEIGHTS[1])
        };
        let finite = |w: f64| if w.is_finite() { w } else { WEIGHTS[1] };
        let mut diagonal = mass.clone();
        let edges = topology
            .edges()
            .map(|h| {
                let sum = finite(cotangent(h)) + topology.twin(h).map_or(0.0, |t| finite(cotangent(t)));
                let weight = time * (0.5 * sum).clamp(WEIGHTS[0], WEIGHTS[1]);
                let (a, b) = (topology.origin(h), topology.target(h));
                diagonal[a as usize] += weight;
                diagonal[b as usize] += weight;
                (a, b, weight)
            })
            .collect();
        Self {
            mass,
            edges,
            diagonal,
        }
    }

    /// The density after the flow, from the amount of heat at every vertex.
    pub fn spread(&self, amounts: &[f64]) -> Vec<f64> {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let precondition = |r: &[f64]| -> Vec<f64> {
            r.iter().zip(&self.diagonal).map(|(r, d)| r / d).collect()
        };
        let mut x = vec![0.0; amounts.len()];
        let mut r = amounts.to_vec();
        let mut z = precondition(&r);
        let mut p = z.clone();
        let mut rz = dot(&r, &z);
        let enough = TOLERANCE * TOLERANCE * rz;
        for _ in 0..ITERATIONS {
            if rz.is_nan() || rz <= enough {
                break;
            }
            let q = self.apply(&p);
            let step = rz / dot(&p, &q);
            for i in 0..x.len() {
                x[i] += step * p[i];
                r[i] -= step * q[i];
            }
            z = precondition(&r);
            let before = std::mem::replace(&mut rz, dot(&r, &z));
            for i in 0..p.len() {
                p[i] = z[i] + rz / before * p[i];
            }
        }
        x
    }

    fn apply(&self, x: &[f64]) -> Vec<f64> {
        let mut y: Vec<f64> = x.iter().zip(&self.mass).map(|(x, m)| x * m).collect();
        for &(a, b, w) in &self.edges {
            let flow = w * (x[a as usize] - x[b as usize]);
            y[a as usize] += flow;
            y[b as usize] -= flow;
        }
        y
    }
}
