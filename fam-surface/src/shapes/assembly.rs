//! A machine of many parts.

use super::cubes::{block, sphere};
use super::fields::Point;
use super::round::{cone, open_cylinder, torus};
use super::sheets::rectangle;
use crate::TriangleMesh;
use crate::random::Random;
use crate::vector::{add, cross, normalize, scale};

/// Half the size of the housing that the parts are in.
const HALF: Point = [2.0, 1.2, 1.0];

/// About the side of the rectangles of a flat part.
const PANEL: f64 = 0.35;

/// An assembly as engineers model it: boxes in boxes, plates, tubes inside tubes, inner walls,
/// balls and rings, 40 to 60 parts that share no vertex and cross each other. Some have their
/// inside out. Parts are closed or open surfaces, coherently wound in themselves. About
/// 5 × 3.5 × 3; the seed places the parts and chooses their sizes.
pub fn assembly(seed: u64) -> TriangleMesh {
    let mut parts = Parts {
        random: Random::new(seed),
        positions: Vec::new(),
        triangles: Vec::new(),
    };
    parts.housing();
    parts.walls();
    parts.plates();
    parts.tubes();
    parts.small_parts();
    TriangleMesh::new(parts.positions, parts.triangles).expect("parts are valid meshes")
}

struct Parts {
    random: Random,
    positions: Vec<Point>,
    triangles: Vec<[u32; 3]>,
}

/// Where a part goes: its origin, and the directions of its axes.
struct Frame {
    origin: Point,
    axes: [Point; 3],
}

impl Frame {
    fn upright(origin: Point) -> Self {
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        Self { origin, axes }
    }

    /// With the z axis of the part along a direction.
    fn along(origin: Point, z: Point, beside: Point) -> Self {
        let x = normalize(cross(beside, z));
        let axes = [x, cross(z, x), z];
        Self { origin, axes }
    }

    fn place(&self, p: Point) -> Point {
        let moved = |at, k: usize| add(at, scale(self.axes[k], p[k]));
        (0..3).fold(self.origin, moved)
    }
}

impl Parts {
    fn add(&mut self, part: &TriangleMesh, frame: &Frame, inside_out: bool) {
        let first = self.positions.len() as u32;
        self.positions
            .extend(part.positions().iter().map(|&p| frame.place(p)));
        self.triangles.extend(part.triangles().iter().map(|t| {
            let [a, b, c] = t.map(|v| first + v);
            if inside_out { [a, c, b] } else { [a, b, c] }
        }));
    }

    /// A box of the given half size around the origin of a frame.
    fn add_box(&mut self, half: Point, frame: &Frame, inside_out: bool) {
        let unit = block(half.map(|h| (2.0 * h / PANEL).round() as u32));
        let sized = |p: &Point| [0, 1, 2].map(|k| (2.0 * p[k] - 1.0) * half[k]);
        let positions = unit.positions().iter().map(sized).collect();
        let part = TriangleMesh::new(positions, unit.triangles().to_vec());
        self.add(&part.expect("a box is a valid mesh"), frame, inside_out);
    }

    /// A point in the housing.
    fn somewhere(&mut self) -> Point {
        HALF.map(|h| self.random.between(-0.8 * h, 0.8 * h))
    }

    fn chance(&mut self, share: f64) -> bool {
        self.random.between(0.0, 1.0) < share
    }

    /// A direction, with another that is not along it: mostly those of axes.
    fn directions(&mut self) -> [Point; 2] {
        if self.chance(0.3) {
            let z = self.random.direction();
            let beside = if z[0].abs() < 0.7 {
                [1.0, 0.0, 0.0]
            } else {
                [0.0, 1.0, 0.0]
            };
            return [z, beside];
        }
        let axis = self.random.between(0.0, 3.0) as usize % 3;
        let [mut z, mut beside] = [[0.0; 3]; 2];
        z[axis] = 1.0;
        beside[(axis + 1) % 3] = 1.0;
        [z, beside]
    }

    /// Boxes in boxes around the middle: the walls of the housing have two sides.
    fn housing(&mut self) {
        let frame = Frame::upright([0.0; 3]);
        let wall = self.random.between(0.04, 0.08);
        for (size, inside_out) in [
            (0.0, false),
            (wall, true),
            (5.0 * wall, false),
            (6.0 * wall, true),
        ] {
            self.add_box(HALF.map(|h| h - size), &frame, inside_out);
        }
    }

    /// Sheets across the housing, without thickness, that cut through each other.
    fn walls(&mut self) {
        for i in 0..9 {
            let axis = i % 3;
            let [one, two] = [(axis + 1) % 3, (axis + 2) % 3];
            let [mut z, mut beside] = [[0.0; 3]; 2];
            z[axis] = 1.0;
            beside[one] = 1.0;
            let mut origin = [0.0; 3];
            origin[axis] = self.random.between(-0.8, 0.8) * HALF[axis];
            // The y axis of the sheet lies along `beside`.
            let sides = [two, one].map(|k| 2.0 * HALF[k]);
            let [columns, rows] = sides.map(|side| (side / PANEL).round() as u32);
            let sheet = rectangle(sides[0], sides[1], columns, rows);
            let inside_out = self.chance(0.3);
            self.add(&sheet, &Frame::along(origin, z, beside), inside_out);
        }
    }

    /// Thin boxes in all directions.
    fn plates(&mut self) {
        for _ in 0..8 {
            let half = [
                self.random.between(0.4, 1.2),
                self.random.between(0.3, 0.8),
                self.random.between(0.01, 0.04),
            ];
            let origin = self.somewhere();
            let [z, beside] = self.directions();
            let inside_out = self.chance(0.2);
            self.add_box(half, &Frame::along(origin, z, beside), inside_out);
        }
    }

    /// Open tubes with one or two more inside.
    fn tubes(&mut self) {
        for _ in 0..5 {
            let radius = self.random.between(0.12, 0.35);
            let height = self.random.between(1.5, 3.5);
            let layers = if self.chance(0.5) { 2 } else { 3 };
            let origin = self.somewhere();
            let [z, beside] = self.directions();
            for layer in 0..layers {
                let share = 1.0 - 0.25 * f64::from(layer);
                let tube = open_cylinder(radius * share, height / share, 24, 6);
                let inside_out = layer % 2 == 1;
                self.add(&tube, &Frame::along(origin, z, beside), inside_out);
            }
        }
    }

    /// Balls, rings and funnels.
    fn small_parts(&mut self) {
        for i in 0..16 {
            let size = self.random.between(0.15, 0.4);
            let part = match i % 4 {
                0 => torus(size, 0.3 * size, 24, 10),
                1 => cone(size, 2.0 * size, 20, 4),
                _ => sphere(5),
            };
            let origin = self.somewhere();
            let [z, beside] = self.directions();
            let mut frame = Frame::along(origin, z, beside);
            if i % 4 > 1 {
                frame.axes = frame.axes.map(|axis| scale(axis, size));
            }
            let inside_out = self.chance(0.2);
            self.add(&part, &frame, inside_out);
        }
    }
}
