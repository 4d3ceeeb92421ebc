use super::layout::Layout;

/// `exp(Σ aᵢ·|ln(bᵢ/aᵢ)|)` with the shares `aᵢ` and `bᵢ` of each triangle in the total
/// 3D and UV area; infinite where a triangle is collapsed.
pub(super) fn area_distortion(layout: &Layout) -> f64 {
    if layout.collapsed_triangles() > 0 {
        return f64::INFINITY;
    }
    let total: f64 = layout.measured().map(|t| layout.double_area(t)).sum();
    let uv_total: f64 = layout
        .measured()
        .map(|t| layout.uv_double_area(t).abs())
        .sum();
    let exponent: f64 = layout
        .measured()
        .map(|t| {
            let share = layout.double_area(t) / total;
            let uv_share = layout.uv_double_area(t).abs() / uv_total;
            share * (uv_share / share).ln().abs()
        })
        .sum();
    exponent.exp()
}
