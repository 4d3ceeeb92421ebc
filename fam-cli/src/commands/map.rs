use std::process::ExitCode;

use burn::tensor::backend::AutodiffBackend;
use fam_core::map::{ModelFileError, TrainedMap};
use fam_core::surface::{Surface, UvMap};
use fam_io::WriteOptions;

use crate::args;
use crate::backend::{Backend, Job};
use crate::failure::Failure;

/// UVs of a file's points from a trained model.
pub fn map(arguments: &args::Map) -> Result<ExitCode, Failure> {
    let fail = |reason: String| Failure::input(format!("{}: {reason}", arguments.model.display()));
    let model = std::fs::read(&arguments.model).map_err(|error| fail(error.to_string()))?;
    let document = fam_io::read_surface(&arguments.input).map_err(Failure::input)?;
    let backend = Backend::choose(arguments.backend)?;
    let surface = document.surface();
    let uvs = backend
        .run(Evaluate {
            model: &model,
            points: surface.positions(),
        })
        .map_err(|error| fail(error.to_string()))?;
    match surface {
        Surface::Mesh(mesh) => {
            let uvs = UvMap::new(uvs, mesh.triangles().to_vec()).map_err(Failure::work)?;
            document.write_mesh_uvs(&uvs, &arguments.out, &WriteOptions::default())
        }
        Surface::PointCloud(_) => {
            document.write_point_uvs(&uvs, &arguments.out, &WriteOptions::default())
        }
    }
    .map_err(Failure::work)?;
    Ok(ExitCode::SUCCESS)
}

struct Evaluate<'a> {
    model: &'a [u8],
    points: &'a [[f64; 3]],
}

impl Job for Evaluate<'_> {
    type Output = Result<Vec<[f32; 2]>, ModelFileError>;

    fn run<B: AutodiffBackend>(self, device: &B::Device) -> Self::Output {
        let map = TrainedMap::<B::InnerBackend>::from_safetensors(self.model, device)?;
        Ok(map.uvs(self.points))
    }
}
