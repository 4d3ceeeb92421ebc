//! The input in the form that is drawn: positions in the unit ball, UVs in the unit square.

use fam_surface::{Normalization, TriangleMesh, vector};

use super::camera::Camera;
use super::cloud;
use super::input::Flattened;
use super::raster::{Fragment, Visibility, fill_disc, fill_triangle};
use super::shading::{Seen, blend, normalize};

/// A corner whose face and vertex normal differ by more than this (as a cosine) is on a crease
/// and is shaded flat.
const CREASE: f64 = 0.82;

pub(super) struct Scene<'a> {
    pub input: Flattened<'a>,
    /// Positions in the unit ball.
    pub points: Vec<[f32; 3]>,
    /// Vertex normals of a mesh, point normals of an oriented cloud.
    normals: Option<Vec<[f64; 3]>>,
    /// Smallest UV coordinates and longest side of the layout's bounding box.
    uv_low: [f64; 2],
    uv_size: f64,
    /// Radius of the discs that make a cloud look closed.
    splat: f32,
}

impl<'a> Scene<'a> {
    pub fn new(input: Flattened<'a>) -> Self {
        let (positions, normals) = match input {
            Flattened::Mesh(mesh, _) => (mesh.positions(), Some(mesh.vertex_normals())),
            Flattened::Cloud(cloud, _) => (
                cloud.points(),
                cloud
                    .normals()
                    .map(|n| n.iter().copied().map(vector::normalize).collect()),
            ),
        };
        let points: Vec<_> = match Normalization::of(positions) {
            Ok(n) => positions.iter().map(|&p| n.apply(p)).collect(),
            Err(_) => vec![[0.0; 3]; positions.len()],
        };
        let (uv_low, uv_size) = uv_bounds(input);
        Self {
            input,
            splat: match input {
                Flattened::Mesh(..) => 0.0,
                Flattened::Cloud(..) => cloud::splat_radius(&points),
            },
            points,
            normals,
            uv_low,
            uv_size,
        }
    }

    /// A UV coordinate in the square from 0 to 1 that the layout spans.
    fn in_square(&self, uv: [f32; 2]) -> [f32; 2] {
        [0, 1].map(|c| ((f64::from(uv[c]) - self.uv_low[c]) / self.uv_size) as f32)
    }

    /// The UVs of a triangle's corners, in the square.
    pub fn triangle_uvs(&self, t: usize) -> Option<[[f32; 2]; 3]> {
        let Flattened::Mesh(_, map) = self.input else {
            return None;
        };
        (t < map.triangles().len()).then(|| map.corners(t).map(|uv| self.in_square(uv)))
    }

    /// The UVs of a cloud's point, in the square.
    pub fn point_uv(&self, i: usize) -> Option<[f32; 2]> {
        let Flattened::Cloud(_, uvs) = self.input else {
            return None;
        };
        uvs.get(i)
            .filter(|uv| is_finite(uv))
            .map(|&uv| self.in_square(uv))
    }

    /// Width and height of the layout in the square.
    pub fn uv_extent(&self) -> [f32; 2] {
        let mut extent = [0.0_f32; 2];
        for_each_uv(self.input, |uv| {
            let q = self.in_square(uv);
            extent = [extent[0].max(q[0]), extent[1].max(q[1])];
        });
        extent
    }

    /// The unit normal of a cloud's point, if the cloud is oriented.
    pub fn point_normal(&self, i: usize) -> Option<[f32; 3]> {
        Some(self.normals.as_ref()?.get(i)?.map(|c| c as f32))
    }

    /// The normals at a triangle's corners: smooth, except across creases.
    pub fn corner_normals(&self, mesh: &TriangleMesh, t: usize) -> [[f32; 3]; 3] {
        let face = vector::normalize(mesh.area_vector(t));
        let smooth = |v: u32| {
            let normal = self.normals.as_ref().map_or(face, |n| n[v as usize]);
            let cosine = vector::dot(face, normal);
            if face == [0.0; 3] || cosine >= CREASE {
                normal
            } else if cosine <= -CREASE {
                vector::scale(normal, -1.0)
            } else {
                face
            }
        };
        mesh.triangles()[t].map(|v| smooth(v).map(|c| c as f32))
    }

    /// Radius of a cloud's discs in a camera's picture.
    pub fn splat_pixels(&self, camera: &Camera) -> f32 {
        (self.splat * camera.scale).clamp(1.0, 0.1 * camera.side as f32)
    }

    pub fn seen_by(&self, camera: &Camera) -> Visibility {
        let mut view = Visibility::new(camera.side);
        match self.input {
            Flattened::Mesh(mesh, _) => {
                let placed: Vec<_> = self.points.iter().map(|&p| camera.project(p)).collect();
                for (t, triangle) in mesh.triangles().iter().enumerate() {
                    let corners = triangle.map(|v| placed[v as usize]);
                    fill_triangle(camera.side, corners.map(|[x, y, _]| [x, y]), |x, y, w| {
                        let [depth] = blend(w, corners.map(|c| [c[2]]));
                        let fragment = Fragment {
                            depth,
                            item: t as u32,
                            weights: [w[0], w[1]],
                        };
                        view.offer(x, y, fragment);
                    });
                }
            }
            Flattened::Cloud(..) => {
                let radius = self.splat_pixels(camera);
                for (i, &point) in self.points.iter().enumerate() {
                    let [px, py, depth] = camera.project(point);
                    fill_disc(camera.side, [px, py], radius, |x, y, distance| {
                        // Bulging discs meet halfway between their centres.
                        let fragment = Fragment {
                            depth: depth + 0.5 * radius * distance,
                            item: i as u32,
                            weights: [0.0; 2],
                        };
                        view.offer(x, y, fragment);
                    });
                }
            }
        }
        view
    }

    /// The view that shows most of the surface, fitted to `side` pixels.
    pub fn camera(&self, side: usize) -> Camera {
        let shown = |camera: &Camera| {
            let view = self.seen_by(camera);
            let normals = self.seen_normals(&view, camera);
            // A pixel shows more surface where it is oblique, but edge-on shows little. The
            // front counts for more than the back.
            let area = |n: &Seen| if n.back { 0.3 } else { 1.0 } / n.normal[2].max(0.7);
            normals.iter().flatten().map(area).sum()
        };
        let camera = Camera::best(96, shown);
        match self.input {
            Flattened::Mesh(mesh, _) => {
                let corners = mesh.triangles().iter().flatten();
                camera.fitted(side, corners.map(|&v| self.points[v as usize]))
            }
            Flattened::Cloud(..) => camera.fitted(side, self.points.iter().copied()),
        }
    }

    /// The normal of every pixel, where something is seen.
    pub fn seen_normals(&self, view: &Visibility, camera: &Camera) -> Vec<Option<Seen>> {
        let pixels = (0..view.side).flat_map(|y| (0..view.side).map(move |x| (x, y)));
        match self.input {
            Flattened::Mesh(mesh, _) => pixels
                .map(|(x, y)| view.at(x, y).map(|f| self.seen_on_mesh(mesh, f, camera)))
                .collect(),
            Flattened::Cloud(..) => {
                let radius = self.splat_pixels(camera);
                pixels
                    .map(|(x, y)| cloud::normal_of_depths(view, x, y, radius))
                    .collect()
            }
        }
    }

    fn seen_on_mesh(&self, mesh: &TriangleMesh, fragment: &Fragment, camera: &Camera) -> Seen {
        let t = fragment.item as usize;
        let [a, b, c] = mesh.triangles()[t].map(|v| camera.project(self.points[v as usize]));
        let back = (b[0] - a[0]) * (c[1] - a[1]) > (b[1] - a[1]) * (c[0] - a[0]);
        let normal = blend(fragment.corner_weights(), self.corner_normals(mesh, t));
        let normal = normalize(camera.turned(normal)).map(|c| if back { -c } else { c });
        Seen { normal, back }
    }
}

fn for_each_uv(input: Flattened, mut visit: impl FnMut([f32; 2])) {
    match input {
        Flattened::Mesh(_, map) => {
            for &i in map.triangles().iter().flatten() {
                visit(map.uvs()[i as usize]);
            }
        }
        Flattened::Cloud(_, uvs) => uvs
            .iter()
            .filter(|uv| is_finite(uv))
            .copied()
            .for_each(visit),
    }
}

fn is_finite(uv: &[f32; 2]) -> bool {
    uv.iter().all(|c| c.is_finite())
}

/// The smallest coordinates and the longest side of the layout's bounding box.
fn uv_bounds(input: Flattened) -> ([f64; 2], f64) {
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for_each_uv(input, |uv| {
        for c in 0..2 {
            low[c] = low[c].min(f64::from(uv[c]));
            high[c] = high[c].max(f64::from(uv[c]));
        }
    });
    let size = (high[0] - low[0]).max(high[1] - low[1]);
    (low, if size > 0.0 { size } else { 1.0 })
}
