//! Pixels covered by triangles and discs, a depth buffer, and a supersampled canvas.
//!
//! Screen coordinates are in pixels, x to the right and y downwards; the centre of the first
//! pixel is (0.5, 0.5). All buffers are square.

use image::{Rgb, RgbImage};

/// Samples per pixel and axis.
pub(super) const SAMPLES: usize = 2;

/// A colour in linear light.
pub(super) type Color = [f32; 3];

/// Fixed-point steps per pixel.
const STEPS: i64 = 256;

/// Visits every pixel whose centre lies in a triangle of either winding, with the barycentric
/// weights of its corners. Of two triangles that share an edge, exactly one gets a pixel on it.
pub(super) fn fill_triangle(
    side: usize,
    corners: [[f32; 2]; 3],
    mut visit: impl FnMut(usize, usize, [f32; 3]),
) {
    // Keeps the products below within 64 bits; false for NaN.
    let in_reach = |c: &f32| c.abs() <= 1e6;
    if !corners.as_flattened().iter().all(in_reach) {
        return;
    }
    let p = corners.map(|p| p.map(|c| (f64::from(c) * STEPS as f64).round() as i64));
    let edge = |a: [i64; 2], b: [i64; 2], at: [i64; 2]| {
        (b[0] - a[0]) * (at[1] - a[1]) - (b[1] - a[1]) * (at[0] - a[0])
    };
    let area = edge(p[0], p[1], p[2]);
    if area == 0 {
        return;
    }
    let sign = area.signum();
    let top = p[0][1].min(p[1][1]).min(p[2][1]);
    let bottom = p[0][1].max(p[1][1]).max(p[2][1]);
    let rows = ceil_div(top - STEPS / 2, STEPS).max(0)
        ..((bottom - STEPS / 2).div_euclid(STEPS) + 1).min(side as i64);
    for y in rows {
        let start = [STEPS / 2, y * STEPS + STEPS / 2];
        let (mut first, mut last) = (0, side as i64 - 1);
        let mut values = [[0; 2]; 3];
        for (i, value) in values.iter_mut().enumerate() {
            let (a, b) = (p[(i + 1) % 3], p[(i + 2) % 3]);
            let at_start = sign * edge(a, b, start);
            let step = -sign * (b[1] - a[1]) * STEPS;
            *value = [at_start, step];
            // A pixel exactly on the edge belongs to the side that sees the edge go this way.
            let (dx, dy) = (sign * (b[0] - a[0]), sign * (b[1] - a[1]));
            let least = i64::from(!(dy > 0 || (dy == 0 && dx < 0)));
            if step > 0 {
                first = first.max(ceil_div(least - at_start, step));
            } else if step < 0 {
                last = last.min((at_start - least).div_euclid(-step));
            } else if at_start < least {
                last = -1;
            }
        }
        let scale = 1.0 / area.abs() as f32;
        for x in first..=last {
            let weights = values.map(|[at_start, step]| (at_start + x * step) as f32 * scale);
            visit(x as usize, y as usize, weights);
        }
    }
}

fn ceil_div(a: i64, b: i64) -> i64 {
    -(-a).div_euclid(b)
}

/// Visits every pixel whose centre lies in a disc, with the squared distance from the disc's
/// centre in radii.
pub(super) fn fill_disc(
    side: usize,
    center: [f32; 2],
    radius: f32,
    mut visit: impl FnMut(usize, usize, f32),
) {
    // Casts from float to integer saturate, so discs outside give empty ranges.
    let range = |c: f32| {
        (c - radius - 0.5).ceil().max(0.0) as usize
            ..((c + radius + 0.5).floor().max(0.0) as usize).min(side)
    };
    for y in range(center[1]) {
        let dy = y as f32 + 0.5 - center[1];
        for x in range(center[0]) {
            let dx = x as f32 + 0.5 - center[0];
            let distance = (dx * dx + dy * dy) / (radius * radius);
            if distance <= 1.0 {
                visit(x, y, distance);
            }
        }
    }
}

/// What a camera sees in one pixel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fragment {
    /// Distance along the view direction, in pixels; infinite where there is nothing.
    pub depth: f32,
    /// The triangle or point that is seen.
    pub item: u32,
    /// Barycentric weights of the triangle's first two corners.
    pub weights: [f32; 2],
}

impl Fragment {
    /// The weights of all three corners.
    pub fn corner_weights(&self) -> [f32; 3] {
        let [a, b] = self.weights;
        [a, b, 1.0 - a - b]
    }
}

/// The nearest fragment of every pixel.
pub(super) struct Visibility {
    pub side: usize,
    fragments: Vec<Fragment>,
}

impl Visibility {
    pub fn new(side: usize) -> Self {
        let nothing = Fragment {
            depth: f32::INFINITY,
            item: 0,
            weights: [0.0; 2],
        };
        Self {
            side,
            fragments: vec![nothing; side * side],
        }
    }

    /// Keeps the fragment if it is nearer than what the pixel holds.
    pub fn offer(&mut self, x: usize, y: usize, fragment: Fragment) {
        let held = &mut self.fragments[y * self.side + x];
        if fragment.depth < held.depth {
            *held = fragment;
        }
    }

    /// The fragment of a pixel, where there is one.
    pub fn at(&self, x: usize, y: usize) -> Option<&Fragment> {
        let fragment = &self.fragments[y * self.side + x];
        fragment.depth.is_finite().then_some(fragment)
    }

    /// Whether a point `[x, y, depth]` is in the picture and at most `bias` behind what is seen.
    pub fn shows(&self, [x, y, depth]: [f32; 3], bias: f32) -> bool {
        let inside = |c: f32| c >= 0.0 && c < self.side as f32;
        inside(x)
            && inside(y)
            && depth <= self.fragments[y as usize * self.side + x as usize].depth + bias
    }
}

/// A white canvas of `SAMPLES` × `SAMPLES` samples per pixel.
pub(super) struct Canvas {
    pub side: usize,
    samples: Vec<Color>,
}

impl Canvas {
    /// A canvas for a picture of `pixels` × `pixels`.
    pub fn new(pixels: u32) -> Self {
        let side = pixels as usize * SAMPLES;
        Self {
            side,
            samples: vec![[1.0; 3]; side * side],
        }
    }

    pub fn set(&mut self, x: usize, y: usize, color: Color) {
        self.samples[y * self.side + x] = color;
    }

    /// Averages the samples and draws the result with its left edge at `left`.
    pub fn draw_onto(&self, picture: &mut RgbImage, left: u32) {
        for y in 0..self.side / SAMPLES {
            for x in 0..self.side / SAMPLES {
                let mut sum = [0.0; 3];
                for row in 0..SAMPLES {
                    let start = (y * SAMPLES + row) * self.side + x * SAMPLES;
                    for sample in &self.samples[start..start + SAMPLES] {
                        sum = [0, 1, 2].map(|c| sum[c] + sample[c]);
                    }
                }
                let pixel = sum.map(|c| encode(c / (SAMPLES * SAMPLES) as f32));
                picture.put_pixel(left + x as u32, y as u32, Rgb(pixel));
            }
        }
    }
}

/// A linear value as a byte of the picture. A gamma of 2 stands in for the sRGB curve.
fn encode(linear: f32) -> u8 {
    (linear.sqrt() * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counts(side: usize, triangles: &[[[f32; 2]; 3]]) -> Vec<u32> {
        let mut counts = vec![0; side * side];
        for &triangle in triangles {
            fill_triangle(side, triangle, |x, y, _| counts[y * side + x] += 1);
        }
        counts
    }

    #[test]
    fn a_triangle_fills_its_area_and_interpolates_its_corners() {
        let corners = [[3.2, 5.1], [90.7, 20.4], [30.3, 88.8]];
        let [[ax, ay], [bx, by], [cx, cy]] = corners;
        let area = 0.5 * ((bx - ax) * (cy - ay) - (by - ay) * (cx - ax));
        for corners in [corners, [corners[0], corners[2], corners[1]]] {
            let mut pixels = 0;
            fill_triangle(100, corners, |x, y, w| {
                pixels += 1;
                let at = |axis: usize| (0..3).map(|i| w[i] * corners[i][axis]).sum::<f32>();
                assert!((at(0) - x as f32 - 0.5).abs() < 0.02);
                assert!((at(1) - y as f32 - 0.5).abs() < 0.02);
            });
            assert!((pixels as f32 / area - 1.0).abs() < 0.01, "{pixels} {area}");
        }
    }

    #[test]
    fn a_fan_covers_every_pixel_of_a_square_once() {
        // The spokes run through pixel centres, along and across the grid.
        let rim = [
            [0.0, 0.0],
            [16.5, 0.0],
            [32.0, 0.0],
            [32.0, 16.5],
            [32.0, 32.0],
            [7.5, 32.0],
            [0.0, 32.0],
            [0.0, 16.5],
        ];
        for flip in [false, true] {
            let fan: Vec<_> = (0..rim.len())
                .map(|i| {
                    let (a, b) = (rim[i], rim[(i + 1) % rim.len()]);
                    let spoke = [16.5, 16.5];
                    if flip && i % 2 == 0 {
                        [spoke, b, a]
                    } else {
                        [a, b, spoke]
                    }
                })
                .collect();
            assert!(counts(32, &fan).iter().all(|&n| n == 1));
        }
    }

    #[test]
    fn a_triangle_larger_than_the_picture_is_clipped_to_it() {
        let large = [[-50.0, -50.0], [100.0, -50.0], [-50.0, 100.0]];
        assert_eq!(counts(8, &[large]), [1; 64]);
    }

    #[test]
    fn unusable_triangles_and_discs_draw_nothing() {
        let triangles = [
            [[1.0, 1.0]; 3],
            [[0.0, 0.0], [4.0, 4.0], [8.0, 8.0]],
            [[f32::NAN, 0.0], [4.0, 0.0], [0.0, 4.0]],
            [[f32::INFINITY, 0.0], [4.0, 0.0], [0.0, 4.0]],
            [[-9.0, -9.0], [-4.0, -9.0], [-9.0, -4.0]],
            [[20.0, 20.0], [24.0, 20.0], [20.0, 24.0]],
        ];
        assert_eq!(counts(8, &triangles).iter().sum::<u32>(), 0);
        for center in [
            [f32::NAN, 1.0],
            [-9.0, 1.0],
            [1.0, 99.0],
            [f32::INFINITY, 1.0],
        ] {
            fill_disc(8, center, 2.0, |x, y, _| panic!("{center:?} drew {x}, {y}"));
        }
        fill_triangle(0, [[0.0, 0.0], [4.0, 0.0], [0.0, 4.0]], |_, _, _| panic!());
    }

    #[test]
    fn a_disc_fills_its_area() {
        let mut pixels = 0;
        fill_disc(64, [30.3, 31.8], 20.0, |_, _, _| pixels += 1);
        assert!((pixels as f32 / (std::f32::consts::PI * 400.0) - 1.0).abs() < 0.01);
    }

    #[test]
    fn the_nearest_fragment_is_kept_whatever_the_order() {
        for order in [[0, 1], [1, 0]] {
            let mut view = Visibility::new(1);
            for item in order {
                let depth = [2.0, 1.0][item as usize];
                let weights = [0.0; 2];
                view.offer(
                    0,
                    0,
                    Fragment {
                        depth,
                        item,
                        weights,
                    },
                );
            }
            assert_eq!(view.at(0, 0).map(|f| f.item), Some(1));
        }
    }
}
