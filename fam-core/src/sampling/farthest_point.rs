use fam_surface::vector::{dot, sub};

/// Farthest-point selection: the indices of `count` points, each as far as possible from those
/// chosen before it; the first point is chosen first. All points if there are no more.
///
/// Time grows as points × `count`.
pub fn farthest_points(points: &[[f64; 3]], count: usize) -> Vec<usize> {
    if points.len() <= count {
        return (0..points.len()).collect();
    }
    let mut squared = vec![f64::INFINITY; points.len()];
    let mut chosen = Vec::with_capacity(count);
    let mut next = 0;
    while chosen.len() < count {
        chosen.push(next);
        let last = points[next];
        let mut farthest = -1.0;
        for (i, (point, distance)) in points.iter().zip(&mut squared).enumerate() {
            let to_last = sub(*point, last);
            *distance = distance.min(dot(to_last, to_last));
            if *distance > farthest {
                (farthest, next) = (*distance, i);
            }
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::farthest_points;

    #[test]
    fn corners_come_before_the_middle() {
        let mut points = vec![[0.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.6, 0.4, 0.0]];
        points.extend([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]]);
        let mut four = farthest_points(&points, 4);
        four.sort_unstable();
        assert_eq!(four, [0, 3, 4, 5]);
        assert_eq!(farthest_points(&points, 9).len(), 6);
    }
}
