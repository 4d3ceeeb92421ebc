//! Surfaces of several components: one map each, all in one UV square.
//!
//! [`flatten`] takes a surface apart ([`Components`]), projects what is flat ([`Projection`]),
//! trains a map on every large component and one on all small ones together, and lays all of them
//! side by side at one texel density. Its result holds the [`Atlas`], which gives UVs of any
//! points and is saved and loaded as a whole.

mod checkpoint;
mod file;
mod flatten;
mod groups;
mod layout;
mod projection;

use std::collections::BTreeMap;
use std::sync::Arc;

use burn::tensor::backend::Backend;

pub use checkpoint::{Checkpoint, Checkpointer, Start};
pub use flatten::{Division, Flattened, Part, Progress, flatten};
pub use layout::Placement;
pub use projection::Projection;

use crate::map::{ModelFileError, TrainedMap};
use fam_surface::neighbors::nearest;
use fam_surface::{Components, Normalization, SurfaceError, TriangleMesh, UvMap};

/// How one component is mapped to the plane.
#[derive(Debug, Clone)]
pub enum ComponentMap<B: Backend> {
    /// Flat: projected to its plane.
    Projected(Projection),
    /// Trained; components that were trained together share it.
    Trained(Arc<TrainedMap<B>>),
}

impl<B: Backend> ComponentMap<B> {
    /// UVs of points in input units, before they are placed.
    pub fn uvs(&self, points: &[[f64; 3]]) -> Vec<[f32; 2]> {
        match self {
            Self::Projected(projection) => projection.uvs(points),
            Self::Trained(map) => map.uvs(points),
        }
    }

    /// For each point the derivatives of u and of v, before they are placed, by its coordinates.
    pub fn jacobian(&self, points: &[[f64; 3]]) -> Vec<[[f32; 3]; 2]> {
        match self {
            Self::Projected(projection) => vec![projection.jacobian(); points.len()],
            Self::Trained(map) => map.jacobian(points),
        }
    }
}

/// The maps of all components of a surface.
#[derive(Debug, Clone)]
pub struct Atlas<B: Backend> {
    /// At least one.
    charts: Vec<Chart<B>>,
}

/// The map of a component and where it lies.
#[derive(Debug, Clone)]
struct Chart<B: Backend> {
    map: ComponentMap<B>,
    placement: Placement,
    /// Points of the component in input units; none if it is the only one.
    landmarks: Vec<[f64; 3]>,
}

impl<B: Backend> Chart<B> {
    fn uvs(&self, points: &[[f64; 3]]) -> Vec<[f32; 2]> {
        let uvs = self.map.uvs(points);
        uvs.into_iter().map(|q| self.placement.place(q)).collect()
    }

    fn jacobian(&self, points: &[[f64; 3]]) -> Vec<[[f32; 3]; 2]> {
        let rows = self.map.jacobian(points).into_iter();
        rows.map(|rows| rows.map(|row| row.map(|c| self.placement.scale * c)))
            .collect()
    }
}

impl<B: Backend> Atlas<B> {
    /// The atlas of a single map.
    pub fn of_map(map: TrainedMap<B>) -> Self {
        let chart = Chart {
            map: ComponentMap::Trained(Arc::new(map)),
            placement: Placement::IDENTITY,
            landmarks: Vec::new(),
        };
        Self {
            charts: vec![chart],
        }
    }

    /// The maps that were trained; components that share one have it once.
    pub fn trained_maps(&self) -> Vec<Arc<TrainedMap<B>>> {
        let mut maps: Vec<Arc<TrainedMap<B>>> = Vec::new();
        for chart in &self.charts {
            if let ComponentMap::Trained(map) = &chart.map
                && !maps.iter().any(|known| Arc::ptr_eq(known, map))
            {
                maps.push(map.clone());
            }
        }
        maps
    }

    /// UVs of any points in input units; each by the map of the component nearest to it.
    pub fn uvs(&self, points: &[[f64; 3]]) -> Vec<[f32; 2]> {
        self.of_nearest_charts(points, Chart::uvs)
    }

    /// For any points in input units the derivatives of u and of v by their coordinates, in UV
    /// units per input unit; each by the map of the component nearest to it.
    pub fn jacobian(&self, points: &[[f64; 3]]) -> Vec<[[f32; 3]; 2]> {
        self.of_nearest_charts(points, Chart::jacobian)
    }

    /// What the chart nearest to each point makes of it.
    fn of_nearest_charts<T: Copy + Default>(
        &self,
        points: &[[f64; 3]],
        of: impl Fn(&Chart<B>, &[[f64; 3]]) -> Vec<T>,
    ) -> Vec<T> {
        let mut own: Vec<Vec<usize>> = vec![Vec::new(); self.charts.len()];
        for (i, chart) in self.nearest_charts(points).into_iter().enumerate() {
            own[chart].push(i);
        }
        let mut found = vec![T::default(); points.len()];
        for (chart, own) in self.charts.iter().zip(own) {
            let positions: Vec<_> = own.iter().map(|&i| points[i]).collect();
            for (i, value) in own.into_iter().zip(of(chart, &positions)) {
                found[i] = value;
            }
        }
        found
    }

    /// UVs of a mesh, which need not be the one that was flattened: every component of it by
    /// the map that is nearest to most of its vertices. `labels` are those of
    /// [`Components::of`].
    ///
    /// # Errors
    /// As [`Components::of`], or a UV is not finite.
    pub fn uv_map(&self, mesh: &TriangleMesh, labels: &[u32]) -> Result<UvMap, SurfaceError> {
        let components = Components::of(mesh, labels)?;
        components.uv_map(&components.vertex_maps(&self.component_uvs(&components))?)
    }

    /// UVs of the vertices of a mesh's components, each by the map that is nearest to most of
    /// its vertices.
    pub fn component_uvs(&self, components: &Components) -> Vec<Vec<[f32; 2]>> {
        let meshes = components.list.iter().map(|component| &component.mesh);
        let points: Vec<[f64; 3]> = meshes
            .clone()
            .flat_map(|m| m.positions())
            .copied()
            .collect();
        let mut nearest = self.nearest_charts(&points).into_iter();
        meshes
            .map(|mesh| {
                let points = mesh.positions();
                let mut votes: BTreeMap<usize, usize> = BTreeMap::new();
                for chart in nearest.by_ref().take(points.len()) {
                    *votes.entry(chart).or_default() += 1;
                }
                let most = votes.values().max().copied().unwrap_or(0);
                let winner = votes.iter().find(|(_, votes)| **votes == most);
                self.charts[winner.map_or(0, |(chart, _)| *chart)].uvs(points)
            })
            .collect()
    }

    /// For every point the chart with the nearest landmark.
    fn nearest_charts(&self, points: &[[f64; 3]]) -> Vec<usize> {
        let landmarks: Vec<[f64; 3]> = self
            .charts
            .iter()
            .flat_map(|chart| chart.landmarks.iter().copied())
            .collect();
        let Ok(normalization) = Normalization::of(&landmarks) else {
            return vec![0; points.len()];
        };
        let owners: Vec<usize> = self
            .charts
            .iter()
            .enumerate()
            .flat_map(|(c, chart)| std::iter::repeat_n(c, chart.landmarks.len()))
            .collect();
        let place = |points: &[[f64; 3]]| -> Vec<[f32; 3]> {
            points.iter().map(|&p| normalization.apply(p)).collect()
        };
        nearest(&place(&landmarks), &place(points))
            .into_iter()
            .map(|landmark| owners[landmark as usize])
            .collect()
    }

    /// The bytes of a safetensors file with all maps. The same atlas gives the same bytes.
    ///
    /// # Errors
    /// The container refuses a tensor.
    pub fn to_safetensors(&self) -> Result<Vec<u8>, ModelFileError> {
        file::write(self)
    }

    /// The atlas that [`to_safetensors`](Self::to_safetensors) wrote.
    ///
    /// # Errors
    /// The bytes are no such file, or another version wrote them.
    pub fn from_safetensors(bytes: &[u8], device: &B::Device) -> Result<Self, ModelFileError> {
        file::read(bytes, device)
    }
}
