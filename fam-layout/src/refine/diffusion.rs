//! Diffusion of a density over a surface.

use crate::patch::topology::{Topology, next, previous};

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
                let sum =
                    finite(cotangent(h)) + topology.twin(h).map_or(0.0, |t| finite(cotangent(t)));
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
        let precondition =
            |r: &[f64]| -> Vec<f64> { r.iter().zip(&self.diagonal).map(|(r, d)| r / d).collect() };
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::patch::Patch;
    use fam_surface::shapes;

    fn spread(patch: &Patch, time: f64, amounts: &[f64]) -> Vec<f64> {
        Diffusion::new(&patch.topology, &patch.lengths, &patch.areas, time).spread(amounts)
    }

    #[test]
    fn heat_is_kept_and_flattens_with_time() {
        for mesh in [
            shapes::rectangle(1.0, 1.0, 20, 20),
            shapes::torus(1.0, 0.4, 24, 12),
        ] {
            let patch = Patch::of(&mesh);
            let mut share = vec![0.0; patch.topology.vertices()];
            for (t, area) in patch.topology.triangles().iter().zip(&patch.areas) {
                for &v in t {
                    share[v as usize] += area / 3.0;
                }
            }
            let mut amounts = vec![0.0; share.len()];
            amounts[100] = 2.0;
            let mut highest = f64::INFINITY;
            for time in [1e-4, 1e-3, 1e-2, 1.0, 100.0] {
                let density = spread(&patch, time, &amounts);
                let heat: f64 = density.iter().zip(&share).map(|(d, a)| d * a).sum();
                assert!((heat - 2.0).abs() < 1e-2, "{heat} at {time}");
                let high = density.iter().fold(0.0, |m: f64, &d| m.max(d));
                assert!(high < highest && high == density[100], "{high} at {time}");
                assert!(density.iter().all(|&d| d > -1e-3 * high));
                highest = high;
            }
            // Next to even all over the area of 1.
            assert!(highest < 2.1, "{highest}");
        }
    }

    /// One implicit step of the flow along a line has the density e^(−|x|/√t) / (2 √t).
    #[test]
    fn a_line_of_heat_falls_off_exponentially() {
        let patch = Patch::of(&shapes::rectangle(1.0, 1.0, 80, 8));
        let at = |v: usize| patch.positions[v][0] - patch.positions[9 * 40][0];
        let middle = |v: usize| at(v).abs() < 1e-9;
        let of = |v: usize| match (middle(v), v % 9) {
            (false, _) => 0.0,
            (true, 0 | 8) => 0.5 / 8.0,
            (true, _) => 1.0 / 8.0,
        };
        let amounts: Vec<f64> = (0..patch.positions.len()).map(of).collect();
        let width: f64 = 0.06;
        let density = spread(&patch, width * width, &amounts);
        for (v, &d) in density.iter().enumerate() {
            let expected = (-at(v).abs() / width).exp() / (2.0 * width);
            assert!(
                (d - expected).abs() < 0.15,
                "{d}, not {expected}, at {}",
                at(v)
            );
        }
    }

    #[test]
    fn slivers_do_not_stop_it() {
        let sheet = shapes::rectangle(1.0, 1.0, 12, 12);
        let place = |p: &[f64; 3]| [p[0], if p[1].abs() < 0.3 { 0.0 } else { p[1] }, 0.0];
        let positions = sheet.positions().iter().map(place).collect();
        let pressed = fam_surface::TriangleMesh::new(positions, sheet.triangles().to_vec());
        let patch = Patch::of(&pressed.unwrap());
        let mut amounts = vec![0.0; patch.topology.vertices()];
        amounts[80] = 1.0;
        let density = spread(&patch, 0.01, &amounts);
        assert!(density.iter().all(|d| d.is_finite()));
    }
}
