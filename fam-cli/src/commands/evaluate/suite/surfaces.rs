//! The surfaces of the suites: generated ones of the kinds that the paper shows, and the files that
//! have the names of the paper's models.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use fam_surface::{PointCloud, Surface, TriangleMesh, shapes};

use crate::args::Suite;
use crate::failure::Failure;

/// A surface of a suite.
#[derive(Debug)]
pub struct SuiteSurface {
    /// The paper's name for a model of this kind, where it has one.
    pub name: &'static str,
    pub kind: Kind,
    source: Source,
    /// Whether the suite `quick` has it.
    pub quick: bool,
    /// Which suites leave parts of the method out on it.
    ablations: In,
    /// Which suites add noise to it.
    noise: In,
}

/// What a surface stands for on the page.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Open: of the paper's comparison with SLIM.
    Open,
    /// Closed, of higher genus or one-sided: of the paper's second table.
    Closed,
    /// The paper's stress test.
    Stress,
    /// The paper's failure case.
    Failure,
    /// A mesh whose triangles hang together nowhere: networks are trained on its corners alone.
    Broken,
    /// Points alone.
    Cloud,
}

/// Where a surface comes from.
#[derive(Debug)]
enum Source {
    Generated(fn() -> TriangleMesh),
    /// A file with the surface's name among those that the user gave.
    File,
}

/// In which suites something is done.
#[derive(Debug, PartialEq)]
enum In {
    None,
    Paper,
    Both,
}

/// A surface as it is tried.
pub struct Loaded {
    /// What is trained on.
    pub surface: Surface,
    /// The triangles on which UVs are measured. Those of a cloud are known here alone.
    pub mesh: TriangleMesh,
}

impl SuiteSurface {
    const fn new(name: &'static str, kind: Kind, source: Source) -> Self {
        Self {
            name,
            kind,
            source,
            quick: false,
            ablations: In::None,
            noise: In::None,
        }
    }

    const fn quick(self) -> Self {
        Self {
            quick: true,
            ..self
        }
    }

    const fn with_ablations(self, ablations: In) -> Self {
        Self { ablations, ..self }
    }

    const fn with_noise(self, noise: In) -> Self {
        Self { noise, ..self }
    }

    /// Whether parts of the method are left out on it.
    pub fn ablations(&self, suite: Suite) -> bool {
        self.ablations.has(suite)
    }

    /// Whether noise is added to it.
    pub fn noise(&self, suite: Suite) -> bool {
        self.noise.has(suite)
    }

    /// Whether it is made by code.
    pub fn is_generated(&self) -> bool {
        matches!(self.source, Source::Generated(_))
    }

    /// The file that has its name, if it is one of those that are read.
    pub fn file<'a>(&self, files: &'a [PathBuf]) -> Option<&'a PathBuf> {
        let is_own = |path: &&PathBuf| {
            let stem = path.file_stem().and_then(OsStr::to_str);
            stem.is_some_and(|stem| stem.eq_ignore_ascii_case(self.name))
        };
        files.iter().find(is_own).filter(|_| !self.is_generated())
    }

    /// Makes the surface, or reads it from the file of its name. None without such a file.
    pub fn load(&self, files: &[PathBuf]) -> Result<Option<Loaded>, Failure> {
        let mesh = match self.source {
            Source::Generated(make) => make(),
            Source::File => match self.file(files) {
                Some(path) => read(path)?,
                None => return Ok(None),
            },
        };
        let surface = match self.kind {
            Kind::Cloud | Kind::Broken => {
                let points = mesh.positions().to_vec();
                Surface::PointCloud(PointCloud::new(points, None).map_err(Failure::work)?)
            }
            _ => Surface::Mesh(mesh.clone()),
        };
        Ok(Some(Loaded { surface, mesh }))
    }
}

impl In {
    fn has(&self, suite: Suite) -> bool {
        match self {
            Self::None => false,
            Self::Paper => suite == Suite::Paper,
            Self::Both => true,
        }
    }
}

fn read(path: &Path) -> Result<TriangleMesh, Failure> {
    let document = fam_io::read_surface(path).map_err(Failure::input)?;
    match document.surface() {
        Surface::Mesh(mesh) => Ok(mesh.clone()),
        Surface::PointCloud(_) => {
            let name = path.display();
            Err(Failure::input(format!("{name}: it is a point cloud")))
        }
    }
}

/// All surfaces, in the order of the page.
pub fn all() -> &'static [SuiteSurface] {
    use Kind::{Broken, Closed, Cloud, Failure, Open, Stress};
    use Source::{File, Generated};
    const ALL: &[SuiteSurface] = &[
        SuiteSurface::new("human-face", Open, File).with_ablations(In::Paper),
        SuiteSurface::new("human-head", Open, Generated(|| shapes::bust(0.05))),
        SuiteSurface::new("car-shell", Open, Generated(|| shapes::car_shell(0.04))),
        SuiteSurface::new("spiral", Open, Generated(spiral)),
        SuiteSurface::new("human-hand", Open, File),
        SuiteSurface::new("shirt", Open, Generated(|| shapes::shirt(0.04)))
            .quick()
            .with_ablations(In::Paper),
        SuiteSurface::new("three-men", Open, File),
        SuiteSurface::new("camel-head", Open, File),
        SuiteSurface::new("hemisphere", Open, Generated(|| shapes::hemisphere(0.05))).quick(),
        SuiteSurface::new("cloth", Open, Generated(cloth)),
        SuiteSurface::new("brain", Closed, Generated(|| shapes::brain(0.05, 0))),
        SuiteSurface::new("cow", Closed, File).with_ablations(In::Paper),
        SuiteSurface::new("fandisk", Closed, File),
        SuiteSurface::new("human-body", Closed, File),
        SuiteSurface::new("lion", Closed, File),
        SuiteSurface::new("nail", Closed, Generated(|| shapes::nail(0.04))),
        SuiteSurface::new("bucket", Closed, Generated(|| shapes::bucket(0.06))),
        SuiteSurface::new("dragon", Closed, File),
        SuiteSurface::new("mobius-strip", Closed, Generated(moebius_strip))
            .quick()
            .with_ablations(In::Paper),
        SuiteSurface::new("rocker-arm", Closed, File),
        SuiteSurface::new(
            "torus-double",
            Closed,
            Generated(|| shapes::double_torus(0.08)),
        )
        .quick()
        .with_ablations(In::Both),
        SuiteSurface::new("three-holes", Closed, File),
        SuiteSurface::new("fertility", Closed, File),
        SuiteSurface::new("torus", Closed, Generated(torus)),
        SuiteSurface::new("slab", Closed, Generated(|| shapes::three_holed_slab(0.05))),
        SuiteSurface::new("knot", Closed, Generated(knot)),
        SuiteSurface::new("hilbert-tube", Stress, Generated(hilbert_tube)),
        SuiteSurface::new("assembly", Failure, Generated(|| shapes::assembly(0))),
        SuiteSurface::new("soup", Broken, Generated(soup)),
        SuiteSurface::new(
            "cloth-pts",
            Cloud,
            Generated(|| shapes::draped_cloth(100, 69)),
        )
        .quick()
        .with_noise(In::Both),
        SuiteSurface::new("julius-pts", Cloud, Generated(|| shapes::bust(0.0393)))
            .quick()
            .with_noise(In::Paper),
        SuiteSurface::new("spiral-pts", Cloud, Generated(spiral_points)).with_noise(In::Paper),
    ];
    ALL
}

fn cloth() -> TriangleMesh {
    shapes::draped_cloth(84, 58)
}

/// As wide as six turns of it are apart.
fn spiral() -> TriangleMesh {
    shapes::spiral(4.0, 4.0, 280.0, 99.0, 120, 42)
}

/// 28,000 points, as many as the paper's.
fn spiral_points() -> TriangleMesh {
    shapes::spiral(4.0, 4.0, 280.0, 99.0, 279, 99)
}

fn moebius_strip() -> TriangleMesh {
    shapes::moebius_strip(0.6, 200, 20)
}

fn torus() -> TriangleMesh {
    shapes::torus(1.0, 0.4, 100, 40)
}

fn knot() -> TriangleMesh {
    shapes::knot(0.4, 0.1)
}

/// A curve of the second order fills the cube with 64 cells.
fn hilbert_tube() -> TriangleMesh {
    shapes::hilbert_tube(2, 0.25, 0.1)
}

/// The triangles of a double torus, each apart from all others: shrunk by a fiftieth.
fn soup() -> TriangleMesh {
    let whole = shapes::double_torus(0.08);
    let mut positions = Vec::new();
    for t in 0..whole.triangles().len() {
        let corners = whole.corners(t);
        let middle = [0, 1, 2].map(|c| corners.iter().map(|p| p[c]).sum::<f64>() / 3.0);
        let shrunk = |p: [f64; 3]| [0, 1, 2].map(|c| p[c] + 0.02 * (middle[c] - p[c]));
        positions.extend(corners.map(shrunk));
    }
    let triangles = (0..positions.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
    TriangleMesh::new(positions, triangles.collect()).expect("three corners for each triangle")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn generated_surfaces_have_the_size_of_the_papers() {
        for surface in all().iter().filter(|surface| surface.is_generated()) {
            let mesh = surface.load(&[]).unwrap().unwrap().mesh;
            let triangles = mesh.triangles().len();
            assert!(
                (3_000..60_000).contains(&triangles),
                "{}: {triangles}",
                surface.name
            );
        }
    }

    #[test]
    fn a_file_is_found_by_its_name_alone() {
        let cow = all().iter().find(|surface| surface.name == "cow").unwrap();
        assert!(cow.load(&[PathBuf::from("a/cows.obj")]).unwrap().is_none());
        // It is looked for in the file that has the name.
        let missing = [PathBuf::from("no such folder/Cow.off")];
        assert!(cow.load(&missing).is_err());
    }
}
