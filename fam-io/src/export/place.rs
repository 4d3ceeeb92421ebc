//! Where a mesh is.

use fam_surface::vector::{add, cross, dot, normalize, scale};

use crate::scene::IDENTITY;

/// A place of a mesh: an affine transform.
#[derive(Debug, Clone)]
pub(super) struct Place {
    /// The columns of the matrix; `None` where nothing moves.
    columns: Option<[[f64; 3]; 4]>,
}

impl Place {
    /// The coordinates of the mesh itself.
    pub const OWN: Self = Self { columns: None };

    pub fn of(matrix: &[[f64; 4]; 4]) -> Self {
        let columns = matrix.map(|[x, y, z, _]| [x, y, z]);
        Self {
            columns: (*matrix != IDENTITY).then_some(columns),
        }
    }

    /// Where the three axes go; `None` where nothing moves.
    pub fn axes(&self) -> Option<[[f64; 3]; 3]> {
        self.columns.map(|[x, y, z, _]| [x, y, z])
    }

    pub fn position(&self, p: [f64; 3]) -> [f64; 3] {
        let Some([x, y, z, origin]) = self.columns else {
            return p;
        };
        let moved = add(add(scale(x, p[0]), scale(y, p[1])), scale(z, p[2]));
        add(moved, origin)
    }

    /// A normal; of unit length if it is moved, and zero if the matrix leaves none.
    pub fn normal(&self, n: [f32; 3]) -> [f32; 3] {
        let Some([x, y, z, _]) = self.columns else {
            return n;
        };
        // The cofactors are the inverse transpose times the determinant.
        let cofactors = [cross(y, z), cross(z, x), cross(x, y)];
        let sign = if self.mirrors() { -1.0 } else { 1.0 };
        let sum = (0..3).fold([0.0; 3], |sum, at| {
            add(sum, scale(cofactors[at], sign * f64::from(n[at])))
        });
        normalize(sum).map(|c| c as f32)
    }

    /// Whether what is counter-clockwise becomes clockwise.
    pub fn mirrors(&self) -> bool {
        self.columns
            .is_some_and(|[x, y, z, _]| dot(cross(x, y), z) < 0.0)
    }

    /// The corners of a face in their order at this place, from the same first corner on.
    pub fn wind<T>(&self, mut corners: Vec<T>) -> Vec<T> {
        if self.mirrors() {
            corners[1..].reverse();
        }
        corners
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_stay_perpendicular_and_outside() {
        // A mirror in x, twice as long in y, moved.
        let place = Place::of(&[
            [-1.0, 0.0, 0.0, 0.0],
            [0.0, 2.0, 0.0, 0.0],
            [0.0, 0.0, 1.0, 0.0],
            [5.0, 6.0, 7.0, 1.0],
        ]);
        assert_eq!(place.position([1.0, 2.0, 3.0]), [4.0, 10.0, 10.0]);
        let r = 0.5_f32.sqrt();
        // The plane x + y = 0 becomes the plane -x + y/2 = 0.
        let [x, y, z] = place.normal([r, r, 0.0]);
        let length = 1.25_f32.sqrt();
        assert!((x + 1.0 / length).abs() < 1e-6 && (y - 0.5 / length).abs() < 1e-6);
        assert_eq!(z, 0.0);
        assert_eq!(place.wind(vec![0, 1, 2, 3]), [0, 3, 2, 1]);
        assert_eq!(Place::OWN.wind(vec![0, 1, 2]), [0, 1, 2]);
        assert_eq!(Place::OWN.normal([3.0, 0.0, 0.0]), [3.0, 0.0, 0.0]);
    }

    #[test]
    fn a_flat_transform_leaves_one_normal() {
        let mut matrix = IDENTITY;
        matrix[2][2] = 0.0;
        let place = Place::of(&matrix);
        assert_eq!(place.normal([0.0, 0.6, 0.8]), [0.0, 0.0, 1.0]);
        assert_eq!(place.normal([0.0, 1.0, 0.0]), [0.0; 3]);
    }
}
