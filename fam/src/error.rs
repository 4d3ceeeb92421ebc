use fam_core::map::ModelFileError;
use fam_core::training::TrainingError;
use fam_layout::PackError;
use fam_surface::SurfaceError;

/// Why a surface was not unwrapped.
#[derive(Debug, thiserror::Error)]
pub enum UnwrapError {
    /// The surface cannot be laid out.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// The charts cannot be packed as asked.
    #[error(transparent)]
    Pack(#[from] PackError),
    /// The layout's configuration makes no sense: a message that names the field.
    #[error("{0}")]
    Config(&'static str),
    /// A point cloud has no triangles to lay out.
    #[error("the direct method lays out meshes; a point cloud needs the neural one")]
    CloudWithoutMap,
    /// [`FinishMode::None`](crate::FinishMode::None) leaves a raw map, and there is none.
    #[error("the direct method makes no raw map")]
    NoRawMap,
    /// Only the direct method keeps UVs that are there.
    #[error("UVs that are there are kept by the direct method only")]
    KeptByNetworks,
    /// The networks cannot be trained on the surface.
    #[error(transparent)]
    Training(TrainingError),
    /// The first training step already failed.
    #[error(transparent)]
    NothingLearnt(TrainingError),
    /// The trained map has no file form.
    #[error(transparent)]
    Model(#[from] ModelFileError),
}

impl UnwrapError {
    /// Whether the input or the options are to blame, rather than the work itself.
    pub fn is_input(&self) -> bool {
        !matches!(self, Self::NothingLearnt(_) | Self::Model(_))
    }
}
