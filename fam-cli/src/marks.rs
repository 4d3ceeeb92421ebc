//! Where the mesh is to be cut and where it is not: edges that the user marked, and polygons.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use fam_io::Document;
use fam_io::marks::MarkedEdges;
use fam_layout::Marks;
use fam_surface::metrics::present_seams;
use fam_surface::{Edges, Surface, TriangleMesh};

use crate::args::Unwrap;
use crate::failure::Failure;

/// What `--seams`, `--no-seams` and `--keep-seams` ask for.
#[derive(Debug)]
pub struct MarkFiles {
    wanted: Option<MarkFile>,
    forbidden: Option<MarkFile>,
    /// Whether the seams of the UVs that are there are kept, and no others made.
    keeps: bool,
    /// The vertex attribute that says where seams are not wanted.
    paint: Option<String>,
}

/// A file with marked edges, held in memory: a pipe cannot be read twice.
#[derive(Debug)]
struct MarkFile {
    option: &'static str,
    path: PathBuf,
    bytes: Vec<u8>,
}

/// The marks on a mesh, and what does not fit it.
#[derive(Debug, Default)]
pub struct Marked {
    pub marks: Marks,
    /// Whether there are any of the user's.
    by_user: bool,
    /// Files of which some edges are none of the mesh, a sentence for each.
    unmatched: Vec<String>,
}

impl MarkFiles {
    /// Those that the command line names.
    pub fn read(arguments: &Unwrap) -> Result<Self, Failure> {
        let read = |option, path: &Option<PathBuf>| {
            let file = path.as_ref().map(|path| MarkFile::read(option, path));
            file.transpose()
        };
        Ok(Self {
            wanted: read("--seams", &arguments.seams)?,
            forbidden: read("--no-seams", &arguments.no_seams)?,
            keeps: arguments.keep_seams || arguments.improve,
            paint: arguments
                .paint
                .as_ref()
                .map(|paint| paint.attribute.clone()),
        })
    }

    /// The first option that names a file, if any does.
    pub fn file_option(&self) -> Option<&'static str> {
        self.all().next().map(|file| file.option)
    }

    /// The first option that marks edges, if any does.
    pub fn option(&self) -> Option<&'static str> {
        let keep = self.keeps.then_some("--keep-seams");
        let paint = self.paint.as_ref().map(|_| "--paint");
        self.file_option().or(keep).or(paint)
    }

    /// Writes what distinguishes them from others.
    pub fn write_to(&self, out: &mut impl Write) -> io::Result<()> {
        if self.keeps {
            out.write_all(b"\n--keep-seams\n")?;
        }
        self.all().try_for_each(|file| {
            write!(out, "\n{} {}\n", file.option, file.bytes.len())?;
            out.write_all(&file.bytes)
        })
    }

    /// What they and its polygons mark on a surface.
    pub fn on(&self, document: &Document) -> Result<Marked, Failure> {
        let mesh = match (document.surface(), self.option()) {
            (Surface::Mesh(mesh), _) => mesh,
            (Surface::PointCloud(_), None) => return Ok(Marked::default()),
            (Surface::PointCloud(_), Some(option)) => {
                let reason = format!("a point cloud has no edges that {option} could mark");
                return Err(Failure::input(reason));
            }
        };
        let mut unmatched = Vec::new();
        let mut edges = |file: &Option<MarkFile>| -> Result<Vec<[u32; 2]>, Failure> {
            let Some(file) = file else {
                return Ok(Vec::new());
            };
            let found = MarkedEdges::from_bytes(&file.bytes, mesh)
                .map_err(|fault| file.failure(&fault.to_string()))?;
            unmatched.extend(file.unmatched(&found));
            Ok(found.edges)
        };
        let (mut wanted, mut forbidden) = (edges(&self.wanted)?, edges(&self.forbidden)?);
        if self.keeps {
            let none = "it has no texture coordinates on all of its faces, of which --keep-seams could keep \
                        the seams";
            let uvs = document.uv_map().ok_or_else(|| Failure::input(none))?;
            let [seams, others] = present_seams(mesh, uvs).map_err(Failure::input)?;
            wanted.extend(seams);
            forbidden.extend(others);
        }
        let mut marks = marks(mesh, &wanted, &forbidden, document).map_err(Failure::input)?;
        if let Some(attribute) = &self.paint {
            let values = document.vertex_attribute(attribute);
            marks = marks.with_paint(values.map_err(Failure::input)?);
        }
        Ok(Marked {
            marks,
            by_user: self.keeps || self.file_option().is_some(),
            unmatched,
        })
    }

    fn all(&self) -> impl Iterator<Item = &MarkFile> {
        self.wanted.iter().chain(&self.forbidden)
    }
}

impl MarkFile {
    fn read(option: &'static str, path: &Path) -> Result<Self, Failure> {
        let mut file = Self {
            option,
            path: path.to_owned(),
            bytes: Vec::new(),
        };
        file.bytes = std::fs::read(path).map_err(|error| file.failure(&error.to_string()))?;
        Ok(file)
    }

    fn failure(&self, reason: &str) -> Failure {
        let path = self.path.display();
        Failure::input(format!("{} {path}: {reason}", self.option))
    }

    fn unmatched(&self, found: &MarkedEdges) -> Option<String> {
        let (unmatched, all) = (found.unmatched, found.edges.len() + found.unmatched);
        found.first_unmatched.as_ref().map(|first| {
            format!(
                "{} {}: not in the mesh are {unmatched} of {all} marked edges, the first is {first}",
                self.option,
                self.path.display(),
            )
        })
    }
}

impl Marked {
    /// What the polygons of a mesh mark on it.
    pub fn by_polygons(document: &Document, mesh: &TriangleMesh) -> Result<Self, Failure> {
        Ok(Self {
            marks: marks(mesh, &[], &[], document).map_err(Failure::input)?,
            ..Self::default()
        })
    }

    /// Half a line on what the user marked, if anything.
    pub fn summary(&self) -> Option<String> {
        let [wanted, forbidden] = [self.marks.wanted(), self.marks.forbidden()].map(<[_]>::len);
        let summary =
            || format!("seams are wanted along {wanted} edges and forbidden along {forbidden}");
        self.by_user.then(summary)
    }

    /// A sentence for each file of which some edges are none of the mesh.
    pub fn unmatched(&self) -> &[String] {
        &self.unmatched
    }
}

/// Marked edges of the mesh of a document whose polygons are to stay whole, and its hard edges.
///
/// # Errors
/// The file that it was read from is needed again, and cannot be read.
pub fn marks(
    mesh: &TriangleMesh,
    wanted: &[[u32; 2]],
    forbidden: &[[u32; 2]],
    document: &Document,
) -> io::Result<Marks> {
    let diagonals = document.diagonals();
    let materials = &document.labels().materials;
    let mut hard = document.hard_edges()?;
    if materials.is_empty()
        && [wanted, forbidden, diagonals, &hard]
            .iter()
            .all(|edges| edges.is_empty())
    {
        return Ok(Marks::default());
    }
    let edges = Edges::of(mesh);
    hard.extend(edges.between(mesh, materials));
    Ok(Marks::new(&edges, wanted, forbidden)
        .with_diagonals(&edges, diagonals)
        .with_hard_edges(&edges, &hard))
}
