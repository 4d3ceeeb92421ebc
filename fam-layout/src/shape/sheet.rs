//! A flat chart together with the surface that it is of.

use fam_surface::TriangleMesh;

use crate::component::{FlatChart, chart};
use crate::cut::Cut;
use crate::marks::ComponentMarks;
use crate::part::Part;
use crate::patch::Patch;
use crate::patch::topology::{Opened, Topology};
use crate::refine::problem::Problem;
use crate::solve::layout::Layout;

/// What is known of the component that a chart is of.
pub struct Surface<'a> {
    /// In the unit of length that the chart has.
    pub mesh: TriangleMesh,
    /// Where it is to be cut, and where not.
    pub marks: ComponentMarks,
    /// What seams cost at every vertex for each unit of length, if not the same everywhere.
    pub rates: Option<&'a [f64]>,
    /// How much creases count.
    pub crease_weight: f64,
}

/// A flat chart with its piece of surface.
pub struct Sheet {
    part: Part,
    /// The piece of surface, of area 1.
    pub patch: Patch,
    /// Where the vertices of the patch lie, in its unit. All triangles are counter-clockwise.
    pub uv: Vec<[f64; 2]>,
    /// Whether they are clockwise in the chart.
    is_mirrored: bool,
}

impl Sheet {
    /// Of a chart of a component.
    pub fn of(surface: &Surface, chart: &FlatChart) -> Option<Self> {
        let triangles = surface.mesh.triangles();
        let mut vertices = vec![0; chart.uvs.len()];
        for (corners, &t) in chart.triangles.iter().zip(&chart.source) {
            for (&own, &v) in corners.iter().zip(&triangles[t as usize]) {
                vertices[own as usize] = v;
            }
        }
        let at = |&v: &u32| surface.mesh.positions()[v as usize];
        let positions = vertices.iter().map(at).collect();
        let part = Part {
            mesh: TriangleMesh::new(positions, chart.triangles.clone()).ok()?,
            vertices,
            triangles: chart.source.clone(),
            placed: None,
        };
        let patch = surface
            .marks
            .patch(&part, surface.rates, surface.crease_weight);
        let place = |&v: &u32| chart.uvs[v as usize].map(|c| c * patch.scale);
        let mut uv: Vec<[f64; 2]> = patch.source.iter().map(place).collect();
        let is_mirrored = doubled_area(patch.topology.triangles(), &uv) < 0.0;
        if is_mirrored {
            mirror(&mut uv);
        }
        Some(Self {
            part,
            patch,
            uv,
            is_mirrored,
        })
    }

    /// Its chart with the vertices of the patch elsewhere.
    pub fn moved(&self, uv: Vec<[f64; 2]>) -> FlatChart {
        let all: Vec<u32> = (0..self.part.triangles.len() as u32).collect();
        self.chart(&all, &self.patch, uv)
    }

    /// The chart of some of its triangles, as they lie.
    pub fn piece(&self, triangles: &[u32]) -> FlatChart {
        let own = self.patch.subset(triangles);
        let uv = own.source.iter().map(|&v| self.uv[v as usize]).collect();
        self.chart(triangles, &own, uv)
    }

    /// The chart of triangles whose patch has its vertices at `uv`.
    fn chart(&self, triangles: &[u32], own: &Patch, uv: Vec<[f64; 2]>) -> FlatChart {
        let topology: &Topology = &own.topology;
        let opened = Opened {
            topology: topology.clone(),
            source: (0..topology.vertices() as u32).collect(),
        };
        let mut layout = Layout::new(Cut::none(topology), opened, uv);
        Problem::new(own, own.lengths.clone(), &|| true).measure(&mut layout);
        if self.is_mirrored {
            mirror(&mut layout.uv);
        }
        chart(&self.part, &self.patch, triangles, &layout)
    }
}

fn mirror(uv: &mut [[f64; 2]]) {
    for q in uv {
        q[0] = -q[0];
    }
}

fn doubled_area(triangles: &[[u32; 3]], uv: &[[f64; 2]]) -> f64 {
    let of = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| uv[v as usize]);
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    };
    triangles.iter().map(of).sum()
}
