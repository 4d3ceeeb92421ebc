//! Edges that the user marked: where to cut, and where not to.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use fam_core::finish::Marks;
use fam_core::surface::{Edges, Surface};
use fam_io::marks::MarkedEdges;
use serde::Serialize;

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
    /// Files of which some edges are none of the mesh, a sentence for each.
    pub unmatched: Vec<String>,
}

/// What came of marks.
#[derive(Debug, Clone, Serialize)]
pub struct MarksReport {
    wanted: usize,
    forbidden: usize,
    forbidden_cut: usize,
    #[serde(skip)]
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

    /// What they mark on a surface; nothing if there are none.
    pub fn on(&self, surface: &Surface) -> Result<Option<Marked>, Failure> {
        let Some(option) = self.option() else {
            return Ok(None);
        };
        let Surface::Mesh(mesh) = surface else {
            let reason = format!("a point cloud has no edges that {option} could mark");
            return Err(Failure::input(reason));
        };
        let mut marked = Marked::default();
        let mut edges = |file: &Option<MarkFile>| -> Result<Vec<[u32; 2]>, Failure> {
            let Some(file) = file else {
                return Ok(Vec::new());
            };
            let found = MarkedEdges::from_bytes(&file.bytes, mesh)
                .map_err(|fault| file.failure(&fault.to_string()))?;
            marked.unmatched.extend(file.unmatched(&found));
            Ok(found.edges)
        };
        let (wanted, forbidden) = (edges(&self.wanted)?, edges(&self.forbidden)?);
        marked.marks = Marks::new(&Edges::of(mesh), &wanted, &forbidden);
        Ok(Some(marked))
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
    /// Half a line on what is marked.
    pub fn summary(&self) -> String {
        let [wanted, forbidden] = [self.marks.wanted(), self.marks.forbidden()].map(<[_]>::len);
        format!("seams are wanted along {wanted} edges and forbidden along {forbidden}")
    }

    /// What came of the marks on a mesh with these seams.
    pub fn report(&self, seams: &[[u32; 2]]) -> MarksReport {
        MarksReport {
            wanted: self.marks.wanted().len(),
            forbidden: self.marks.forbidden().len(),
            forbidden_cut: self.marks.forbidden_among(seams),
            unmatched: self.unmatched.clone(),
        }
    }
}

impl MarksReport {
    /// Whether seams are wanted somewhere.
    pub fn wants_seams(&self) -> bool {
        self.wanted > 0
    }

    /// What the user has to know.
    pub fn warnings(&self) -> Vec<String> {
        let cut = (self.forbidden_cut > 0).then(|| {
            let (cut, all) = (self.forbidden_cut, self.forbidden);
            format!("forbidden edges that are cut: {cut} of {all}")
        });
        self.unmatched.iter().cloned().chain(cut).collect()
    }
}
