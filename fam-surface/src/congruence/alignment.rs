use crate::orientation::NONE;
use crate::vector::{cross, dot, length, normalize, sub};

use super::shape::Shape;

/// Ways to begin that are tried. A mesh of many equal triangles, as a sphere, has many, but there
/// most of them succeed.
const MOST_STARTS: usize = 64;

/// The vertices and triangles of the original for those of a copy.
type Maps = (Vec<u32>, Vec<u32>);

/// All ways to lay the original on the other mesh that were found.
pub(super) fn alignments<'a>(
    original: &'a Shape,
    copy: &'a Shape,
    is_mirrored: bool,
) -> impl Iterator<Item = Maps> + 'a {
    let lengths = original.sides(original.rare);
    let surroundings = original.surroundings[original.rare as usize];
    let reach = original.reach().max(copy.reach());
    let alike = (0..copy.triangles.len() as u32)
        .filter(move |&t| copy.surroundings[t as usize] == surroundings);
    let starts = alike.flat_map(move |t| {
        let sides = copy.sides(t);
        (0..3).filter_map(move |shift| {
            // Which corner of the copy each corner of the original comes to lie on.
            let corner = |k: usize| match is_mirrored {
                false => (k + shift) % 3,
                true => (3 + shift - k) % 3,
            };
            let side = |k: usize| match is_mirrored {
                false => sides[corner(k)],
                // From corner k on backwards.
                true => sides[corner(k + 1)],
            };
            let fits = (0..3).all(|k| (lengths[k] - side(k)).abs() <= reach);
            fits.then(|| (t, [0, 1, 2].map(|k| copy.triangles[t as usize][corner(k)])))
        })
    });
    starts.take(MOST_STARTS).filter_map(move |(t, corners)| {
        let mut walk = Walk {
            original,
            copy,
            is_mirrored,
            reach,
            vertices: vec![NONE; original.positions.len()],
            triangles: vec![NONE; original.triangles.len()],
        };
        walk.run(t, corners)?;
        is_rigid(&walk).then(|| walk.inverse()).flatten()
    })
}

/// A walk over the triangles of the original, and at the same time over those of the copy.
struct Walk<'a> {
    original: &'a Shape<'a>,
    copy: &'a Shape<'a>,
    is_mirrored: bool,
    /// How far lengths may be off.
    reach: f64,
    /// The copy's vertices for those of the original, or [`NONE`]; and the triangles.
    vertices: Vec<u32>,
    triangles: Vec<u32>,
}

impl Walk<'_> {
    /// Begins with the rare triangle of the original on triangle `start` of the copy. None if there
    /// is a contradiction.
    fn run(&mut self, start: u32, corners: [u32; 3]) -> Option<()> {
        let rare = self.original.rare;
        for (&v, w) in self.original.triangles[rare as usize].iter().zip(corners) {
            self.place(v, w)?;
        }
        self.triangles[rare as usize] = start;
        let mut rest = vec![rare];
        while let Some(t) = rest.pop() {
            for h in 3 * t..3 * t + 3 {
                let beyond = self.original.across[h as usize];
                let there = self.copy.across[self.side(h)? as usize];
                if (beyond == NONE) != (there == NONE) {
                    return None;
                }
                if beyond == NONE {
                    continue;
                }
                let (next, other) = (beyond / 3, there / 3);
                match &mut self.triangles[next as usize] {
                    found if *found == NONE => {
                        *found = other;
                        rest.push(next);
                        self.place(apex(self.original, beyond), apex(self.copy, there))?;
                        self.agrees(next)?;
                    }
                    found if *found != other => return None,
                    _ => (),
                }
            }
        }
        Some(())
    }

    /// Lays a vertex on another, if it is not there already.
    fn place(&mut self, vertex: u32, on: u32) -> Option<()> {
        let place = &mut self.vertices[vertex as usize];
        if *place == NONE {
            *place = on;
        }
        (*place == on).then_some(())
    }

    /// The half-edge of the copy on which one of a triangle lies that has been reached.
    fn side(&self, h: u32) -> Option<u32> {
        let t = self.triangles[h as usize / 3];
        let corners = self.original.triangles[h as usize / 3];
        let start = self.vertices[corners[h as usize % 3] as usize];
        let end = self.vertices[corners[(h as usize + 1) % 3] as usize];
        let own = self.copy.triangles[t as usize];
        let first = if self.is_mirrored { end } else { start };
        Some(3 * t + own.iter().position(|&v| v == first)? as u32)
    }

    /// Whether a triangle lies on that of the copy with all corners, the right way round, and has
    /// sides of the same lengths.
    fn agrees(&self, triangle: u32) -> Option<()> {
        let mut corners =
            self.original.triangles[triangle as usize].map(|v| self.vertices[v as usize]);
        let lengths = self.original.sides(triangle);
        let found = [0, 1, 2].map(|k| self.copy.distance(corners[k], corners[(k + 1) % 3]));
        let is_near = |k: usize| (lengths[k] - found[k]).abs() <= self.reach;
        if self.is_mirrored {
            corners.swap(1, 2);
        }
        let own = self.copy.triangles[self.triangles[triangle as usize] as usize];
        let is_turned = (0..3).any(|shift| (0..3).all(|k| corners[k] == own[(k + shift) % 3]));
        (is_turned && (0..3).all(is_near)).then_some(())
    }

    /// The maps the other way round, if everything is there once.
    fn inverse(&self) -> Option<Maps> {
        let inverse = |map: &[u32], count: usize| {
            let mut inverse = vec![NONE; count];
            for (i, &on) in (0..).zip(map) {
                let place = inverse.get_mut(on as usize)?;
                if *place != NONE {
                    return None;
                }
                *place = i;
            }
            (map.len() == count).then_some(inverse)
        };
        let vertices = inverse(&self.vertices, self.copy.positions.len())?;
        Some((
            vertices,
            inverse(&self.triangles, self.copy.triangles.len())?,
        ))
    }
}

/// The vertex of a half-edge's triangle that is not on it.
fn apex(shape: &Shape, h: u32) -> u32 {
    shape.triangles[h as usize / 3][(h as usize + 2) % 3]
}

/// Whether the copy is where a rigid motion takes the original to, with a reflection if it is
/// mirrored: that which lays three vertices far apart on their places.
fn is_rigid(walk: &Walk) -> bool {
    let frame = |shape: &Shape, [a, b, c]: [u32; 3], turn: f64| {
        let [a, b, c] = [a, b, c].map(|v| shape.position(v));
        let first = normalize(sub(b, a));
        let normal = normalize(cross(first, sub(c, a)));
        let second = cross(normal, first);
        (a, [first, second, normal.map(|x| turn * x)])
    };
    let place = |(origin, axes): &([f64; 3], [[f64; 3]; 3]), p: [f64; 3]| {
        axes.map(|axis| dot(axis, sub(p, *origin)))
    };
    if walk.vertices.contains(&NONE) {
        return false;
    }
    let far = walk.original.far;
    let turn = if walk.is_mirrored { -1.0 } else { 1.0 };
    let own = frame(walk.original, far, 1.0);
    let there = frame(walk.copy, far.map(|v| walk.vertices[v as usize]), turn);
    let allowed = walk.original.allowed.max(walk.copy.allowed);
    (0..).zip(&walk.vertices).all(|(v, &w)| {
        let off = sub(
            place(&own, walk.original.position(v)),
            place(&there, walk.copy.position(w)),
        );
        length(off) <= allowed
    })
}
