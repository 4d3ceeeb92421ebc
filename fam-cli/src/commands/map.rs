use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use burn::tensor::backend::AutodiffBackend;
use fam::Parting;
use fam_core::atlas::Atlas;
use fam_core::training::Strategies;
use fam_io::{CloudStream, Format, StreamError, Uvs, Warning, WriteFault, WriteOptions};
use fam_surface::Surface;

use crate::args;
use crate::backend::{Backend, Job};
use crate::failure::{Failure, SUCCESS};
use crate::interrupt::{INTERRUPTED, stop_on_interrupt};
use crate::parting::{Squares, parting};
use crate::terminal::print_line;

/// UVs of a file's points from a trained model.
pub fn map(arguments: &args::Map) -> Result<u8, Failure> {
    let fail = |reason: String| Failure::input(format!("{}: {reason}", arguments.model.display()));
    let model = std::fs::read(&arguments.model).map_err(|error| fail(error.to_string()))?;
    let backend = Backend::choose(arguments.backend)?;
    let format = Format::of_path(&arguments.out);
    // What is wrong with the input is said where it is read.
    let keeps_format =
        format.is_none_or(|format| fam_io::format_of(&arguments.input).is_ok_and(|f| f == format));
    let stream = match keeps_format {
        true => CloudStream::open(&arguments.input).map_err(Failure::input)?,
        false => None,
    };
    let warn = |warnings: &[Warning]| {
        for warning in warnings {
            print_line(&format!(
                "warning: {}: {warning}",
                arguments.input.display()
            ));
        }
    };
    if let Some(cloud) = stream {
        warn(cloud.warnings());
        let stop = stop_on_interrupt(true)?;
        let out = &arguments.out;
        let copied = backend
            .run(Stream {
                model: &model,
                cloud,
                out,
                stop: &stop,
            })
            .map_err(fail)?;
        return match copied {
            Ok(()) => Ok(SUCCESS),
            Err(StreamError::Read(error)) => Err(Failure::input(error)),
            Err(StreamError::Write(error)) => Err(Failure::work(error)),
            Err(StreamError::BrokenOff) => Ok(INTERRUPTED),
        };
    }
    let document = fam_io::read_surface(&arguments.input).map_err(Failure::input)?;
    warn(document.warnings());
    let squares = Squares::of(arguments.per_material, false);
    let parting = parting(document.labels(), squares);
    let uvs = backend
        .run(Evaluate {
            model: &model,
            surface: document.surface(),
            parting: &parting,
        })
        .map_err(fail)?;
    let options = WriteOptions::default();
    match &uvs {
        Uvs::Mesh(uvs) => document.write_mesh_uvs(uvs, &arguments.out, &options),
        Uvs::Points(uvs) => document.write_point_uvs(uvs, &arguments.out, &options),
    }
    .map_err(|error| match error.fault {
        WriteFault::NoPlaceForUvs(_) | WriteFault::NoPlaceForSurface { .. } => {
            Failure::input(error)
        }
        _ => Failure::work(error),
    })?;
    Ok(SUCCESS)
}

/// A cloud of any size, in the format that it has.
struct Stream<'a> {
    model: &'a [u8],
    cloud: CloudStream,
    out: &'a Path,
    stop: &'a AtomicBool,
}

impl Job for Stream<'_> {
    type Output = Result<Result<(), StreamError>, String>;

    fn run<B: AutodiffBackend>(self, device: &B::Device, _: Strategies<B>) -> Self::Output {
        let atlas = Atlas::<B::InnerBackend>::from_safetensors(self.model, device)
            .map_err(|error| error.to_string())?;
        let uvs = |points: &[[f64; 3]]| match self.stop.load(Ordering::Relaxed) {
            true => None,
            false => Some(atlas.uvs(points)),
        };
        Ok(self.cloud.write_uvs(self.out, uvs))
    }
}

struct Evaluate<'a> {
    model: &'a [u8],
    surface: &'a Surface,
    parting: &'a Parting,
}

impl Job for Evaluate<'_> {
    type Output = Result<Uvs, String>;

    fn run<B: AutodiffBackend>(self, device: &B::Device, _: Strategies<B>) -> Self::Output {
        let atlas = Atlas::<B::InnerBackend>::from_safetensors(self.model, device)
            .map_err(|error| error.to_string())?;
        Ok(match self.surface {
            Surface::Mesh(mesh) => {
                let uvs = atlas.uv_map(mesh, &self.parting.labels);
                Uvs::Mesh(uvs.map_err(|error| error.to_string())?)
            }
            Surface::PointCloud(cloud) => Uvs::Points(atlas.uvs(cloud.points())),
        })
    }
}
