//! Which joins leave every edge of a component with two sides at most.
//!
//! An edge of a component is what lies between two fans. So two sides must not be joined if three
//! sides of an edge would lie between the same two fans then: the surface would come back to one of
//! its own edges.

use std::collections::HashMap;

use super::orientation::{NONE, meeting, next};
use super::sets::Sets;

/// The fans of a surface that is being joined, and how many sides lie between any two of them.
///
/// Only edges of three or more sides count. Fans are merged small into large, so that all joins
/// together take hardly more time than there are sides.
pub(super) struct Crowding<'a> {
    /// Over the first vertices at equal positions.
    triangles: &'a [[u32; 3]],
    corners: Sets,
    /// By the root of a set of corners, the name of its fan.
    names: Vec<u32>,
    /// By the name of a fan, the sides that end there.
    sides: HashMap<u32, Vec<u32>>,
    /// By the names of two fans, the lower first, the number of sides between them.
    counts: HashMap<[u32; 2], usize>,
}

impl<'a> Crowding<'a> {
    /// Of the half-edges that lie at edges of three or more sides, with those `across` joined.
    pub fn of(triangles: &'a [[u32; 3]], branched: &[u32], across: &[u32]) -> Self {
        let corners = 0..across.len() as u32;
        let mut crowding = Self {
            triangles,
            corners: Sets::new(across.len()),
            names: corners.collect(),
            sides: HashMap::new(),
            counts: HashMap::new(),
        };
        for (h, &other) in (0..).zip(across) {
            if other != NONE && h < other {
                for [one, beyond] in meeting(triangles, h, other) {
                    crowding.corners.join(one, beyond);
                }
            }
        }
        for &h in branched {
            let ends = crowding.ends(h);
            for fan in ends {
                crowding.sides.entry(fan).or_default().push(h);
            }
            *crowding.counts.entry(key(ends)).or_default() += 1;
        }
        crowding
    }

    /// Joins two half-edges, unless three sides of an edge would lie between the same two fans then;
    /// whether they are joined.
    pub fn join(&mut self, a: u32, b: u32) -> bool {
        let meeting = meeting(self.triangles, a, b);
        let [start, end] = meeting.map(|corners| corners.map(|c| self.fan(c)));
        let between = |this: &Self, [one, other]: [u32; 2], far: u32| {
            let second = if one == other {
                0
            } else {
                this.count([other, far])
            };
            this.count([one, far]) + second
        };
        let ends_alike = if end[0] == end[1] {
            &end[..1]
        } else {
            &end[..]
        };
        let own: usize = ends_alike
            .iter()
            .map(|&far| between(self, start, far))
            .sum();
        if own > 2 || self.is_crowded(start, end) || self.is_crowded(end, start) {
            return false;
        }
        for [one, other] in meeting {
            self.merge(one, other);
        }
        true
    }

    /// Whether three sides would lie between one fan made of two and another fan, none of `besides`.
    fn is_crowded(&mut self, fans: [u32; 2], besides: [u32; 2]) -> bool {
        let [small, large] = self.by_size(fans);
        if small == large {
            return false;
        }
        let sides = self.sides.remove(&small).unwrap_or_default();
        let is_crowded = sides.iter().any(|&h| {
            let far = self.far(h, small);
            let count = self.count([small, far]) + self.count([large, far]);
            !besides.contains(&far) && count > 2
        });
        if !sides.is_empty() {
            self.sides.insert(small, sides);
        }
        is_crowded
    }

    /// Makes one of the fans of two corners.
    fn merge(&mut self, one: u32, other: u32) {
        let fans = [one, other].map(|c| self.fan(c));
        let [small, large] = self.by_size(fans);
        if small == large {
            return;
        }
        if let Some(sides) = self.sides.remove(&small) {
            for &h in &sides {
                let far = self.far(h, small);
                let count = self.counts.remove(&key([small, far])).unwrap_or(0);
                *self.counts.entry(key([large, far])).or_default() += count;
            }
            self.sides.entry(large).or_default().extend(sides);
        }
        self.corners.join(one, other);
        let root = self.corners.root(one);
        self.names[root as usize] = large;
    }

    /// Two fans, the one at which fewer sides end first.
    fn by_size(&self, [one, other]: [u32; 2]) -> [u32; 2] {
        let size = |fan: u32| self.sides.get(&fan).map_or(0, Vec::len);
        match size(one) <= size(other) {
            true => [one, other],
            false => [other, one],
        }
    }

    fn count(&self, fans: [u32; 2]) -> usize {
        self.counts.get(&key(fans)).copied().unwrap_or(0)
    }

    /// The fan of a corner.
    fn fan(&mut self, corner: u32) -> u32 {
        self.names[self.corners.root(corner) as usize]
    }

    /// The fans at the ends of a half-edge.
    fn ends(&mut self, h: u32) -> [u32; 2] {
        [h, next(h)].map(|corner| self.fan(corner))
    }

    /// The fan at the other end of a half-edge.
    fn far(&mut self, h: u32, fan: u32) -> u32 {
        let [start, end] = self.ends(h);
        if start == fan { end } else { start }
    }
}

fn key([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}
