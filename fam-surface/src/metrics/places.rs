//! The places in the plane at which triangles lie, and how many pairs lie at them.

use crate::UvMap;

use super::layout::signed_double_area;
use super::stacks::{Stacks, place};

/// Numbers of pairs of triangles.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Pairs {
    /// All that overlap, without those that are one triangle twice.
    pub overlapping: u64,
    /// Those of them whose triangles are in different charts of one stack.
    pub stacked: u64,
}

impl Pairs {
    pub(super) fn add(&mut self, more: Self) {
        self.overlapping += more.overlapping;
        self.stacked += more.stacked;
    }
}

/// The triangles that have UV area by the places at which they lie. However many lie at one place, where it
/// overlaps another is found once.
pub(super) struct Places {
    /// Those of one place side by side.
    members: Vec<Member>,
    /// Of every triangle that is the first of its place, where its members begin and end.
    ranges: Vec<[u32; 2]>,
    firsts: Vec<u32>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Member {
    stack: u32,
    chart: u32,
    /// The first triangle that is the same.
    alike: u32,
    triangle: u32,
}

impl Places {
    pub(super) fn new(uv: &UvMap, stacks: &Stacks, first_alike: &[u32]) -> Self {
        let count = uv.triangles().len();
        let mut sorted: Vec<_> = (0..count as u32)
            .filter(|&t| signed_double_area(uv.corners(t as usize)) != 0.0)
            .map(|t| (place(uv.corners(t as usize)), t))
            .collect();
        sorted.sort_unstable();
        let mut places = Self {
            members: Vec::with_capacity(count),
            ranges: vec![[0; 2]; count],
            firsts: Vec::new(),
        };
        for own in sorted.chunk_by(|a, b| a.0 == b.0) {
            let (first, start) = (own[0].1, places.members.len());
            places.members.extend(own.iter().map(|&(_, t)| Member {
                stack: stacks.of(t),
                chart: stacks.of_triangle[t as usize],
                alike: first_alike[t as usize],
                triangle: t,
            }));
            places.members[start..].sort_unstable();
            places.ranges[first as usize] = [start as u32, places.members.len() as u32];
            places.firsts.push(first);
        }
        // A tree over the triangles is the same as if no two lay at one place.
        places.firsts.sort_unstable();
        places
    }

    /// The first triangle of every place, ascending.
    pub(super) fn firsts(&self) -> impl Iterator<Item = u32> + '_ {
        self.firsts.iter().copied()
    }

    /// The pairs of triangles that lie at one place, at all places.
    pub(super) fn within_each(&self) -> Pairs {
        let mut pairs = Pairs::default();
        self.firsts()
            .for_each(|first| pairs.add(self.within(first)));
        pairs
    }

    /// The pairs of triangles at the place of one that is the first there.
    pub(super) fn within(&self, first: u32) -> Pairs {
        let members = self.at(first);
        let of_two = |n: usize| (n as u64) * (n as u64).saturating_sub(1) / 2;
        let within = |is_one: fn(&Member, &Member) -> bool| -> u64 {
            members.chunk_by(is_one).map(|own| of_two(own.len())).sum()
        };
        Pairs {
            // Those that are the same are in one chart.
            overlapping: of_two(members.len()) - within(|a, b| a.alike == b.alike),
            stacked: within(|a, b| a.stack == b.stack) - within(|a, b| a.chart == b.chart),
        }
    }

    /// Two triangles at the place of one that is the first there, which are not the same and not of
    /// stacked charts.
    pub(super) fn overlaid(&self, first: u32) -> Option<[u32; 2]> {
        // Every chart of a stack has as many triangles here as the first.
        let (one, others) = self.at(first).split_first()?;
        let differs = |other: &&Member| {
            let is_alike = one.alike == other.alike;
            one.stack != other.stack || (one.chart == other.chart && !is_alike)
        };
        let other = others.iter().find(differs)?;
        Some([one.triangle, other.triangle])
    }

    /// The stacks that have a triangle at the place of one that is the first there, ascending.
    pub(super) fn stacks(&self, first: u32) -> impl Iterator<Item = u32> + Clone + '_ {
        let of_each = self.at(first).chunk_by(|a, b| a.stack == b.stack);
        of_each.map(|own| own[0].stack)
    }

    /// The pairs of a triangle at each of two places, which overlap, given by their first triangles.
    pub(super) fn between(&self, a: u32, b: u32) -> Pairs {
        let [one, other] = [a, b].map(|first| self.at(first));
        let product = |key: fn(&Member) -> [u32; 2]| -> u64 {
            let mut sum = 0;
            let mut rest = other;
            for own in one.chunk_by(|a, b| key(a) == key(b)) {
                let at = key(&own[0]);
                rest = &rest[rest.partition_point(|m| key(m) < at)..];
                sum += own.len() as u64 * rest.partition_point(|m| key(m) == at) as u64;
            }
            sum
        };
        Pairs {
            overlapping: one.len() as u64 * other.len() as u64,
            stacked: product(|m| [m.stack, 0]) - product(|m| [m.stack, m.chart]),
        }
    }

    fn at(&self, first: u32) -> &[Member] {
        let [start, end] = self.ranges[first as usize];
        &self.members[start as usize..end as usize]
    }
}
