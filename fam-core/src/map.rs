//! A trained parameterization: UV coordinates for any points, saved and loaded whole.

use std::collections::HashMap;

use burn::module::{AutodiffModule, Module};
use burn::tensor::{FloatDType, Tensor, TensorData, backend::Backend};
use burn_autodiff::Autodiff;
use safetensors::tensor::SafeTensors;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::cycles::lattice;
use crate::evaluation::Plain;
use crate::neighbors::rows;
use crate::networks::FlattenAnything;
use crate::training::{Ablation, TrainingConfig};
use crate::weights::{self, NamedTensor, Naming, WeightsError};
use fam_surface::neighbors::nearest;
use fam_surface::{Normalization, Surface, TriangleMesh};

/// Points evaluated at once: bounds memory to some tens of MB at the paper's widths.
const BATCH: usize = 16_384;

/// Version of the metadata that a model file carries.
const FORMAT_VERSION: u32 = 1;

/// The key of that metadata. It is the only one: the container keeps its keys in no order,
/// and the same model is to give the same bytes.
const METADATA_KEY: &str = "flatten_anything";

/// A trained map from the surface to the plane.
#[derive(Debug, Clone)]
pub struct TrainedMap<B: Backend> {
    model: FlattenAnything<B>,
    config: TrainingConfig,
    /// Points per iteration: fewer than configured on a surface that has no more.
    points: usize,
    normalization: Normalization,
    frame: UvFrame,
    device: B::Device,
}

/// Places the networks' UV coordinates in the unit square: q ↦ (± q − corner) / side.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct UvFrame {
    /// Whether u changes sign first.
    pub mirrored: bool,
    /// Lower left corner of the bounding box.
    pub corner: [f32; 2],
    /// Longer side of the bounding box.
    pub side: f32,
}

/// What a trained map is beside its weights.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Metadata {
    version: u32,
    config: TrainingConfig,
    points: usize,
    normalization: Normalization,
    frame: UvFrame,
}

/// Why a model file could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum ModelFileError {
    /// The weights are missing or broken.
    #[error(transparent)]
    Weights(#[from] WeightsError),
    /// The metadata is missing or broken.
    #[error("it is no model of Flatten Anything: {0}")]
    Metadata(String),
}

/// The bytes of a model file: named tensors of 32-bit floats, and metadata as JSON.
pub(crate) fn model_file(
    tensors: &[NamedTensor],
    metadata: &impl Serialize,
) -> Result<Vec<u8>, ModelFileError> {
    let metadata = serde_json::to_string(metadata)
        .map_err(|error| ModelFileError::Metadata(error.to_string()))?;
    let metadata = HashMap::from([(METADATA_KEY.to_string(), metadata)]);
    Ok(weights::safetensors_with(tensors, Some(metadata))?)
}

/// The metadata of a model file.
pub(crate) fn read_metadata<M: DeserializeOwned>(bytes: &[u8]) -> Result<M, ModelFileError> {
    let (_, header) = SafeTensors::read_metadata(bytes).map_err(WeightsError::from)?;
    let missing = || ModelFileError::Metadata("its metadata is missing".to_string());
    let text = header
        .metadata()
        .as_ref()
        .and_then(|metadata| metadata.get(METADATA_KEY))
        .ok_or_else(missing)?;
    serde_json::from_str(text).map_err(|error| ModelFileError::Metadata(error.to_string()))
}

impl UvFrame {
    /// The networks' own coordinates.
    const IDENTITY: Self = Self {
        mirrored: false,
        corner: [0.0; 2],
        side: 1.0,
    };

    /// The frame that puts `q` into the unit square, touching two sides at the corner (0, 0).
    fn around(q: &[[f32; 2]], mirrored: bool) -> Self {
        let sign = if mirrored { -1.0 } else { 1.0 };
        let mut low = [f32::INFINITY; 2];
        let mut high = [f32::NEG_INFINITY; 2];
        for [u, v] in q {
            for (axis, c) in [u * sign, *v].into_iter().enumerate() {
                low[axis] = low[axis].min(c);
                high[axis] = high[axis].max(c);
            }
        }
        let side = (high[0] - low[0]).max(high[1] - low[1]);
        if !side.is_finite() || side <= 0.0 {
            return Self::IDENTITY;
        }
        Self {
            mirrored,
            corner: low,
            side,
        }
    }

    fn place(&self, [u, v]: [f32; 2]) -> [f32; 2] {
        let u = if self.mirrored { -u } else { u };
        [
            (u - self.corner[0]) / self.side,
            (v - self.corner[1]) / self.side,
        ]
    }
}

/// Surface area whose image in the plane is turned over, less the area whose image is not.
fn mirrored_area(mesh: &TriangleMesh, q: &[[f32; 2]]) -> f64 {
    let signed = |(triangle, area): (&[u32; 3], f64)| {
        let [a, b, c] = triangle.map(|v| q[v as usize].map(f64::from));
        let cross = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if cross < 0.0 { area } else { -area }
    };
    mesh.triangles()
        .iter()
        .zip(mesh.triangle_areas())
        .map(signed)
        .sum()
}

impl<B: Backend> TrainedMap<B> {
    pub(crate) fn new(
        model: FlattenAnything<B>,
        config: TrainingConfig,
        points: usize,
        normalization: Normalization,
        device: &B::Device,
    ) -> Self {
        Self {
            model,
            config,
            points,
            normalization,
            frame: UvFrame::IDENTITY,
            device: device.clone(),
        }
    }

    /// The map of weights that the authors' program trained: those of
    /// [`FlattenAnything::from_reference`]. With the surface that they were trained on, points are in
    /// its units, and its UVs fill the unit square; without, points are those of the unit ball, and UVs
    /// those of the networks.
    ///
    /// # Errors
    /// The weights are missing or broken, or the surface has no extent.
    pub fn from_reference(
        bytes: &[u8],
        surface: Option<&Surface>,
        device: &B::Device,
    ) -> Result<Self, ModelFileError> {
        let model = FlattenAnything::from_reference(bytes, device)?;
        let config = TrainingConfig {
            networks: model.config(),
            ..TrainingConfig::paper()
        };
        let normalization = match surface {
            Some(surface) => surface
                .normalization()
                .map_err(|error| ModelFileError::Metadata(error.to_string()))?,
            None => Normalization {
                center: [0.0; 3],
                radius: 1.0,
            },
        };
        let points = config.points;
        let mut map = Self::new(model, config, points, normalization, device);
        if let Some(surface) = surface {
            map.fit_unit_square(surface);
        }
        Ok(map)
    }

    /// Sets the frame so that the UVs of a surface fill the unit square and, for a mesh, most of
    /// its area is not mirrored.
    pub(crate) fn fit_unit_square(&mut self, surface: &Surface) {
        let q = self.unplaced(surface.positions());
        self.frame = match surface {
            Surface::PointCloud(_) => UvFrame::around(&q, false),
            Surface::Mesh(mesh) => {
                let used = mesh.used_vertices();
                let used: Vec<_> = used.iter().map(|&v| q[v as usize]).collect();
                UvFrame::around(&used, mirrored_area(mesh, &q) > 0.0)
            }
        };
    }

    /// UV coordinates of points in input units, row by row.
    ///
    /// The training surface's vertices lie in the unit square; other points may lie outside.
    pub fn uvs(&self, points: &[[f64; 3]]) -> Vec<[f32; 2]> {
        let q = self.unplaced(points);
        q.into_iter().map(|q| self.frame.place(q)).collect()
    }

    /// For each point the derivatives of u and of v by its three coordinates, in UV units per input
    /// unit. They are zero without the 3D→2D→3D branch, whose place a nearest neighbour takes.
    pub fn jacobian(&self, points: &[[f64; 3]]) -> Vec<[[f32; 3]; 2]> {
        if self.config.without == Ablation::UnwrapBranch {
            return vec![[[0.0; 3]; 2]; points.len()];
        }
        let sign = if self.frame.mirrored { -1.0 } else { 1.0 };
        let unit = (1.0 / (self.normalization.radius * f64::from(self.frame.side))) as f32;
        let model = FlattenAnything::<Autodiff<B>>::from_inner(self.model.clone()).no_grad();
        let with_cut = self.config.without != Ablation::CutNet;
        points
            .chunks(BATCH / 2)
            .flat_map(|chunk| {
                let (p, n) = (self.normalized(chunk), chunk.len());
                // One backward pass gives both rows: each comes from a copy of the points.
                let copies = Tensor::cat(vec![p.clone(), p], 0);
                let copies = Tensor::<Autodiff<B>, 2>::from_inner(copies).require_grad();
                let q = model.unwrap(copies.clone(), with_cut, &Plain);
                let u = q.clone().slice([0..n, 0..1]).sum();
                let v = q.slice([n..2 * n, 1..2]).sum();
                let gradients = (u + v).backward();
                let both = copies.grad(&gradients);
                let both = rows::<B, 3>(both.expect("the UVs depend on every copy of the points"));
                (0..n)
                    .map(|i| {
                        let scaled = |row: [f32; 3], factor: f32| row.map(|c| factor * unit * c);
                        [scaled(both[i], sign), scaled(both[n + i], 1.0)]
                    })
                    .collect::<Vec<_>>()
            })
            .collect()
    }

    /// The UVs `[N, 2]` of points `[N, 3]` in input units, in the caller's graph: differentiable by the
    /// points, and by the weights where `B` tracks them, as `Autodiff` does for a map that was loaded on
    /// it. None without the 3D→2D→3D branch, whose place a nearest neighbour takes.
    ///
    /// Beside trainers on other threads, whoever differentiates holds the
    /// [turn](crate::training::turn). The points are normalised in the precision of `B`, so far from the origin they lose some of it.
    pub fn uv_tensor(&self, points: Tensor<B, 2>) -> Option<Tensor<B, 2>> {
        let with_cut = self.with_cut()?;
        let q = self
            .model
            .unwrap(self.normalized_tensor(points), with_cut, &Plain);
        Some(self.placed(q))
    }

    /// [`uv_tensor`](Self::uv_tensor), and the derivatives of the UVs by each of the three coordinates,
    /// `[N, 2]`, in UV units per input unit. All are in the caller's graph, so that a loss of the
    /// derivatives can be differentiated.
    pub fn uv_tensor_with_jacobian(
        &self,
        points: Tensor<B, 2>,
    ) -> Option<(Tensor<B, 2>, [Tensor<B, 2>; 3])> {
        let with_cut = self.with_cut()?;
        let [n, _] = points.dims();
        let unit = (1.0 / self.normalization.radius) as f32;
        let tangent = |axis: usize| {
            let mut row = [0.0_f32; 3];
            row[axis] = unit;
            let row = Tensor::<B, 2>::from_data([row], &self.device);
            row.cast(FloatDType::from(points.dtype())).repeat_dim(0, n)
        };
        let tangents = [0, 1, 2].map(tangent);
        let p = self.normalized_tensor(points);
        let (q, tangents) = self.model.unwrap_with_tangents(p, tangents, with_cut);
        let (sign, scale) = (self.sign(), 1.0 / self.frame.side);
        let placed = |tangent: Tensor<B, 2>| {
            let [u, v] = [0, 1].map(|axis| tangent.clone().narrow(1, axis, 1));
            Tensor::cat(vec![u * (sign * scale), v * scale], 1)
        };
        Some((self.placed(q), tangents.map(placed)))
    }

    /// Whether Cut-Net takes part; none if a nearest neighbour gives the UVs.
    fn with_cut(&self) -> Option<bool> {
        match self.config.without {
            Ablation::UnwrapBranch => None,
            without => Some(without != Ablation::CutNet),
        }
    }

    fn normalized_tensor(&self, points: Tensor<B, 2>) -> Tensor<B, 2> {
        let center = self.normalization.center.map(|c| c as f32);
        let center = Tensor::<B, 2>::from_data([center], &self.device);
        let center = center.cast(FloatDType::from(points.dtype()));
        (points - center) * (1.0 / self.normalization.radius)
    }

    /// Q in the unit square.
    fn placed(&self, q: Tensor<B, 2>) -> Tensor<B, 2> {
        let UvFrame { corner, side, .. } = self.frame;
        let [u, v] = [0, 1].map(|axis| q.clone().narrow(1, axis, 1));
        Tensor::cat(vec![u * self.sign() - corner[0], v - corner[1]], 1) * (1.0 / side)
    }

    fn sign(&self) -> f32 {
        if self.frame.mirrored { -1.0 } else { 1.0 }
    }

    /// How the map was trained.
    pub fn config(&self) -> &TrainingConfig {
        &self.config
    }

    /// The trained networks.
    pub fn model(&self) -> &FlattenAnything<B> {
        &self.model
    }

    /// How the networks' UV coordinates are placed in the unit square.
    pub fn frame(&self) -> UvFrame {
        self.frame
    }

    /// How input units relate to the networks' unit ball.
    pub fn normalization(&self) -> &Normalization {
        &self.normalization
    }

    /// Q of points in input units, in the networks' own frame.
    fn unplaced(&self, points: &[[f64; 3]]) -> Vec<[f32; 2]> {
        match self.config.without {
            Ablation::UnwrapBranch => self.nearest_q_hat(points),
            without => points
                .chunks(BATCH)
                .flat_map(|chunk| {
                    let p = self.normalized(chunk);
                    rows::<B, 2>(self.model.unwrap(p, without != Ablation::CutNet, &Plain))
                })
                .collect(),
        }
    }

    /// For each point the Q̂ of the nearest P̂: all there is without the 3D→2D→3D branch.
    fn nearest_q_hat(&self, points: &[[f64; 3]]) -> Vec<[f32; 2]> {
        let grid = lattice(self.points);
        let shape = [grid.len(), 2];
        let grid = TensorData::new(grid.into_flattened(), shape);
        let q_hat = self
            .model
            .deform
            .forward(Tensor::from_data(grid, &self.device), &Plain);
        let p_hat = rows::<B, 3>(self.model.wrap.forward(q_hat.clone(), &Plain).points);
        let q_hat = rows::<B, 2>(q_hat);
        let queries: Vec<_> = points
            .iter()
            .map(|&p| self.normalization.apply(p))
            .collect();
        nearest(&p_hat, &queries)
            .into_iter()
            .map(|j| q_hat[j as usize])
            .collect()
    }

    fn normalized(&self, points: &[[f64; 3]]) -> Tensor<B, 2> {
        let values: Vec<f32> = points
            .iter()
            .flat_map(|&p| self.normalization.apply(p))
            .collect();
        Tensor::from_data(TensorData::new(values, [points.len(), 3]), &self.device)
    }

    /// The bytes of a safetensors file with the weights, and as its metadata the
    /// configuration, the normalisation and the frame. The same map gives the same bytes.
    ///
    /// # Errors
    /// The container refuses a tensor.
    pub fn to_safetensors(&self) -> Result<Vec<u8>, ModelFileError> {
        model_file(&weights::tensors(&self.model, ""), &self.metadata())
    }

    /// All but the weights.
    pub(crate) fn metadata(&self) -> Metadata {
        Metadata {
            version: FORMAT_VERSION,
            config: self.config.clone(),
            points: self.points,
            normalization: self.normalization,
            frame: self.frame,
        }
    }

    /// The map that [`to_safetensors`](Self::to_safetensors) wrote.
    ///
    /// # Errors
    /// The bytes are no such file, or a newer version wrote them.
    pub fn from_safetensors(bytes: &[u8], device: &B::Device) -> Result<Self, ModelFileError> {
        let metadata = read_metadata(bytes)?;
        let file = SafeTensors::deserialize(bytes).map_err(WeightsError::from)?;
        Self::from_file(&file, "", metadata, device)
    }

    /// The map of the weights whose names start with `prefix`.
    pub(crate) fn from_file(
        file: &SafeTensors<'_>,
        prefix: &str,
        metadata: Metadata,
        device: &B::Device,
    ) -> Result<Self, ModelFileError> {
        let networks = metadata.config.networks.clone();
        metadata.check()?;
        let model = weights::read(file, &networks, Naming::Own { prefix }, device)?;
        Self::of(model, metadata, device)
    }

    /// The map of a model and all else.
    pub(crate) fn of(
        model: FlattenAnything<B>,
        metadata: Metadata,
        device: &B::Device,
    ) -> Result<Self, ModelFileError> {
        metadata.check()?;
        let mut map = Self::new(
            model,
            metadata.config,
            metadata.points,
            metadata.normalization,
            device,
        );
        map.frame = metadata.frame;
        Ok(map)
    }
}

impl Metadata {
    /// Whether it makes sense.
    fn check(&self) -> Result<(), ModelFileError> {
        if self.version != FORMAT_VERSION {
            return Err(ModelFileError::Metadata(format!(
                "version {} of its format is not supported",
                self.version
            )));
        }
        if let Some(problem) = self.config.problem() {
            return Err(ModelFileError::Metadata(problem.to_string()));
        }
        if self.points > self.config.points {
            return Err(ModelFileError::Metadata(
                "it has more points than its configuration".to_string(),
            ));
        }
        let Normalization { center, radius } = self.normalization;
        let UvFrame { corner, side, .. } = self.frame;
        let finite = center.iter().all(|c| c.is_finite()) && corner.iter().all(|c| c.is_finite());
        let positive = |length: f64| length.is_finite() && length > 0.0;
        if !finite || !positive(radius) || !positive(f64::from(side)) {
            return Err(ModelFileError::Metadata(
                "its normalisation or frame is not a finite scale".to_string(),
            ));
        }
        Ok(())
    }
}
