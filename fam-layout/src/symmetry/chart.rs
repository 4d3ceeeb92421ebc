//! What is asked of a chart: how it lies, how distorted it is, and how to make it symmetric.

use robust::{Coord, orient2d};

use crate::component::FlatChart;
use crate::cut::Cut;
use crate::distortion::Distortion;
use crate::patch::Patch;
use crate::refine::problem::Problem;
use crate::solve::layout::Layout;
use fam_surface::TriangleMesh;
use fam_surface::orientation::{across, turned};

/// Which triangles of a mesh run the other way round than most of its connected part.
pub struct Winding(Vec<bool>);

impl Winding {
    pub fn of(mesh: &TriangleMesh) -> Self {
        let triangles = mesh.triangles();
        Self(turned(triangles, &across(triangles)))
    }

    /// Whether all triangles of a chart are counter-clockwise where most of the mesh are.
    pub fn is_positive(&self, chart: &FlatChart) -> bool {
        self.counts(chart)[1] == 0
    }

    /// The chart, turned over if it is clockwise where most of the mesh is counter-clockwise.
    pub fn righted(&self, mut chart: FlatChart) -> FlatChart {
        let [positive, others] = self.counts(&chart);
        if others > positive {
            for [u, _] in &mut chart.uvs {
                *u = -*u;
            }
        }
        chart
    }

    /// How many triangles are counter-clockwise, and how many are not.
    fn counts(&self, chart: &FlatChart) -> [usize; 2] {
        let is_positive = |(corners, &t): (&[u32; 3], &u32)| {
            let [a, b, c] = corners
                .map(|v| chart.uvs[v as usize])
                .map(|[x, y]| Coord { x, y });
            let area = orient2d(a, b, c);
            if self.0[t as usize] {
                area < 0.0
            } else {
                area > 0.0
            }
        };
        let all = chart.triangles.iter().zip(&chart.source);
        let positive = all.filter(|&pair| is_positive(pair)).count();
        [positive, chart.triangles.len() - positive]
    }
}

/// The vertex of the mesh at every point of a chart.
pub fn vertices(mesh: &TriangleMesh, chart: &FlatChart) -> Vec<u32> {
    let mut vertices = vec![0; chart.uvs.len()];
    for (corners, &t) in chart.triangles.iter().zip(&chart.source) {
        for (&point, &v) in corners.iter().zip(&mesh.triangles()[t as usize]) {
            vertices[point as usize] = v;
        }
    }
    vertices
}

/// A chart's part of the mesh, with a vertex for every point of the chart.
pub fn surface(mesh: &TriangleMesh, chart: &FlatChart) -> Option<TriangleMesh> {
    let at = |&v: &u32| mesh.positions()[v as usize];
    let positions = vertices(mesh, chart).iter().map(at).collect();
    TriangleMesh::new(positions, chart.triangles.clone()).ok()
}

/// The distortion of a chart, if it is valid: without flipped triangles and overlaps.
pub fn judged(mesh: &TriangleMesh, chart: &FlatChart) -> Option<Distortion> {
    let patch = Patch::of(&surface(mesh, chart)?);
    let goes_on = || true;
    let mut problem = Problem::new(&patch, patch.lengths.clone(), &goes_on);
    problem.injective = true;
    let cut = Cut::none(&patch.topology);
    let opened = cut.open(&patch.topology);
    let point = |&v: &u32| chart.uvs[patch.source[v as usize] as usize];
    let place = |v: &u32| point(v).map(|c| c * patch.scale);
    let uv = opened.source.iter().map(place).collect();
    let mut layout = Layout::new(cut, opened, uv);
    let mirrored = Layout {
        uv: layout.uv.iter().map(|&[u, v]| [-u, v]).collect(),
        ..layout.clone()
    };
    if !problem.is_valid(&layout) {
        layout = mirrored;
    }
    if !problem.is_valid(&layout) {
        return None;
    }
    problem.measure(&mut layout);
    Some(layout.distortion())
}

/// A chart made exactly symmetric at the vertical line u = 0, where `images` has the image of every
/// point: the mean of itself and its mirror image. It has to be about symmetric at some line.
pub fn evened(uvs: &[[f64; 2]], images: &[u32]) -> Vec<[f64; 2]> {
    let count = uvs.len().max(1) as f64;
    let sum = uvs
        .iter()
        .fold([0.0; 2], |sum, q| [sum[0] + q[0], sum[1] + q[1]]);
    let from_middle = |q: [f64; 2]| [q[0] - sum[0] / count, q[1] - sum[1] / count];
    let centered: Vec<[f64; 2]> = uvs.iter().map(|&q| from_middle(q)).collect();
    // As complex numbers z, images are e^(iφ) times the conjugates.
    let (mut cos, mut sin) = (0.0, 0.0);
    for (q, &i) in centered.iter().zip(images) {
        let image = centered[i as usize];
        cos += q[0] * image[0] - q[1] * image[1];
        sin += q[0] * image[1] + q[1] * image[0];
    }
    let angle = 0.5 * (sin.atan2(cos) - std::f64::consts::PI);
    let (sin, cos) = angle.sin_cos();
    let upright: Vec<[f64; 2]> = centered
        .iter()
        .map(|[x, y]| [cos * x + sin * y, cos * y - sin * x])
        .collect();
    upright
        .iter()
        .zip(images)
        .map(|(q, &i)| {
            let image = upright[i as usize];
            [0.5 * (q[0] - image[0]), 0.5 * (q[1] + image[1])]
        })
        .collect()
}
