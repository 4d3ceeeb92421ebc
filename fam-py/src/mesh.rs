//! Unwrapping a mesh.

use std::sync::Arc;

use burn_flex::Flex;
use fam::{Kept, Options, Parting, Unwrapped, Uvs, in_a_row};
use fam_cli::{BackendName, Squares, Weight, all_but, marks, weighted};
use fam_core::atlas::Atlas;
use fam_layout::Marks;
use fam_surface::charts::charts;
use fam_surface::polygons::{Polygons, Split};
use fam_surface::{Edges, Surface, TriangleMesh, UvMap};
use numpy::{IntoPyArray, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{Faces, PolygonMesh, of_rows, rows};
use crate::asked::{Asked, Wishes, on_all_faces};
use crate::failure::Failure;
use crate::files::{File, IndexedUvs};
use crate::job::{Job, Output, Signal};
use crate::map::Map;
use crate::settings::Settings;
use crate::unwrapped::Told;

/// The job that unwraps a mesh. `objects`, `materials`, `weights` and `selected` have an entry for every
/// face, `paint` one for every vertex, and `uvs` `[C, 2]` one for every corner of the faces. Each material has
/// a square of its own, or each object if they are `per_object`.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "Python names them")]
pub fn unwrap(
    py: Python<'_>,
    positions: PyReadonlyArray2<'_, f64>,
    corners: PyReadonlyArray1<'_, u32>,
    sizes: Option<PyReadonlyArray1<'_, u32>>,
    objects: Option<Vec<u32>>,
    materials: Option<Vec<u32>>,
    per_object: bool,
    weights: Option<PyReadonlyArray1<'_, f64>>,
    uvs: Option<PyReadonlyArray2<'_, f32>>,
    selected: Option<Vec<bool>>,
    paint: Option<PyReadonlyArray1<'_, f64>>,
    asked: Asked<'_>,
    settings: Settings,
) -> PyResult<Job> {
    let start = || {
        let positions = rows(&positions)?;
        let faces = Faces::new(&corners, sizes.as_ref())?;
        let uvs = uvs.as_ref().map(rows).transpose()?;
        let numbers = |array: PyReadonlyArray1<'_, f64>| array.as_array().to_vec();
        let paint = paint.map_or_else(Vec::new, numbers);
        let weights = weights.map(numbers);
        let mut wishes = Wishes::of(&asked)?;
        let mut options = settings.options(Parting::default())?;
        let backend = settings.backend()?;
        Job::start(move |signal| {
            let mesh = PolygonMesh::new(positions, &faces)?;
            let mut parting = parting(&mesh, objects.as_deref(), materials.as_deref());
            if per_object {
                parting = parting.with_square_per_label();
            }
            if let Some(weights) = weights {
                parting = parting.with_weights(&mesh.of_triangles(&weights));
            }
            options.parting = Parting {
                duplicates: options.parting.duplicates,
                ..parting
            };
            let uvs = uvs.map(|uvs| mesh.uv_map(&uvs)).transpose()?;
            let bound = options.layout.distortion_bound;
            options.kept = wishes.keep(&mesh.mesh, uvs.as_ref(), bound)?;
            if let Some(selected) = selected {
                let uvs = on_all_faces(uvs.as_ref())?.clone();
                let is_kept = mesh.of_triangles(&selected).iter().map(|&is| !is).collect();
                options.kept = Some(Kept::new(uvs, is_kept)?);
            }
            let edges = Edges::of(&mesh.mesh);
            options.marks = Marks::new(&edges, &wishes.wanted, &wishes.forbidden)
                .with_diagonals(&edges, &mesh.diagonals)
                .with_paint(paint);
            unwrapped(mesh.mesh, &mesh.polygons, &options, backend, signal)
        })
    };
    start().map_err(|failure| failure.exception(py))
}

/// The job that unwraps the mesh of a file, whose faces are its triangles; with a square for every
/// material or object if they are `per_material` or `per_object`. `weights` and `only` are for materials and
/// objects by their names, `selected` and `paint` are names of attributes of the vertices.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "Python names them")]
pub fn unwrap_file(
    py: Python<'_>,
    file: &File,
    per_material: bool,
    per_object: bool,
    weights: Vec<(String, f64)>,
    only: Vec<String>,
    selected: Option<String>,
    paint: Option<String>,
    asked: Asked<'_>,
    settings: Settings,
) -> PyResult<Job> {
    let start = || {
        let document = Arc::clone(file.document());
        let mut wishes = Wishes::of(&asked)?;
        let squares = Squares::of(per_material, per_object);
        let weights: Vec<Weight> = weights
            .into_iter()
            .map(|(name, factor)| Weight { name, factor })
            .collect();
        let parting = fam_cli::parting(document.labels(), squares);
        let parting = weighted(&document, parting, &weights)?;
        let mut options = settings.options(parting)?;
        let backend = settings.backend()?;
        Job::start(move |signal| {
            let Surface::Mesh(mesh) = document.surface() else {
                return Err(Failure::Input("the file has no faces".to_owned()));
            };
            let uvs = document.uv_map();
            options.kept = wishes.keep(mesh, uvs, options.layout.distortion_bound)?;
            if !only.is_empty() || selected.is_some() {
                let uvs = on_all_faces(uvs)?.clone();
                let kept = all_but(&document, mesh, uvs, &only, selected.as_deref())?;
                options.kept = Some(kept);
            }
            let marks = marks(mesh, &wishes.wanted, &wishes.forbidden, &document);
            options.marks = marks.map_err(|error| Failure::File(error.to_string()))?;
            if let Some(attribute) = paint {
                let paint = document.vertex_attribute(&attribute);
                let paint = paint.map_err(|error| Failure::Input(error.to_string()))?;
                options.marks = options.marks.with_paint(paint);
            }
            let mut polygons = Polygons::default();
            for &triangle in mesh.triangles() {
                polygons.push(triangle);
            }
            unwrapped(mesh.clone(), &polygons, &options, backend, signal)
        })
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
    mesh: TriangleMesh,
    polygons: &Polygons,
    options: &Options,
    backend: BackendName,
    signal: &Signal,
) -> Result<MeshOutput, Failure> {
    let vertices = mesh.positions().len();
    let surface = Surface::Mesh(mesh);
    let Told {
        unwrapped,
        report,
        warnings,
    } = Told::of(&surface, options, backend, signal)?;
    let Unwrapped {
        uvs, seams, map, ..
    } = unwrapped;
    let Uvs::Mesh(uvs) = uvs else {
        return Err(Failure::Internal("a mesh has UVs of points".to_owned()));
    };
    let squares = squares(&options.parting);
    let split = Split::at_seams(vertices, polygons, &uvs);
    Ok(MeshOutput {
        faces: FaceOutput::new(
            polygons,
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
