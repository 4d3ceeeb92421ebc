use burn::tensor::{Tensor, backend::Backend};

use crate::jacobian::{FirstFundamentalForm, Jacobian};

/// ℓ_conf of one map: mean |λ¹ − λ²| of the eigenvalues of JᵀJ, `[1]`.
/// Zero where the map keeps angles.
pub fn conformality_loss<B: Backend>(jacobian: Jacobian<B>) -> Tensor<B, 1> {
    FirstFundamentalForm::of(jacobian).eigenvalue_gap().mean()
}

/// The derivatives of Q on triangles of the surface.
#[derive(Debug, Clone)]
pub struct Flattening<B: Backend> {
    /// Along two orthonormal directions of each, `[N, 2]`.
    pub jacobian: Jacobian<B>,
    /// Whether these directions turn alike on neighbouring triangles, which then are to keep to one
    /// side of the plane.
    pub oriented: bool,
}

/// Added to 2 ‖J‖², and half of it to each part: one that is zero has no root to differentiate.
const SMALLEST: f32 = 1e-10;

/// ℓ_flat: mean |∂Q/∂z̄| / √(|∂Q/∂z|² + |∂Q/∂z̄|²), `[1]`, for the derivatives of Q on triangles, in
/// their conformal and their anticonformal part. It is √((1 − cos θ) / 2), where cos θ = 2 det J / ‖J‖².
/// In 0 … 1: 0 where angles are kept, 1/√2 where a triangle collapses, 1 where it is mirrored, that
/// is: lies other than most. Without orientation the smaller part takes the place of the
/// anticonformal one, and mirrored triangles are as good as others.
///
/// The paper has no such term: it asks conformality of the way back to the surface, whose loss a
/// larger Q lowers as well.
pub fn flattening_loss<B: Backend>(flattening: Flattening<B>) -> Tensor<B, 1> {
    let Jacobian { u, v } = flattening.jacobian;
    // A conformal map turns the one into the other by a right angle.
    let turned = Tensor::cat(vec![v.clone().narrow(1, 1, 1), v.narrow(1, 0, 1).neg()], 1);
    let squared = |part: Tensor<B, 2>| (part.clone() * part).sum_dim(1);
    let conformal = squared(u.clone() + turned.clone());
    let anticonformal = squared(u - turned);
    let both = conformal.clone() + anticonformal.clone();
    let sides = (conformal.clone() - anticonformal.clone()).detach().sign();
    let side = match flattening.oriented {
        true => sides.mean().sign().unsqueeze(),
        false => sides,
    };
    // Twice the part that is not to be.
    let part = anticonformal * (side.clone() + 1.0) + conformal * (side.neg() + 1.0);
    // Not a division nor its power: burn-ndarray takes a reciprocal of 14 bits for parts of a
    // tensor, which parts depending on where it lies in memory.
    let inverse_root = (both + SMALLEST).powf_scalar(-0.5);
    let root = ((part + SMALLEST) * 0.5).sqrt();
    (root * inverse_root).mean()
}

#[cfg(test)]
mod tests {
    use super::*;
    use burn::tensor::TensorData;
    use burn_ndarray::NdArray;

    fn loss(jacobians: &[([f32; 2], [f32; 2])], oriented: bool) -> f32 {
        let device = Default::default();
        let rows = |rows: Vec<[f32; 2]>| {
            let shape = [rows.len(), 2];
            Tensor::<NdArray, 2>::from_data(TensorData::new(rows.concat(), shape), &device)
        };
        let (u, v) = jacobians.iter().copied().unzip();
        let jacobian = Jacobian {
            u: rows(u),
            v: rows(v),
        };
        flattening_loss(Flattening { jacobian, oriented }).into_scalar()
    }

    #[test]
    fn flattening_is_judged_by_its_angles_alone() {
        for oriented in [false, true] {
            // A turn, a mirror image, and a tiny one of it.
            for scale in [1.0, 1e-2] {
                let turn = ([0.6 * scale, 0.8 * scale], [-0.8 * scale, 0.6 * scale]);
                let mirrored = ([0.6 * scale, 0.8 * scale], [0.8 * scale, -0.6 * scale]);
                assert!(loss(&[turn], oriented) < 1e-3);
                assert!(loss(&[mirrored], oriented) < 1e-3);
                // Twice as long in one direction: parts of 3/2 and 1/2.
                let long = ([2.0 * scale, 0.0], [0.0, scale]);
                assert!((loss(&[long], oriented) - 0.1f32.sqrt()).abs() < 1e-4);
            }
            // Onto a line, and onto a point.
            let half = 0.5f32.sqrt();
            assert!((loss(&[([1.0, 1.0], [2.0, 2.0])], oriented) - half).abs() < 1e-5);
            assert!((loss(&[([0.0; 2], [0.0; 2])], oriented) - half).abs() < 1e-5);
        }
    }

    #[test]
    fn the_fewer_are_mirrored_where_triangles_are_oriented() {
        let (one, other) = (([1.0, 0.0], [0.0, 1.0]), ([0.0, 1.0], [1.0, 0.0]));
        for all in [[one, one, other], [other, other, one]] {
            assert!((loss(&all, true) - 1.0 / 3.0).abs() < 1e-3);
            assert!(loss(&all, false) < 1e-3);
        }
        // However large.
        let large = ([0.0, 10.0], [10.0, 0.0]);
        assert!((loss(&[one, large, one], true) - 1.0 / 3.0).abs() < 1e-3);
    }
}
