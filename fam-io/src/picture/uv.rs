//! The picture of a layout.

use fam_surface::TriangleMesh;
use image::RgbImage;

use super::input::Flattened;
use super::raster::{Canvas, SAMPLES, fill_disc, fill_triangle};
use super::scene::Scene;
use super::shading::{blend, normalize, vector_color};

/// Share of the picture left empty on each side of the layout.
const MARGIN: f32 = 0.03;

/// Longest edge, in samples, that the median triangle needs for its edges to be drawn.
const READABLE: f32 = 12.0 * SAMPLES as f32;

/// The UV layout in a square of `side` × `side` pixels, fitted to its bounding box: u to the
/// right, v upwards, coloured by the normal of the surface. The points of a cloud without
/// normals are coloured by where they lie on the surface.
///
/// Sides above 4096 are reduced to that.
pub fn uv_picture(input: Flattened, side: u32) -> RgbImage {
    let side = side.min(4096);
    let mut picture = RgbImage::new(side, side);
    layout(&Scene::new(input), side).draw_onto(&mut picture, 0);
    picture
}

pub(super) fn layout(scene: &Scene, pixels: u32) -> Canvas {
    let mut canvas = Canvas::new(pixels);
    let side = canvas.side as f32;
    let scale = (1.0 - 2.0 * MARGIN) * side;
    let [width, height] = scene.uv_extent();
    let place = |[u, v]: [f32; 2]| {
        [
            0.5 * side + (u - 0.5 * width) * scale,
            0.5 * side - (v - 0.5 * height) * scale,
        ]
    };
    match scene.input {
        Flattened::Mesh(mesh, _) => draw_triangles(scene, mesh, place, &mut canvas),
        Flattened::Cloud(..) => draw_points(scene, place, &mut canvas),
    }
    canvas
}

fn draw_triangles(
    scene: &Scene,
    mesh: &TriangleMesh,
    place: impl Fn([f32; 2]) -> [f32; 2],
    canvas: &mut Canvas,
) {
    let placed = |t: usize| scene.triangle_uvs(t).map(|uvs| uvs.map(&place));
    let mut order: Vec<(f32, usize)> = (0..mesh.triangles().len())
        .filter_map(|t| placed(t).map(|corners| (longest_edge(corners), t)))
        .collect();
    // Triangles that a map smears over the layout stay beneath the others.
    order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let edges = order
        .get(order.len() / 2)
        .is_some_and(|middle| middle.0 >= READABLE);

    for (_, t) in order {
        let Some(corners) = placed(t) else { continue };
        let normals = scene.corner_normals(mesh, t);
        let heights = if edges {
            heights(corners)
        } else {
            [f32::INFINITY; 3]
        };
        fill_triangle(canvas.side, corners, |x, y, weights| {
            let near_edge = (0..3).any(|i| weights[i] * heights[i] < 0.7);
            let ink = if near_edge { 0.5 } else { 1.0 };
            let color = vector_color(normalize(blend(weights, normals)));
            canvas.set(x, y, color.map(|c| c * ink));
        });
    }
}

fn draw_points(scene: &Scene, place: impl Fn([f32; 2]) -> [f32; 2], canvas: &mut Canvas) {
    let spacing = canvas.side as f32 / (scene.points.len() as f32).sqrt();
    let radius = (0.4 * spacing).clamp(0.8 * SAMPLES as f32, 2.5 * SAMPLES as f32);
    for (i, &point) in scene.points.iter().enumerate() {
        if let Some(uv) = scene.point_uv(i) {
            let color = vector_color(scene.point_normal(i).unwrap_or(point));
            fill_disc(canvas.side, place(uv), radius, |x, y, _| {
                canvas.set(x, y, color)
            });
        }
    }
}

fn edge_lengths(corners: [[f32; 2]; 3]) -> [f32; 3] {
    [0, 1, 2].map(|i| {
        let (a, b) = (corners[(i + 1) % 3], corners[(i + 2) % 3]);
        (b[0] - a[0]).hypot(b[1] - a[1])
    })
}

fn longest_edge(corners: [[f32; 2]; 3]) -> f32 {
    edge_lengths(corners).into_iter().fold(0.0, f32::max)
}

/// The distance of each corner from the opposite edge.
fn heights(corners: [[f32; 2]; 3]) -> [f32; 3] {
    let [[ax, ay], [bx, by], [cx, cy]] = corners;
    let area = ((bx - ax) * (cy - ay) - (by - ay) * (cx - ax)).abs();
    edge_lengths(corners).map(|length| area / length)
}
