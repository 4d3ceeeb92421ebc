/// The area that two triangles have in common, and the mean of the corners of the polygon that it is;
/// of the first triangle if rounding leaves nothing of it.
pub(super) fn common([one, other]: [[[f64; 2]; 3]; 2]) -> (f64, [f64; 2]) {
    let mut polygon = one.to_vec();
    let turn = cross(other[0], other[1], other[2]).signum();
    for (start, end) in [(0, 1), (1, 2), (2, 0)] {
        let side = |q: [f64; 2]| turn * cross(other[start], other[end], q);
        let mut clipped = Vec::with_capacity(polygon.len() + 1);
        for (i, &p) in polygon.iter().enumerate() {
            let q = polygon[(i + 1) % polygon.len()];
            let (at_p, at_q) = (side(p), side(q));
            if at_p >= 0.0 {
                clipped.push(p);
            }
            if (at_p < 0.0) != (at_q < 0.0) && at_p != 0.0 && at_q != 0.0 {
                let share = at_p / (at_p - at_q);
                clipped.push([0, 1].map(|k| p[k] + share * (q[k] - p[k])));
            }
        }
        polygon = clipped;
    }
    let area = (2..polygon.len())
        .map(|i| 0.5 * cross(polygon[0], polygon[i - 1], polygon[i]))
        .sum::<f64>()
        .abs();
    let corners = if polygon.is_empty() {
        &one[..]
    } else {
        &polygon
    };
    let mean = |k: usize| corners.iter().map(|q| q[k]).sum::<f64>() / corners.len() as f64;
    (area, [mean(0), mean(1)])
}

/// Twice the signed area of a triangle.
fn cross(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}
