mod batch;
mod fingerprint;
mod run;
mod summary;
mod worker;

use std::path::Path;

use fam::Method;
use fam_io::Document;
use fam_surface::{Surface, shapes};

use crate::again::Again;
use crate::args;
use crate::failure::Failure;
use crate::inputs::Inputs;
use crate::progress::ProgressMode;
use crate::timeout::end_after;
use run::Run;

/// Writes surfaces with UVs and all that goes with them.
///
/// `again` starts this program again, for files of a batch.
pub fn unwrap(arguments: args::Unwrap, again: &Again) -> Result<u8, Failure> {
    if let Some([file, folder]) = arguments.worker.as_deref() {
        return Ok(Run::of_worker()?.work(file, folder));
    }
    let inputs = Inputs::collect(&arguments.inputs, arguments.out.as_deref())?;
    let inputs = match arguments.shard {
        Some(_) => inputs.many(),
        None => inputs,
    };
    let progress = ProgressMode::of_user(arguments.quiet);
    match inputs {
        Inputs::Sample => {
            let name = "the built-in sample";
            end_after(arguments.timeout, name.to_owned());
            let mut run = Run::new(arguments, progress)?;
            // The sample shows what the networks do.
            if run.config.method == Method::Auto {
                run.config.method = Method::Neural;
            }
            // Closed and of genus 1, so that seams have to be found.
            let document = Document::of_surface(Surface::Mesh(shapes::torus(1.0, 0.4, 96, 48)));
            run.single(&document, name, "sample", None)
        }
        Inputs::One(path) => {
            // Already reading may have no end.
            end_after(arguments.timeout, path.display().to_string());
            let document = fam_io::read_surface(&path).map_err(Failure::input)?;
            let run = Run::new(arguments, progress)?;
            run.single(
                &document,
                &path.display().to_string(),
                &stem(&path),
                Some(&path),
            )
        }
        Inputs::Batch { files, failed } => {
            // Workers report progress; the batch shows it.
            let run = Run::new(arguments, ProgressMode::Silent)?;
            match run.marks.file_option() {
                Some(option) if files.len() + failed.len() > 1 => Err(Failure::input(format!(
                    "{option} marks edges of one mesh, but there are several inputs"
                ))),
                _ => run.batch(files, failed, again),
            }
        }
    }
}

fn stem(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or(path.as_os_str());
    stem.to_string_lossy().into_owned()
}
