use burn::tensor::{Tensor, backend::Backend};

/// The 3D term of ℓ_cycle: mean |P − P_cycle| over all coordinates, `[1]`.
pub fn point_cycle_loss<B: Backend>(p: Tensor<B, 2>, p_cycle: Tensor<B, 2>) -> Tensor<B, 1> {
    (p - p_cycle).abs().mean()
}

/// The 2D term of ℓ_cycle: mean |Q̂ − Q̂_cycle| over all coordinates, `[1]`.
pub fn uv_cycle_loss<B: Backend>(q_hat: Tensor<B, 2>, q_hat_cycle: Tensor<B, 2>) -> Tensor<B, 1> {
    (q_hat - q_hat_cycle).abs().mean()
}

/// The normals' term of ℓ_cycle: mean of 1 − cos between Pⁿ and P_cycleⁿ `[N, 3]`, of any
/// lengths, `[1]`. A zero normal counts as orthogonal.
pub fn normal_loss<B: Backend>(normals: Tensor<B, 2>, cycle_normals: Tensor<B, 2>) -> Tensor<B, 1> {
    // A power, not a division: burn-ndarray's gradient of a division goes through a SIMD
    // reciprocal of 14 bits.
    let inverse_length = |n: Tensor<B, 2>| {
        (n.clone() * n)
            .sum_dim(1)
            .clamp_min(1e-16)
            .powf_scalar(-0.5)
    };
    let inverse_lengths = inverse_length(normals.clone()) * inverse_length(cycle_normals.clone());
    let cosine = (normals * cycle_normals).sum_dim(1) * inverse_lengths;
    cosine.neg().mean() + 1.0
}
