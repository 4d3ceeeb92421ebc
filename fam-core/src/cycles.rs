//! The bi-directional cycle mapping: both branches through the shared sub-networks.

use burn::tensor::{Tensor, backend::Backend};

use crate::evaluation::Evaluation;
use crate::jacobian::{Jacobian, JacobianMode};
use crate::networks::FlattenAnything;

/// The 2D→3D→2D cycle: G → Q̂ → P̂ → P̂_cut → Q̂_cycle.
#[derive(Debug, Clone)]
pub struct DeformBranch<B: Backend> {
    /// Q̂ `[M, 2]`.
    pub q_hat: Tensor<B, 2>,
    /// P̂ `[M, 3]`.
    pub p_hat: Tensor<B, 2>,
    /// P̂ⁿ `[M, 3]`.
    pub p_hat_normals: Tensor<B, 2>,
    /// P̂_cut `[M, 3]`.
    pub p_hat_cut: Tensor<B, 2>,
    /// Q̂_cycle `[M, 2]`.
    pub q_hat_cycle: Tensor<B, 2>,
    /// J_g: the derivative of P̂ with respect to Q̂, where it was asked for.
    pub jacobian: Option<Jacobian<B>>,
}

/// The 3D→2D→3D cycle: P → P_cut → Q → P_cycle. Q is the parameterization.
#[derive(Debug, Clone)]
pub struct UnwrapBranch<B: Backend> {
    /// P_cut `[N, 3]`.
    pub p_cut: Tensor<B, 2>,
    /// Q `[N, 2]`.
    pub q: Tensor<B, 2>,
    /// P_cycle `[N, 3]`.
    pub p_cycle: Tensor<B, 2>,
    /// P_cycleⁿ `[N, 3]`.
    pub p_cycle_normals: Tensor<B, 2>,
    /// J_f: the derivative of P_cycle with respect to Q.
    pub jacobian: Jacobian<B>,
}

impl<B: Backend> FlattenAnything<B> {
    /// P → Q `[N, 3] → [N, 2]`; without `cut_net`, P_cut is P.
    pub fn unwrap(
        &self,
        p: Tensor<B, 2>,
        cut_net: bool,
        evaluation: &dyn Evaluation<B>,
    ) -> Tensor<B, 2> {
        let p_cut = self.open(p, cut_net, evaluation);
        self.unwrap.forward(p_cut, evaluation)
    }

    /// [`unwrap`](Self::unwrap), and its derivative applied to tangents `[N, 3]`: each `[N, 2]`.
    pub fn unwrap_with_tangents<const K: usize>(
        &self,
        p: Tensor<B, 2>,
        tangents: [Tensor<B, 2>; K],
        cut_net: bool,
    ) -> (Tensor<B, 2>, [Tensor<B, 2>; K]) {
        let (p_cut, tangents) = match cut_net {
            true => self.cut.forward_with_tangents(p, tangents),
            false => (p, tangents),
        };
        let mlp = &self.unwrap.mlp;
        let (q, slopes) = mlp.forward_with_slopes(p_cut);
        (
            q,
            tangents.map(|tangent| mlp.push_tangent(tangent, &slopes)),
        )
    }

    /// The 2D→3D→2D cycle of a lattice G `[M, 2]`.
    pub fn deform_branch(
        &self,
        g: Tensor<B, 2>,
        jacobian: Option<JacobianMode>,
        cut_net: bool,
        evaluation: &dyn Evaluation<B>,
    ) -> DeformBranch<B> {
        let q_hat = self.deform.forward(g, evaluation);
        let (wrapped, jacobian) = match jacobian {
            Some(mode) => {
                let (wrapped, jacobian) = mode.wrap(&self.wrap, q_hat.clone(), evaluation);
                (wrapped, Some(jacobian))
            }
            None => (self.wrap.forward(q_hat.clone(), evaluation), None),
        };
        let p_hat = wrapped.points.clone();
        let p_hat_cut = self.open(p_hat, cut_net, evaluation);
        let q_hat_cycle = self.unwrap.forward(p_hat_cut.clone(), evaluation);
        DeformBranch {
            q_hat,
            p_hat: wrapped.points,
            p_hat_normals: wrapped.normals,
            p_hat_cut,
            q_hat_cycle,
            jacobian,
        }
    }

    /// The 3D→2D→3D cycle of surface points P `[N, 3]`.
    pub fn unwrap_branch(
        &self,
        p: Tensor<B, 2>,
        jacobian: JacobianMode,
        cut_net: bool,
        evaluation: &dyn Evaluation<B>,
    ) -> UnwrapBranch<B> {
        let p_cut = self.open(p, cut_net, evaluation);
        let q = self.unwrap.forward(p_cut.clone(), evaluation);
        let (wrapped, jacobian) = jacobian.wrap(&self.wrap, q.clone(), evaluation);
        UnwrapBranch {
            p_cut,
            q,
            p_cycle: wrapped.points,
            p_cycle_normals: wrapped.normals,
            jacobian,
        }
    }

    /// The derivatives of Q on N triangles, if it is linear on each, along two orthonormal
    /// directions of its plane: from their first, second and third `corners`, each `[N, 3]`, and
    /// the `gradients` of [`Triangles`](crate::sampling::Triangles), each `[N, 2]`.
    pub fn flattening(
        &self,
        corners: [Tensor<B, 2>; 3],
        gradients: [Tensor<B, 2>; 2],
        cut_net: bool,
        evaluation: &dyn Evaluation<B>,
    ) -> Jacobian<B> {
        let n = corners[0].dims()[0];
        let q = self.unwrap(Tensor::cat(corners.into(), 0), cut_net, evaluation);
        let corner = |k: usize| q.clone().narrow(0, k * n, n);
        let edges = [1, 2].map(|k| corner(k) - corner(0));
        let along = |axis: usize| {
            let [ab, ac] =
                [0, 1].map(|k| edges[k].clone() * gradients[k].clone().narrow(1, axis, 1));
            ab + ac
        };
        Jacobian {
            u: along(0),
            v: along(1),
        }
    }

    /// P_cut.
    fn open(&self, p: Tensor<B, 2>, cut_net: bool, evaluation: &dyn Evaluation<B>) -> Tensor<B, 2> {
        if cut_net {
            self.cut.forward(p, evaluation)
        } else {
            p
        }
    }
}

/// A uniform lattice G of ⌈√count⌉² points in [−1, 1]², first coordinate slowest,
/// row by row; at least 2 × 2.
pub fn lattice(count: usize) -> Vec<[f32; 2]> {
    let side = ((count as f64).sqrt().ceil() as usize).max(2);
    let at = |i: usize| -1.0 + 2.0 * i as f32 / (side - 1) as f32;
    (0..side * side)
        .map(|i| [at(i / side), at(i % side)])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::Plain;
    use crate::networks::FlattenAnythingConfig;
    use crate::sampling::TriangleSource;
    use burn::tensor::TensorData;
    use burn_ndarray::NdArray;
    use fam_surface::{Normalization, Surface, shapes};
    use rand::SeedableRng;
    use rand_pcg::Pcg64;

    fn host<const D: usize>(rows: Tensor<NdArray, 2>) -> Vec<[f32; D]> {
        let values: Vec<f32> = rows.into_data().to_vec().unwrap();
        values.as_chunks().0.to_vec()
    }

    /// Along its edges, the derivative on a triangle is the difference of the UVs at their ends.
    #[test]
    fn the_flattening_is_linear_on_triangles() {
        let device = Default::default();
        let surface = Surface::Mesh(shapes::torus(1.0, 0.4, 12, 8));
        let normalization = Normalization::of(surface.positions()).unwrap();
        let source = TriangleSource::new(&surface, &normalization).unwrap();
        let drawn = source.draw(50, &mut Pcg64::seed_from_u64(1));
        let config = FlattenAnythingConfig::new().with_width(16);
        let model = config.init::<NdArray>(&device, 1);
        let three = |rows: &Vec<[f32; 3]>| {
            Tensor::<NdArray, 2>::from_data(TensorData::new(rows.concat(), [50, 3]), &device)
        };
        let two = |rows: &Vec<[f32; 2]>| {
            Tensor::<NdArray, 2>::from_data(TensorData::new(rows.concat(), [50, 2]), &device)
        };
        let corners = drawn.corners.each_ref().map(three);
        let q = corners
            .clone()
            .map(|corner| host::<2>(model.unwrap(corner, true, &Plain)));
        let gradients = drawn.gradients.each_ref().map(two);
        let jacobian = model.flattening(corners, gradients, true, &Plain);
        let (u, v) = (host::<2>(jacobian.u), host::<2>(jacobian.v));
        for t in 0..50 {
            // One edge is orthogonal to the other's gradient, and its own is 1 along it.
            let [[a, b], [c, d]] = [0, 1].map(|k| drawn.gradients[k][t]);
            let determinant = a * d - b * c;
            let edges = [[d, -c], [-b, a]].map(|edge| edge.map(|x| x / determinant));
            for (k, [x, y]) in edges.into_iter().enumerate() {
                for axis in 0..2 {
                    let expected = q[k + 1][t][axis] - q[0][t][axis];
                    let found = u[t][axis] * x + v[t][axis] * y;
                    assert!((found - expected).abs() < 1e-5, "{found} {expected}");
                }
            }
        }
    }
}
