//! Moving a vertex into a neighbour, and undoing it.

use super::{LEAST_COSINE, LEAST_QUALITY, NONE};
use crate::patch::topology::{Topology, next, previous};
use fam_surface::vector::{cross, dot, length, sub};

/// An edge along which a vertex may be moved into another.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sides {
    pub(super) from: u32,
    pub(super) into: u32,
    /// Its half-edges, in either direction; the second is missing on the boundary.
    half_edges: [u32; 2],
}

/// A vertex that was moved into another. The triangles along the edge between them are gone,
/// but keep their corners and their twins beyond.
#[derive(Debug, Clone, Copy)]
pub(super) struct Collapse {
    pub(super) from: u32,
    pub(super) into: u32,
    half_edges: [u32; 2],
}

/// A triangle along the edge from one vertex to another, and what lies beyond it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wing {
    /// The edge between the third corner and the vertex that is moved, within the triangle and
    /// beyond.
    pub(super) from: (u32, Option<u32>),
    /// The same for the vertex that it is moved into.
    pub(super) into: (u32, Option<u32>),
}

impl Wing {
    fn of(surface: &Topology, from: u32, h: u32) -> Self {
        let (own, other) = match surface.origin(h) == from {
            true => (previous(h), next(h)),
            false => (next(h), previous(h)),
        };
        Self {
            from: (own, surface.twin(own)),
            into: (other, surface.twin(other)),
        }
    }
}

/// The half-edge at the start of which a vertex lies: `h` itself or the one after it.
fn leaving(surface: &Topology, h: u32, v: u32) -> u32 {
    if surface.origin(h) == v { h } else { next(h) }
}

impl Sides {
    /// The edges at the origin of a half-edge.
    pub(super) fn around(surface: &Topology, h: u32) -> Vec<Self> {
        let from = surface.origin(h);
        let fan = surface.fan(h);
        let first = previous(fan[0]);
        let side = |h: u32| Self {
            from,
            into: surface.target(h),
            half_edges: [h, surface.twin(h).unwrap_or(NONE)],
        };
        let mut sides: Vec<Self> = fan.iter().map(|&h| side(h)).collect();
        if surface.twin(first).is_none() {
            sides.push(Self {
                from,
                into: surface.origin(first),
                half_edges: [first, NONE],
            });
        }
        sides
    }

    fn wings(&self, surface: &Topology) -> impl Iterator<Item = Wing> + use<'_> {
        wings(surface, self.from, self.half_edges).into_iter()
    }

    /// A half-edge in one of the triangles that leaves the vertex to be moved.
    fn leaving_from(&self, surface: &Topology) -> u32 {
        leaving(surface, self.half_edges[0], self.from)
    }

    fn leaving_into(&self, surface: &Topology) -> u32 {
        leaving(surface, self.half_edges[0], self.into)
    }

    /// For the vertices of the triangles that are to go, but the one that is moved, half-edges
    /// that will leave them.
    pub(super) fn leaving_after(&self, surface: &Topology) -> Vec<(u32, u32)> {
        let mut found = Vec::with_capacity(4);
        for wing in self.wings(surface) {
            for (own, beyond) in [wing.from, wing.into] {
                if let Some(beyond) = beyond {
                    let ends = [surface.origin(own), surface.target(own)];
                    found.extend(ends.map(|v| {
                        let kept = if v == self.from { self.into } else { v };
                        (kept, leaving(surface, beyond, v))
                    }));
                }
            }
        }
        found
    }

    /// Whether the vertex can be moved: the surface stays a manifold with the same handles and
    /// holes, and no triangle turns over or becomes a sliver.
    pub(super) fn may_collapse(&self, surface: &Topology, positions: &[[f64; 3]]) -> bool {
        let own = Self::around(surface, self.leaving_from(surface));
        let fan = surface.fan(self.leaving_from(surface));
        let on_boundary = own.len() > fan.len();
        let along_boundary = self.half_edges[1] == NONE;
        if on_boundary && (!along_boundary || fan.len() < 2) {
            return false;
        }
        let wings: Vec<Wing> = self.wings(surface).collect();
        if wings.iter().any(|w| w.from.1.is_none()) {
            return false;
        }
        let mut near: Vec<u32> = own.iter().map(|s| s.into).collect();
        near.sort_unstable();
        if near.windows(2).any(|pair| pair[0] == pair[1]) {
            return false;
        }
        let other = Self::around(surface, self.leaving_into(surface));
        let common = other
            .iter()
            .filter(|s| near.binary_search(&s.into).is_ok())
            .count();
        if common != wings.len() {
            return false;
        }
        let is_gone = |h: u32| {
            let t = h / 3;
            self.half_edges.iter().any(|&g| g != NONE && g / 3 == t)
        };
        let kept: Vec<u32> = fan.into_iter().filter(|&h| !is_gone(h)).collect();
        // The last triangle of three is turned onto one that may be there.
        if !on_boundary && kept.len() == 1 {
            let ends = [surface.target(kept[0]), surface.target(next(kept[0]))];
            let beyond = surface.fan(self.leaving_into(surface));
            let is_there = |&h: &u32| {
                let corners = [surface.target(h), surface.target(next(h))];
                !is_gone(h) && ends.iter().all(|v| corners.contains(v))
            };
            if beyond.iter().any(is_there) {
                return false;
            }
        }
        let at = |v: u32| positions[v as usize];
        let (start, end) = (at(self.from), at(self.into));
        !kept.is_empty()
            && kept.iter().all(|&h| {
                let [a, b] = [at(surface.target(h)), at(surface.target(next(h)))];
                stays_upright([start, a, b], [end, a, b])
            })
    }
}

fn wings(surface: &Topology, from: u32, half_edges: [u32; 2]) -> Vec<Wing> {
    half_edges
        .into_iter()
        .filter(|&h| h != NONE)
        .map(|h| Wing::of(surface, from, h))
        .collect()
}

impl Collapse {
    /// Moves a vertex into another.
    pub(super) fn made(surface: &mut Topology, sides: &Sides) -> Self {
        let fan = surface.fan(sides.leaving_from(surface));
        let wings: Vec<Wing> = sides.wings(surface).collect();
        let gone = sides.half_edges.map(|h| h / 3);
        for h in fan.into_iter().filter(|h| !gone.contains(&(h / 3))) {
            surface.set_origin(h, sides.into);
        }
        for wing in wings {
            surface.join(wing.from.1, wing.into.1);
        }
        Self {
            from: sides.from,
            into: sides.into,
            half_edges: sides.half_edges,
        }
    }

    /// Moves it back; what came after must have been undone.
    pub(super) fn undo(&self, surface: &mut Topology) {
        for wing in self.wings(surface) {
            for (own, beyond) in [wing.from, wing.into] {
                surface.join(Some(own), beyond);
            }
        }
        for h in surface.fan(self.leaving_from(surface)) {
            surface.set_origin(h, self.from);
        }
    }

    /// One half-edge in each of the triangles that are gone.
    pub(super) fn half_edges(&self) -> impl Iterator<Item = u32> + use<> {
        self.half_edges.into_iter().filter(|&h| h != NONE)
    }

    /// The triangles that are gone, with what lies beyond.
    pub(super) fn wings(&self, surface: &Topology) -> Vec<Wing> {
        wings(surface, self.from, self.half_edges)
    }

    /// In one of those triangles the half-edge that leaves the vertex that was moved.
    pub(super) fn leaving_from(&self, surface: &Topology) -> u32 {
        leaving(surface, self.half_edges[0], self.from)
    }

    /// The same for the vertex into which it was moved.
    pub(super) fn leaving_into(&self, surface: &Topology) -> u32 {
        leaving(surface, self.half_edges[0], self.into)
    }
}

/// Whether a triangle that changes neither turns over nor becomes a sliver. What has no area
/// may do as it likes.
fn stays_upright(before: [[f64; 3]; 3], after: [[f64; 3]; 3]) -> bool {
    let normal = |[a, b, c]: [[f64; 3]; 3]| cross(sub(b, a), sub(c, a));
    let (old, new) = (normal(before), normal(after));
    let sizes = length(old) * length(new);
    if length(old) == 0.0 {
        return true;
    }
    let worst = quality(before).min(LEAST_QUALITY);
    sizes > 0.0 && dot(old, new) >= LEAST_COSINE * sizes && quality(after) >= worst
}

/// The area over the sum of squared sides, 1 for an equilateral triangle.
fn quality([a, b, c]: [[f64; 3]; 3]) -> f64 {
    let sides = [sub(b, a), sub(c, b), sub(a, c)];
    let squares: f64 = sides.iter().map(|&s| dot(s, s)).sum();
    2.0 * 3.0_f64.sqrt() * length(cross(sides[0], sides[1])) / squares
}
