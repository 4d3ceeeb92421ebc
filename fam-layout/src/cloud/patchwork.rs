use std::f64::consts::TAU;

use fam_surface::vector::{length, sub};

use super::neighborhood::Neighborhood;
use super::star::Candidate;

/// Longest edge, in spacings of its denser end.
const LONGEST: f64 = 4.5;

/// Angles of sectors that differ by less are equal.
const ROUNDING: f64 = 1e-9;

/// Triangles over the points of a cloud of which no two overlap around a point.
pub(super) struct Patchwork<'a> {
    neighborhood: &'a Neighborhood<'a>,
    triangles: Vec<[u32; 3]>,
    sectors: Vec<Vec<Sector>>,
}

/// What a triangle covers of the tangent plane of one of its corners.
#[derive(Debug, Clone, Copy)]
struct Sector {
    /// The other corners, counter-clockwise.
    ends: [u32; 2],
    /// Angle of the first of them.
    start: f64,
    /// Angle between both.
    width: f64,
}

impl Sector {
    fn overlaps(&self, other: &Self) -> bool {
        let ahead = |from: f64, to: f64| {
            let angle = (to - from).rem_euclid(TAU);
            if angle > TAU - ROUNDING { 0.0 } else { angle }
        };
        ahead(self.start, other.start) < self.width - ROUNDING
            || ahead(other.start, self.start) < other.width - ROUNDING
    }
}

impl<'a> Patchwork<'a> {
    /// Takes of the candidates what fits: those that are in the most stars first, among these
    /// the smallest.
    pub(super) fn stitched(neighborhood: &'a Neighborhood, candidates: &[Candidate]) -> Self {
        let mut all = Self {
            neighborhood,
            triangles: Vec::with_capacity(2 * neighborhood.points.len()),
            sectors: vec![Vec::new(); neighborhood.points.len()],
        };
        let mut order: Vec<&Candidate> = candidates.iter().collect();
        order.sort_by(|a, b| {
            let votes = b.votes.cmp(&a.votes);
            votes.then(a.radius.total_cmp(&b.radius))
        });
        for candidate in order {
            if all.is_short(candidate.corners) {
                all.add_if_fits(candidate.corners);
            }
        }
        all
    }

    /// The triangles so far.
    pub(super) fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// How many points there are.
    pub(super) fn points(&self) -> u32 {
        self.sectors.len() as u32
    }

    /// The length around a triangle.
    pub(super) fn perimeter(&self, [a, b, c]: [u32; 3]) -> f64 {
        let points = self.neighborhood.points;
        [[a, b], [b, c], [c, a]]
            .iter()
            .map(|ends| {
                let [a, b] = ends.map(|v| points[v as usize]);
                length(sub(a, b))
            })
            .sum()
    }

    /// The points at the other ends of the boundary edges of a point.
    pub(super) fn boundary_at(&self, v: u32) -> Vec<u32> {
        let sectors = &self.sectors[v as usize];
        sectors
            .iter()
            .flat_map(|s| s.ends)
            .filter(|&end| self.degree(v, end) == 1)
            .collect()
    }

    /// Along the boundary: from `from` over `v` to the point on the other side of the gap
    /// between triangles that opens beyond the edge of both.
    pub(super) fn across_gap(&self, from: u32, v: u32) -> Option<u32> {
        let sectors = &self.sectors[v as usize];
        let own = sectors.iter().find(|s| s.ends.contains(&from))?;
        let backwards = own.ends[0] == from;
        let gap = |other: &Sector| match backwards {
            true => own.start - (other.start + other.width),
            false => other.start - (own.start + own.width),
        };
        let gap = |other: &Sector| (gap(other) + ROUNDING).rem_euclid(TAU);
        sectors
            .iter()
            .min_by(|a, b| gap(a).total_cmp(&gap(b)))
            .map(|next| next.ends[usize::from(backwards)])
    }

    /// Adds a triangle unless it overlaps others around one of its corners, an edge of its
    /// has two triangles already, or it stands up from the surface.
    pub(super) fn add_if_fits(&mut self, corners: [u32; 3]) -> bool {
        let [a, b, c] = corners;
        let added = [(a, b, c), (b, c, a), (c, a, b)].map(|(v, x, y)| (v, self.sector(v, [x, y])));
        let fits = added.iter().all(|(v, sector)| {
            let free =
                |&end: &u32| !self.neighborhood.is_steep(*v, end) && self.degree(*v, end) < 2;
            sector.width > ROUNDING
                && sector.ends.iter().all(free)
                && !self.sectors[*v as usize].iter().any(|s| s.overlaps(sector))
        });
        if fits {
            self.triangles.push(corners);
            for (v, sector) in added {
                self.sectors[v as usize].push(sector);
            }
        }
        fits
    }

    /// Removes the triangles that were added last; the first `count` stay.
    pub(super) fn truncate(&mut self, count: usize) {
        for corners in self.triangles.drain(count..).rev() {
            for v in corners {
                self.sectors[v as usize].pop();
            }
        }
    }

    fn is_short(&self, [a, b, c]: [u32; 3]) -> bool {
        let Neighborhood {
            points, spacing, ..
        } = self.neighborhood;
        [[a, b], [b, c], [c, a]].iter().all(|ends| {
            let [a, b] = ends.map(|v| v as usize);
            length(sub(points[a], points[b])) <= LONGEST * spacing[a].min(spacing[b])
        })
    }

    /// How many triangles an edge has.
    fn degree(&self, v: u32, end: u32) -> usize {
        let sectors = self.sectors[v as usize].iter();
        sectors.filter(|s| s.ends.contains(&end)).count()
    }

    fn sector(&self, v: u32, ends: [u32; 2]) -> Sector {
        let [a, b] = ends.map(|end| {
            let [x, y, _] = self.neighborhood.local(v, end);
            y.atan2(x)
        });
        let width = (b - a).rem_euclid(TAU);
        match width <= 0.5 * TAU {
            true => Sector {
                ends,
                start: a,
                width,
            },
            false => Sector {
                ends: [ends[1], ends[0]],
                start: b,
                width: TAU - width,
            },
        }
    }
}
