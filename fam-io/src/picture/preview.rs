//! The overview of a parameterization.

use image::{Rgb, RgbImage};

use super::camera::Camera;
use super::input::{Flattened, Seams};
use super::raster::{Canvas, Color, Fragment, SAMPLES, Visibility, fill_disc};
use super::scene::Scene;
use super::shading::{PALE, SEAM, SURFACE, Seen, blend, checker, light, lit};
use super::uv;

/// White space between two panels, in pixels.
const GAP: u32 = 8;
/// Checker squares along the longer side of the layout.
const SQUARES: f32 = 40.0;

/// Four panels side by side: the surface, its UV layout, a checker texture laid on the surface
/// by the UVs, and the seams. `panel` is the side of each in pixels.
pub fn preview_picture(input: Flattened, seams: Seams, panel: u32) -> RgbImage {
    let scene = Scene::new(input);
    let camera = scene.camera(panel as usize * SAMPLES);
    let view = scene.seen_by(&camera);
    let light: Vec<_> = scene
        .seen_normals(&view, &camera)
        .into_iter()
        .map(|seen| seen.map(brightness))
        .collect();
    let paint = |color: &dyn Fn(&Fragment, f32) -> Color| {
        let mut canvas = Canvas::new(panel);
        for (i, &light) in light.iter().enumerate() {
            let (x, y) = (i % view.side, i / view.side);
            if let (Some(fragment), Some(light)) = (view.at(x, y), light) {
                canvas.set(x, y, color(fragment, light));
            }
        }
        canvas
    };
    let shaded = paint(&|_, light| lit(SURFACE, light));
    let textured = paint(&|fragment, light| {
        lit(
            texture(&scene, fragment).unwrap_or(SURFACE),
            0.25 + 0.75 * light,
        )
    });
    let mut torn = paint(&|_, light| lit(PALE, 0.45 + 0.55 * light));
    draw_seams(&scene, &camera, &view, seams, &mut torn);

    let panels = [shaded, uv::layout(&scene, panel), textured, torn];
    let width = panels.len() as u32 * (panel + GAP) - GAP;
    let mut picture = RgbImage::from_pixel(width, panel, Rgb([255; 3]));
    for (canvas, left) in panels.iter().zip((0..).step_by((panel + GAP) as usize)) {
        canvas.draw_onto(&mut picture, left);
    }
    picture
}

fn brightness(seen: Seen) -> f32 {
    light(seen.normal) * if seen.back { 0.85 } else { 1.0 }
}

fn texture(scene: &Scene, fragment: &Fragment) -> Option<Color> {
    let item = fragment.item as usize;
    let uv = match scene.input {
        Flattened::Mesh(..) => blend(fragment.corner_weights(), scene.triangle_uvs(item)?),
        Flattened::Cloud(..) => scene.point_uv(item)?,
    };
    Some(checker(uv.map(|c| c * SQUARES)))
}

/// Draws torn edges as lines and seam points as dots wherever their middle is not hidden.
fn draw_seams(
    scene: &Scene,
    camera: &Camera,
    view: &Visibility,
    seams: Seams,
    canvas: &mut Canvas,
) {
    let pixel = SAMPLES as f32;
    let (dot, line, bias) = match scene.input {
        Flattened::Mesh(..) => (2.0 * pixel, 1.2 * pixel, 1.5 * pixel),
        Flattened::Cloud(..) => {
            let radius = scene.splat_pixels(camera);
            ((0.4 * radius).max(2.0 * pixel), 1.2 * pixel, 2.0 * radius)
        }
    };
    let mut mark = |at: [f32; 3], radius: f32| {
        if view.shows(at, bias) {
            fill_disc(canvas.side, [at[0], at[1]], radius, |x, y, _| {
                canvas.set(x, y, SEAM)
            });
        }
    };
    let place = |v: u32| scene.points.get(v as usize).map(|&p| camera.project(p));
    for &[a, b] in seams.edges {
        if let (Some(a), Some(b)) = (place(a), place(b)) {
            let steps = (b[0] - a[0])
                .hypot(b[1] - a[1])
                .ceil()
                .min(2.0 * view.side as f32);
            for i in 0..=steps as u32 {
                let s = i as f32 / steps.max(1.0);
                mark([0, 1, 2].map(|c| a[c] + s * (b[c] - a[c])), line);
            }
        }
    }
    for at in seams.points.iter().filter_map(|&v| place(v)) {
        mark(at, dot);
    }
}

#[cfg(test)]
mod tests {
    use fam_surface::{PointCloud, TriangleMesh, UvMap, shapes};

    use super::super::png::encode_png;
    use super::super::uv::uv_picture;
    use super::*;

    /// Two parallel squares that face z, the second one behind the first.
    fn squares() -> (TriangleMesh, UvMap) {
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let square = |z: f64, scale: f64| corners.map(|[x, y]| [x * scale, y * scale, z]);
        // The front one is larger and hides all of the other.
        let front = square(0.0, 4.0).map(|[x, y, z]| [x - 1.5, y - 1.5, z]);
        let positions = [front, square(-0.2, 1.0)].concat();
        let triangles = vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]];
        let uvs = [corners, corners.map(|[u, v]| [u + 2.0, v])].concat();
        let uvs = uvs.iter().map(|uv| uv.map(|c| c as f32)).collect();
        let map = UvMap::new(uvs, triangles.clone()).unwrap();
        (TriangleMesh::new(positions, triangles).unwrap(), map)
    }

    /// Red pixels in the last panel of a small preview.
    fn red_pixels(input: Flattened, points: &[u32], edges: &[[u32; 2]]) -> usize {
        let picture = preview_picture(input, Seams { points, edges }, 128);
        let red = |p: &Rgb<u8>| p[0] > 180 && p[1] < 80 && p[2] < 80;
        let left = picture.width() - 128;
        picture
            .enumerate_pixels()
            .filter(|&(x, _, p)| x >= left && red(p))
            .count()
    }

    #[test]
    fn seams_are_drawn_in_front_of_the_surface_and_hidden_behind_it() {
        let (mesh, map) = squares();
        let red = |points: &[u32], edges: &[[u32; 2]]| {
            red_pixels(Flattened::Mesh(&mesh, &map), points, edges)
        };
        assert_eq!(red(&[], &[]), 0);
        assert_eq!(red(&[4, 5, 6, 7], &[[4, 6], [5, 7]]), 0);
        assert!(red(&[], &[[0, 2]]) > 150);
        assert!((8..20).contains(&red(&[0], &[])));
    }

    #[test]
    fn seam_points_of_a_cloud_are_hidden_behind_it() {
        let grid = shapes::rectangle(2.0, 2.0, 40, 40);
        let mut points = grid.positions().to_vec();
        points.push([0.0, 0.0, -0.5]);
        let (center, behind) = (40 / 2 * 41 + 40 / 2, points.len() as u32 - 1);
        let uvs: Vec<_> = points.iter().map(|p| [p[0] as f32, p[1] as f32]).collect();
        let cloud = PointCloud::new(points, None).unwrap();
        let red = |point: u32| red_pixels(Flattened::Cloud(&cloud, &uvs), &[point], &[]);
        assert_eq!(red(behind), 0);
        assert!(red(center) > 6);
    }

    #[test]
    fn the_camera_faces_a_flat_surface_from_its_front() {
        let flat = shapes::rectangle(2.0, 2.0, 4, 4);
        // Each cyclic shift of the axes keeps the orientation.
        for shift in 0..3 {
            let turned = |p: &[f64; 3]| [0, 1, 2].map(|c| p[(c + shift) % 3]);
            let positions = flat.positions().iter().map(turned).collect();
            let mesh = TriangleMesh::new(positions, flat.triangles().to_vec()).unwrap();
            let map = UvMap::new(vec![[0.0; 2]], vec![]).unwrap();
            let scene = Scene::new(Flattened::Mesh(&mesh, &map));
            let camera = scene.camera(64);
            let normals = scene.seen_normals(&scene.seen_by(&camera), &camera);
            assert!(normals.iter().flatten().count() > 1000);
            assert!(
                normals
                    .iter()
                    .flatten()
                    .all(|n| !n.back && n.normal[2] > 0.6)
            );
        }
    }

    #[test]
    fn the_preview_has_four_panels_with_something_in_each() {
        let (mesh, map) = squares();
        let side = 256;
        let picture = preview_picture(Flattened::Mesh(&mesh, &map), Seams::default(), side);
        assert_eq!(picture.dimensions(), (4 * side + 3 * GAP, side));
        for panel in 0..4 {
            let columns = panel * (side + GAP)..panel * (side + GAP) + side;
            let drawn = picture
                .enumerate_pixels()
                .filter(|&(x, _, p)| columns.contains(&x) && *p != Rgb([255; 3]));
            assert!(drawn.count() > 2_500, "panel {panel}");
        }
    }

    #[test]
    fn the_same_input_gives_the_same_bytes() {
        let (mesh, map) = squares();
        let bytes = || {
            let seams = Seams {
                points: &[1],
                edges: &[[0, 2]],
            };
            let input = Flattened::Mesh(&mesh, &map);
            let pictures = [preview_picture(input, seams, 64), uv_picture(input, 64)];
            pictures.map(|picture| encode_png(&picture).unwrap())
        };
        assert_eq!(bytes(), bytes());
    }

    #[test]
    fn the_layout_is_upright_and_colored_by_the_normal() {
        let mesh = TriangleMesh::new(
            vec![[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            vec![[0, 1, 2]],
        );
        // Right angle at the lower right, far from the unit square.
        let uvs = vec![[1e6, -5e5], [1e6, 0.0], [5e5, -5e5]];
        let map = UvMap::new(uvs, vec![[0, 1, 2]]).unwrap();
        let picture = uv_picture(Flattened::Mesh(&mesh.unwrap(), &map), 100);
        let facing_x = Rgb([255, 128, 128]);
        assert_eq!(*picture.get_pixel(80, 90), facing_x);
        assert_eq!(*picture.get_pixel(10, 20), Rgb([255; 3]));
        assert_eq!(*picture.get_pixel(0, 99), Rgb([255; 3]));
    }

    #[test]
    fn degenerate_input_is_drawn_without_a_panic() {
        let seams = Seams {
            points: &[0, 1, u32::MAX],
            edges: &[[0, 0], [0, 1], [9, u32::MAX]],
        };
        let inputs = [
            vec![[0.0; 3]; 3],
            vec![[0.0; 3], [1.0, 1.0, 1.0], [2.0, 2.0, 2.0]],
            vec![[f64::MAX; 3], [f64::MIN; 3], [f64::MAX, 0.0, 1e-300]],
            vec![[1e-320; 3], [0.0; 3], [0.0, 1e-320, 0.0]],
        ];
        let huge = [[f32::MAX, f32::MIN], [f32::MIN, f32::MAX], [0.0, 1e-45]];
        for positions in inputs {
            let cloud = PointCloud::new(positions.clone(), Some(positions.clone())).unwrap();
            let uvs = [[f32::INFINITY; 2], [0.0, 1.0], [f32::NAN, 0.0]];
            for uvs in [&huge[..], &uvs, &[]] {
                preview_picture(Flattened::Cloud(&cloud, uvs), seams, 16);
            }
            let mesh = TriangleMesh::new(positions, vec![[0, 1, 2]; 2]).unwrap();
            for map in [
                UvMap::new(huge.to_vec(), vec![[0, 1, 2]]),
                UvMap::new(vec![[0.5; 2]; 3], vec![[0, 1, 2]; 3]),
                UvMap::new(vec![], vec![]),
            ] {
                let map = map.unwrap();
                preview_picture(Flattened::Mesh(&mesh, &map), seams, 16);
                for side in [0, 1] {
                    assert_eq!(uv_picture(Flattened::Mesh(&mesh, &map), side).width(), side);
                }
            }
        }
    }
}
