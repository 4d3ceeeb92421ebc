use fam_surface::Surface;
use fam_surface::metrics::Metrics;

use crate::args;
use crate::failure::{Failure, SUCCESS};

/// Prints the quality of the UVs that a mesh has.
pub fn metrics(arguments: &args::Metrics) -> Result<u8, Failure> {
    let document = fam_io::read_surface(&arguments.input).map_err(Failure::input)?;
    let fail = |reason: &dyn std::fmt::Display| {
        Failure::input(format!("{}: {reason}", arguments.input.display()))
    };
    let Surface::Mesh(mesh) = document.surface() else {
        return Err(fail(&"it is a point cloud; metrics need a mesh"));
    };
    let uvs = document
        .uv_map()
        .ok_or_else(|| fail(&"it has no texture coordinates on all of its faces"))?;
    let metrics = Metrics::measure(mesh, uvs).map_err(|error| fail(&error))?;
    if arguments.json {
        let json = serde_json::to_string_pretty(&metrics).map_err(Failure::work)?;
        println!("{json}");
    } else {
        println!("{metrics}");
    }
    Ok(SUCCESS)
}
