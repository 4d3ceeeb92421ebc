use rayon::prelude::*;

use super::neighborhood::Neighborhood;

/// Largest radius of a circle through the corners of a triangle, in spacings.
const RADIUS: f64 = 2.0;

/// A triangle, by ascending corners, that is in the star of one of its corners at least.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Candidate {
    pub(super) corners: [u32; 3],
    /// In how many of the stars it is.
    pub(super) votes: u8,
    /// Radius of the circle through its corners.
    pub(super) radius: f64,
}

/// The triangles of all stars, by ascending corners.
pub(super) fn candidates(neighborhood: &Neighborhood) -> Vec<Candidate> {
    let candidate = |(mut corners, radius): ([u32; 3], f64)| {
        corners.sort_unstable();
        Candidate {
            corners,
            votes: 1,
            radius,
        }
    };
    let points = (0..neighborhood.points.len() as u32).into_par_iter();
    let mut all: Vec<Candidate> = points
        .flat_map_iter(|p| star(neighborhood, p).into_iter().map(candidate))
        .collect();
    all.par_sort_by(|a, b| {
        let radius = a.radius.total_cmp(&b.radius);
        a.corners.cmp(&b.corners).then(radius)
    });
    all.dedup_by(|next, kept| {
        let same = next.corners == kept.corners;
        kept.votes += u8::from(same);
        same
    });
    all
}

/// The triangles around a point, each with the radius of the circle through its corners.
fn star(neighborhood: &Neighborhood, p: u32) -> Vec<([u32; 3], f64)> {
    let spacing = neighborhood.spacing[p as usize];
    let mut cell = Cell::new(RADIUS);
    for &q in neighborhood.around(p) {
        let [x, y, z] = neighborhood.local(p, q).map(|c| c / spacing);
        let flat = (x * x + y * y).sqrt();
        if flat > 0.0 && !neighborhood.is_steep(p, q) {
            // As far on the plane as it is in space.
            let unrolled = (1.0 + (z / flat).powi(2)).sqrt();
            cell.clip([x * unrolled, y * unrolled], q);
        }
    }
    cell.corners()
        .filter(|(_, radius)| *radius <= RADIUS)
        .map(|([a, b], radius)| ([p, a, b], radius * spacing))
        .collect()
}

/// The part of the plane that is nearer to the origin than to any of some points.
struct Cell {
    /// Corners, counter-clockwise, each with the point whose bisector follows it.
    corners: Vec<([f64; 2], Option<u32>)>,
}

impl Cell {
    /// A square around the circle of that radius.
    fn new(radius: f64) -> Self {
        let r = 1.001 * radius;
        Self {
            corners: [[-r, -r], [r, -r], [r, r], [-r, r]]
                .map(|corner| (corner, None))
                .to_vec(),
        }
    }

    /// Cuts off what is nearer to a point than to the origin.
    fn clip(&mut self, at: [f64; 2], point: u32) {
        let half = 0.5 * (at[0] * at[0] + at[1] * at[1]);
        let beyond = |c: [f64; 2]| c[0] * at[0] + c[1] * at[1] - half;
        if self.corners.iter().all(|&(c, _)| beyond(c) <= 0.0) {
            return;
        }
        let mut clipped = Vec::with_capacity(self.corners.len() + 1);
        for (i, &(a, along)) in self.corners.iter().enumerate() {
            let (b, _) = self.corners[(i + 1) % self.corners.len()];
            let (da, db) = (beyond(a), beyond(b));
            let crossing = || {
                let t = da / (da - db);
                [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]
            };
            if da <= 0.0 {
                clipped.push((a, along));
                if db > 0.0 {
                    clipped.push((crossing(), Some(point)));
                }
            } else if db <= 0.0 {
                clipped.push((crossing(), along));
            }
        }
        self.corners = clipped;
    }

    /// Pairs of points that follow each other around the origin, and how far from it the
    /// centre of the circle through all three is.
    fn corners(&self) -> impl Iterator<Item = ([u32; 2], f64)> + '_ {
        let before = self
            .corners
            .iter()
            .cycle()
            .skip(self.corners.len().max(1) - 1);
        self.corners
            .iter()
            .zip(before)
            .filter_map(|(&(centre, after), &(_, before))| {
                Some(([before?, after?], centre[0].hypot(centre[1])))
            })
            .filter(|([a, b], _)| a != b)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    /// A triangle is Delaunay if no point is inside the circle through its corners.
    #[test]
    fn cells_have_the_delaunay_triangles_of_the_origin() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(5);
        for _ in 0..50 {
            let points: Vec<[f64; 2]> = (0..20)
                .map(|_| [0, 1].map(|_| rng.random_range(-1.0..1.0)))
                .collect();
            let mut cell = Cell::new(RADIUS);
            for (i, &p) in points.iter().enumerate() {
                cell.clip(p, i as u32);
            }
            let mut found: Vec<[u32; 2]> = cell
                .corners()
                .filter(|(_, radius)| *radius <= RADIUS)
                .map(|([a, b], _)| [a.min(b), a.max(b)])
                .collect();
            found.sort_unstable();
            let mut expected = Vec::new();
            for i in 0..20 {
                for j in i + 1..20 {
                    let ([a, b], [c, d]) = (points[i], points[j]);
                    let double = 2.0 * (a * d - b * c);
                    let (p, q) = (a * a + b * b, c * c + d * d);
                    let centre = [(d * p - b * q) / double, (a * q - c * p) / double];
                    let radius = centre[0].hypot(centre[1]);
                    let inside =
                        |p: &[f64; 2]| (p[0] - centre[0]).hypot(p[1] - centre[1]) < radius - 1e-9;
                    if radius <= RADIUS && !points.iter().any(inside) {
                        expected.push([i as u32, j as u32]);
                    }
                }
            }
            assert_eq!(found, expected);
        }
    }
}
