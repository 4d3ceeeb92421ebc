use fam_surface::metrics::engine::{EngineCheck, Finding, Purpose, Severity, findings};
use fam_surface::metrics::{Metrics, seam_visibility};
use fam_surface::{Surface, TriangleMesh, UvMap};
use serde::Serialize;

use crate::args;
use crate::failure::{FAILED, Failure, SUCCESS};

/// What is printed as JSON.
#[derive(Serialize)]
struct Measured {
    #[serde(flatten)]
    metrics: Metrics,
    seam_visibility: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    findings: Option<Vec<Finding>>,
}

/// Prints the quality of the UVs that a mesh has, and what an engine would complain about.
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
    let measured = Measured {
        metrics: Metrics::measure(mesh, uvs).map_err(|error| fail(&error))?,
        seam_visibility: seam_visibility(mesh, uvs).map_err(|error| fail(&error))?,
        findings: checked(arguments, mesh, uvs)?,
    };
    if arguments.json {
        let json = serde_json::to_string_pretty(&measured).map_err(Failure::work)?;
        println!("{json}");
    } else {
        println!("{}", measured.metrics);
        if let Some(visibility) = measured.seam_visibility {
            println!("{:<20} {visibility:>14.6}", "seam visibility");
        }
        if let (Some(purpose), Some(findings)) = (arguments.purpose, &measured.findings) {
            println!();
            for finding in findings {
                println!("{finding}");
            }
            if findings.is_empty() {
                println!("as a {}: nothing to complain about", args::name_of(purpose));
            }
        }
    }
    let found = measured.findings.iter().flatten();
    match found.map(|finding| finding.severity).min() {
        Some(Severity::Error) => Ok(FAILED),
        _ => Ok(SUCCESS),
    }
}

/// What an engine would complain about, if that is asked for.
fn checked(
    arguments: &args::Metrics,
    mesh: &TriangleMesh,
    uvs: &UvMap,
) -> Result<Option<Vec<Finding>>, Failure> {
    let Some(purpose) = arguments.purpose else {
        return Ok(None);
    };
    let mut check = match purpose.into() {
        Purpose::Lightmap => EngineCheck::LIGHTMAP,
        Purpose::Texture => EngineCheck::TEXTURE,
    };
    check.resolution = arguments.resolution.unwrap_or(check.resolution);
    check.margin = arguments.margin.unwrap_or(check.margin);
    if let Some(problem) = check.problem() {
        return Err(Failure::input(problem));
    }
    let found = findings(mesh, uvs, &check);
    let fail = |error| Failure::input(format!("{}: {error}", arguments.input.display()));
    found.map(Some).map_err(fail)
}
