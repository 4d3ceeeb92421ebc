//! Where the mesh is to be cut and where it is not: edges that the user marked, and polygons.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use fam_io::Document;
use fam_io::marks::MarkedEdges;
use fam_layout::Marks;
use fam_surface::{Edges, Surface, TriangleMesh};

use crate::args::Unwrap;
use crate::failure::Failure;

/// The files of `--seams` and `--no-seams`.
#[derive(Debug)]
pub struct MarkFiles {
    wanted: Option<MarkFile>,
    forbidden: Option<MarkFile>,
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
        })
    }

    /// The first option that names one, if any does.
    pub fn option(&self) -> Option<&'static str> {
        self.all().next().map(|file| file.option)
    }

    /// Writes what distinguishes them from others.
    pub fn write_to(&self, out: &mut impl Write) -> io::Result<()> {
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
        let (wanted, forbidden) = (edges(&self.wanted)?, edges(&self.forbidden)?);
        Ok(Marked {
            marks: marks(mesh, &wanted, &forbidden, document),
            by_user: self.option().is_some(),
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
    pub fn by_polygons(document: &Document, mesh: &TriangleMesh) -> Self {
        Self {
            marks: marks(mesh, &[], &[], document),
            ..Self::default()
        }
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

/// Marked edges of a mesh whose polygons are to stay whole.
fn marks(
    mesh: &TriangleMesh,
    wanted: &[[u32; 2]],
    forbidden: &[[u32; 2]],
    document: &Document,
) -> Marks {
    let diagonals = document.diagonals();
    if [wanted, forbidden, diagonals]
        .iter()
        .all(|edges| edges.is_empty())
    {
        return Marks::default();
    }
    let edges = Edges::of(mesh);
    Marks::new(&edges, wanted, forbidden).with_diagonals(&edges, diagonals)
}
