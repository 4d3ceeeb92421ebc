//! Mirror planes of surfaces, and which parts of a mesh mirror which.
//!
//! - [`find`] looks for the plane at which a surface is its own mirror image, and [`judged`] says how
//!   well a plane does;
//! - [`paired`] tells which vertex and triangle of a mesh is the mirror image of which, where they
//!   correspond.

mod find;
mod pairing;
mod samples;
#[cfg(test)]
mod tests;

pub use find::{Judgement, LEAST_SHARE, TOLERANCE, coordinate_plane, find, judged};
pub use pairing::{CLOSE, Match, Pairing, paired};
pub(crate) use samples::Frame;

use crate::vector::{dot, scale, sub};

/// A plane: the points `p` with `normal · p = offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MirrorPlane {
    normal: [f64; 3],
    offset: f64,
}

impl MirrorPlane {
    /// The plane with a normal of any length but 0: the points `p` with `normal · p = offset`. `None`
    /// if there is no such plane in the range of numbers.
    pub fn new(normal: [f64; 3], offset: f64) -> Option<Self> {
        let greatest = normal.iter().fold(0.0_f64, |most, c| most.max(c.abs()));
        let scaled = normal.map(|c| c / greatest);
        let length = dot(scaled, scaled).sqrt();
        let plane = Self {
            normal: scale(scaled, 1.0 / length),
            offset: offset / greatest / length,
        };
        let is_finite = plane.offset.is_finite() && plane.normal.iter().all(|c| c.is_finite());
        is_finite.then_some(plane)
    }

    /// The plane across an axis (0, 1 or 2 for x, y and z) at a coordinate.
    pub fn across(axis: usize, at: f64) -> Self {
        Self {
            normal: [0, 1, 2].map(|k| f64::from(u8::from(k == axis))),
            offset: at,
        }
    }

    /// Its normal, of length 1.
    pub fn normal(&self) -> [f64; 3] {
        self.normal
    }

    /// How far it is from the origin, along its normal.
    pub fn offset(&self) -> f64 {
        self.offset
    }

    /// The axis that it is across, if it is one of the coordinate system.
    pub fn axis(&self) -> Option<usize> {
        (0..3).find(|&k| self.normal[k].abs() == 1.0)
    }

    /// How far a point lies on the side of the normal.
    pub fn height(&self, p: [f64; 3]) -> f64 {
        match self.axis() {
            // Without products, so that mirrored points have heights that are equal to the last bit.
            Some(k) => self.normal[k] * (p[k] - self.normal[k] * self.offset),
            None => dot(self.normal, p) - self.offset,
        }
    }

    /// The mirror image of a point. At a plane across an axis only one coordinate changes, as exactly
    /// as numbers can tell.
    pub fn reflected(&self, p: [f64; 3]) -> [f64; 3] {
        match self.axis() {
            Some(k) => {
                let at = self.normal[k] * self.offset;
                let mut image = p;
                image[k] = match at == 0.0 {
                    true => -p[k],
                    false => at + (at - p[k]),
                };
                image
            }
            None => sub(p, scale(self.normal, 2.0 * self.height(p))),
        }
    }
}
