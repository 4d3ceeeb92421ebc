use super::layout::Layout;

/// The sum of all UV triangle areas, over the area of the square on the longer side of
/// their bounding box; 0 where they all lie in one point.
pub(super) fn uv_coverage(layout: &Layout) -> f64 {
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    let mut area = 0.0;
    for t in 0..layout.len() {
        for q in layout.uv_corners(t) {
            for axis in 0..2 {
                low[axis] = low[axis].min(q[axis]);
                high[axis] = high[axis].max(q[axis]);
            }
        }
        area += 0.5 * layout.uv_double_area(t).abs();
    }
    let side = (high[0] - low[0]).max(high[1] - low[1]);
    if side > 0.0 { area / side.powi(2) } else { 0.0 }
}
