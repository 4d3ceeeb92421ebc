//! Colours and light.

use super::raster::Color;

/// How a surface faces the viewer.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seen {
    /// The unit normal on the viewer's side, in camera axes.
    pub normal: [f32; 3],
    /// Whether the viewer sees the back of a mesh.
    pub back: bool,
}

/// The surface without a texture.
pub(super) const SURFACE: Color = [0.50, 0.51, 0.53];
/// The surface under its seams.
pub(super) const PALE: Color = [0.74, 0.74, 0.75];
/// Seams.
pub(super) const SEAM: Color = [0.72, 0.01, 0.02];
/// The two kinds of squares of the checker texture.
const CHECKER: [Color; 2] = [[0.86, 0.85, 0.82], [0.055, 0.13, 0.24]];

/// Brightness of a surface with a normal in camera axes: a headlight slightly above and to the
/// left of the viewer, and light from everywhere that is stronger from above.
pub(super) fn light(normal: [f32; 3]) -> f32 {
    const LAMP: [f32; 3] = [-0.32, 0.42, 0.849];
    let lamp: f32 = (0..3).map(|c| normal[c] * LAMP[c]).sum();
    0.28 + 0.1 * normal[1] + 0.8 * lamp.max(0.0)
}

/// A colour under some light.
pub(super) fn lit(color: Color, light: f32) -> Color {
    color.map(|c| (c * light).clamp(0.0, 1.0))
}

/// The checker colour at a position counted in squares.
pub(super) fn checker([u, v]: [f32; 2]) -> Color {
    let square = u.floor() as i64 + v.floor() as i64;
    CHECKER[square.rem_euclid(2) as usize]
}

/// The colour that shows a vector of the unit ball: its coordinates as red, green and blue.
pub(super) fn vector_color(v: [f32; 3]) -> Color {
    v.map(|c| (0.5 * (c + 1.0)).clamp(0.0, 1.0).powi(2))
}

/// A vector at unit length, or zero.
pub(super) fn normalize(v: [f32; 3]) -> [f32; 3] {
    let length = v.iter().map(|c| c * c).sum::<f32>().sqrt();
    v.map(|c| if length > 0.0 { c / length } else { 0.0 })
}

/// The mean of three vectors under barycentric weights.
pub(super) fn blend<const N: usize>(weights: [f32; 3], corners: [[f32; N]; 3]) -> [f32; N] {
    std::array::from_fn(|c| (0..3).map(|i| weights[i] * corners[i][c]).sum())
}
