//! The edges between what charts cover and what they do not.

/// An edge of an outline.
#[derive(Debug, Clone, Copy)]
pub struct Edge {
    /// Its ends, as numbers of points.
    pub ends: [u32; 2],
    /// By how much more often triangles cover the plane to its left than to its right.
    pub winding: i32,
}

/// The edges of triangles that are not inside of what the triangles cover.
#[derive(Debug, Clone)]
pub struct Outline {
    /// The ends of the edges.
    pub points: Vec<[f64; 2]>,
    /// Where nothing but a point is to be covered, both ends are that.
    pub edges: Vec<Edge>,
}

impl Outline {
    /// The outline of triangles `[T, 3]` with corners in `points`, and of all other points.
    ///
    /// Every triangle counts as counter-clockwise, so that no part of the plane that several cover
    /// is taken for one that none does. Triangles without area are there with all their edges.
    pub fn new(points: &[[f64; 2]], triangles: &[[u32; 3]]) -> Self {
        let mut half_edges: Vec<([u32; 2], i32)> = Vec::with_capacity(3 * triangles.len());
        let mut lines = Vec::new();
        for &[a, b, c] in triangles {
            let [p, q, r] = [a, b, c].map(|v| points[v as usize]);
            let area = (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
            let sides = [[a, b], [b, c], [c, a]];
            if area == 0.0 {
                lines.extend(sides);
            } else {
                let sign = if area > 0.0 { 1 } else { -1 };
                half_edges.extend(sides.map(|[i, j]| match i < j {
                    true => ([i, j], sign),
                    false => ([j, i], -sign),
                }));
            }
        }
        half_edges.sort_unstable();
        let edges = half_edges.chunk_by(|a, b| a.0 == b.0).map(|same| Edge {
            ends: same[0].0,
            winding: same.iter().map(|(_, sign)| sign).sum(),
        });
        let mut edges: Vec<Edge> = edges.filter(|edge| edge.winding != 0).collect();
        edges.extend(lines.into_iter().map(|ends| Edge { ends, winding: 0 }));
        let mut in_triangle = vec![false; points.len()];
        for &v in triangles.iter().flatten() {
            in_triangle[v as usize] = true;
        }
        let alone = (0..).zip(&in_triangle).filter(|(_, used)| !**used);
        edges.extend(alone.map(|(v, _)| Edge {
            ends: [v; 2],
            winding: 0,
        }));
        Self::compact(points, edges)
    }

    /// The same edges with only the points that they need.
    fn compact(points: &[[f64; 2]], mut edges: Vec<Edge>) -> Self {
        let mut numbers = vec![u32::MAX; points.len()];
        let mut kept = Vec::new();
        for v in edges.iter_mut().flat_map(|edge| &mut edge.ends) {
            let number = &mut numbers[*v as usize];
            if *number == u32::MAX {
                *number = kept.len() as u32;
                kept.push(points[*v as usize]);
            }
            *v = *number;
        }
        Self {
            points: kept,
            edges,
        }
    }

    /// The outline with its points moved.
    pub fn mapped(&self, map: impl Fn([f64; 2]) -> [f64; 2]) -> Self {
        Self {
            points: self.points.iter().map(|&p| map(p)).collect(),
            edges: self.edges.clone(),
        }
    }

    /// The least and the largest coordinates; zeros if there is no point.
    pub fn bounds(&self) -> [[f64; 2]; 2] {
        super::bounds(&self.points)
    }
}
