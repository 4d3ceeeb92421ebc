//! Unwrapping a mesh.

use burn_flex::Flex;
use fam::{Options, Parting, Unwrapped, Uvs, in_a_row};
use fam_cli::BackendName;
use fam_core::atlas::Atlas;
use fam_layout::Marks;
use fam_surface::charts::charts;
use fam_surface::polygons::{Polygons, Split};
use fam_surface::{Edges, Surface, UvMap};
use numpy::{IntoPyArray, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{Faces, PolygonMesh, of_rows, rows};
use crate::failure::Failure;
use crate::files::{File, IndexedUvs};
use crate::job::{Job, Output, Signal};
use crate::map::Map;
use crate::settings::Settings;
use crate::unwrapped::Told;

/// The job that unwraps a mesh. `objects` and `materials` have a number for every face; `wanted` are the
/// edges to cut along, `forbidden` those not to, by their vertices.
#[pyfunction]
#[pyo3(signature = (positions, corners, sizes, objects, materials, wanted, forbidden, settings))]
#[expect(clippy::too_many_arguments, reason = "Python names them")]
pub fn unwrap(
    py: Python<'_>,
    positions: PyReadonlyArray2<'_, f64>,
    corners: PyReadonlyArray1<'_, u32>,
    sizes: Option<PyReadonlyArray1<'_, u32>>,
    objects: Option<Vec<u32>>,
    materials: Option<Vec<u32>>,
    wanted: PyReadonlyArray2<'_, u32>,
    forbidden: PyReadonlyArray2<'_, u32>,
    settings: Settings,
) -> PyResult<Job> {
    let start = || {
        let positions = rows(&positions)?;
        let faces = Faces::new(&corners, sizes.as_ref())?;
        let marks = [rows(&wanted)?, rows(&forbidden)?];
        let mut options = settings.options(Parting::default())?;
        let backend = settings.backend()?;
        Job::start(move |signal| {
            let mesh = PolygonMesh::new(positions, &faces)?;
            options.parting = Parting {
                duplicates: options.parting.duplicates,
                ..parting(&mesh, objects.as_deref(), materials.as_deref())
            };
            unwrapped(mesh, options, backend, &marks, signal)
        })
    };
    start().map_err(|failure| failure.exception(py))
}

/// The job that unwraps the mesh of a file, whose faces are its triangles; with a square for every
/// material if they are `per_material`.
#[pyfunction]
pub fn unwrap_file(
    py: Python<'_>,
    file: &File,
    per_material: bool,
    wanted: PyReadonlyArray2<'_, u32>,
    forbidden: PyReadonlyArray2<'_, u32>,
    settings: Settings,
) -> PyResult<Job> {
    let start = || {
        let document = file.document();
        let Surface::Mesh(mesh) = document.surface() else {
            return Err(Failure::Input("the file has no faces".to_owned()));
        };
        let mut polygons = Polygons::default();
        for &triangle in mesh.triangles() {
            polygons.push(triangle);
        }
        let labels = document.labels();
        let parting = match per_material && !labels.materials.is_empty() {
            true => Parting::by_material(&labels.objects, &labels.materials),
            false => Parting::by_object(&labels.objects),
        };
        let options = settings.options(parting)?;
        let backend = settings.backend()?;
        let marks = [rows(&wanted)?, rows(&forbidden)?];
        let mesh = PolygonMesh {
            mesh: mesh.clone(),
            polygons,
            diagonals: document.diagonals().to_vec(),
        };
        Job::start(move |signal| unwrapped(mesh, options, backend, &marks, signal))
    };
    start().map_err(|failure| failure.exception(py))
}

/// Faces of different objects and materials are apart; each material has a square of its own.
fn parting(mesh: &PolygonMesh, objects: Option<&[u32]>, materials: Option<&[u32]>) -> Parting {
    let objects = objects.map_or_else(Vec::new, |objects| mesh.of_triangles(objects));
    match materials {
        None => Parting::by_object(&objects),
        Some(materials) => {
            let materials = mesh.of_triangles(materials).into_iter().map(Some);
            Parting::by_material(&objects, &materials.collect::<Vec<_>>())
        }
    }
}

fn unwrapped(
    mesh: PolygonMesh,
    mut options: Options,
    backend: BackendName,
    [wanted, forbidden]: &[Vec<[u32; 2]>; 2],
    signal: &Signal,
) -> Result<MeshOutput, Failure> {
    let PolygonMesh {
        mesh,
        polygons,
        diagonals,
    } = mesh;
    let edges = Edges::of(&mesh);
    options.marks = Marks::new(&edges, wanted, forbidden).with_diagonals(&edges, &diagonals);
    let vertices = mesh.positions().len();
    let surface = Surface::Mesh(mesh);
    let Told {
        unwrapped,
        report,
        warnings,
    } = Told::of(&surface, &options, backend, signal)?;
    let Unwrapped {
        uvs, seams, map, ..
    } = unwrapped;
    let Uvs::Mesh(uvs) = uvs else {
        return Err(Failure::Internal("a mesh has UVs of points".to_owned()));
    };
    let squares = squares(&options.parting);
    let split = Split::at_seams(vertices, &polygons, &uvs);
    Ok(MeshOutput {
        faces: FaceOutput::new(
            &polygons,
            &split,
            &charts(&in_a_row(&uvs, &options.parting, options.layout.tiles)?),
            squares.as_deref(),
        ),
        vertex_map: (0..vertices as u32).chain(split.added).collect(),
        vertex_uvs: split.uvs,
        seams: seams.edges,
        report,
        warnings,
        map,
        uvs,
    })
}

/// The UV square of every triangle, if there are several.
fn squares(parting: &Parting) -> Option<Vec<u32>> {
    let of_label = |&label: &u32| parting.squares[label as usize];
    (!parting.squares.is_empty()).then(|| parting.labels.iter().map(of_label).collect())
}

/// The faces of a result: those of the input, of which some that a seam crosses became triangles.
struct FaceOutput {
    /// The vertices of all corners, face by face.
    corners: Vec<u32>,
    /// How many corners every face has.
    sizes: Vec<u32>,
    /// The face of the input that every face is or is part of.
    source: Vec<u32>,
    charts: Vec<u32>,
    squares: Option<Vec<u32>>,
}

impl FaceOutput {
    fn new(polygons: &Polygons, split: &Split, charts: &[u32], squares: Option<&[u32]>) -> Self {
        let mut found = Self {
            corners: Vec::new(),
            sizes: Vec::new(),
            source: Vec::new(),
            charts: Vec::new(),
            squares: squares.map(|_| Vec::new()),
        };
        let mut first = 0;
        for ((face, (_, division)), pieces) in (0..).zip(polygons.divided()).zip(&split.faces) {
            for (k, piece) in pieces.iter().enumerate() {
                found.corners.extend(piece);
                found.sizes.push(piece.len() as u32);
                found.source.push(face);
                found.charts.push(charts[first + k]);
                if let (Some(found), Some(squares)) = (&mut found.squares, squares) {
                    found.push(squares[first]);
                }
            }
            first += division.count();
        }
        found
    }
}

struct MeshOutput {
    faces: FaceOutput,
    vertex_map: Vec<u32>,
    vertex_uvs: Vec<[f32; 2]>,
    seams: Vec<[u32; 2]>,
    report: String,
    warnings: Vec<String>,
    map: Option<Atlas<Flex>>,
    /// As they are written to a file.
    uvs: UvMap,
}

impl Output for MeshOutput {
    fn object<'py>(self: Box<Self>, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let found = PyDict::new(py);
        found.set_item("corners", self.faces.corners.into_pyarray(py))?;
        found.set_item("sizes", self.faces.sizes.into_pyarray(py))?;
        found.set_item("source", self.faces.source.into_pyarray(py))?;
        found.set_item("charts", self.faces.charts.into_pyarray(py))?;
        let squares = self.faces.squares.map(|squares| squares.into_pyarray(py));
        found.set_item("squares", squares)?;
        found.set_item("vertex_map", self.vertex_map.into_pyarray(py))?;
        found.set_item("vertex_uvs", of_rows(py, self.vertex_uvs))?;
        found.set_item("seams", of_rows(py, self.seams))?;
        found.set_item("report", self.report)?;
        found.set_item("warnings", self.warnings)?;
        found.set_item("map", self.map.map(Map::from))?;
        found.set_item("indexed", IndexedUvs::from(self.uvs))?;
        Ok(found.into_any())
    }
}
