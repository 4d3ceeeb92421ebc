use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

use fam_io::{Document, Format, WriteFault, WriteOptions};
use fam_layout::{LayoutConfig, PackError, PackOptions, Repacked, Size, repacked};
use fam_surface::charts::{ChartFlaws, charts_apart, flaws};
use fam_surface::{Surface, SurfaceError, UvMap};
use serde::Serialize;

use crate::args;
use crate::failure::{Failure, SUCCESS};
use crate::terminal::{print_json, print_line};
use crate::weights::Weight;

/// A file to pack.
struct Source {
    path: PathBuf,
    document: Document,
    /// The areas of its triangles.
    areas: Vec<f64>,
    /// How many times as long as others its triangles are to be.
    factors: Vec<f64>,
    uvs: UvMap,
}

/// A UV square and the triangles in it: of each the file and its number there.
type Members = Vec<(usize, u32)>;

/// What is printed as JSON.
#[derive(Serialize)]
struct Summary<'a> {
    files: &'a [PathBuf],
    squares: Vec<SquareSummary>,
}

#[derive(Serialize)]
struct SquareSummary {
    /// Of the material, if every one has a square.
    #[serde(skip_serializing_if = "Option::is_none")]
    material: Option<String>,
    charts: usize,
    coverage: f64,
    margin: f64,
    tiles: u32,
    resolution: u32,
}

/// Packs the charts of files anew.
pub fn pack(arguments: &args::Pack) -> Result<u8, Failure> {
    let config = LayoutConfig {
        margin: arguments.margin,
        resolution: arguments.resolution,
        texel_density: arguments.texel_density,
        tiles: arguments.udim,
        whole_texels: arguments.whole_texels,
        ..LayoutConfig::default()
    };
    if let Some(problem) = config.problem() {
        return Err(Failure::input(problem));
    }
    let mut sources: Vec<Source> = arguments
        .inputs
        .iter()
        .map(|path| Source::read(path))
        .collect::<Result<_, _>>()?;
    for weight in &arguments.weight {
        weigh(&mut sources, weight)?;
    }
    let outputs = outputs(arguments)?;
    let squares = squares(&sources, arguments.per_material);
    let squares_are_tiles = squares.len() > 1 && arguments.udim > 1;
    if squares_are_tiles && squares.len() > arguments.udim as usize {
        let (needed, tiles) = (squares.len(), arguments.udim);
        return Err(Failure::input(format!(
            "there are {needed} materials, but {tiles} tiles"
        )));
    }
    let mut packed: Vec<Vec<[f32; 2]>> = sources
        .iter()
        .map(|source| vec![[0.0; 2]; 3 * source.uvs.triangles().len()])
        .collect();
    let mut summaries = Vec::new();
    for (number, (material, members)) in (0..).zip(squares) {
        let uvs = gathered(&sources, &members).map_err(Failure::work)?;
        // Charts of two files are two, even on one place.
        let files: Vec<u32> = members.iter().map(|(file, _)| *file as u32).collect();
        let found = flaws(&uvs, &files);
        for flawed in found.iter().filter(|chart| chart.is_flawed()) {
            print_line(&format!("warning: {}", named(flawed, &sources, &members)));
        }
        let tiles = if squares_are_tiles { 1 } else { config.tiles };
        let first_tile = if squares_are_tiles { number } else { 0 };
        let areas = areas(arguments, &sources, &members, &uvs, &files);
        let result = repack(arguments, &uvs, &files, areas.as_deref(), tiles, first_tile)?;
        for (t, &(file, triangle)) in members.iter().enumerate() {
            let corners = result.uvs.corners(t);
            packed[file][3 * triangle as usize..][..3].copy_from_slice(&corners);
        }
        summaries.push(SquareSummary {
            material,
            charts: found.len(),
            coverage: result.coverage,
            margin: result.margin,
            tiles: result.tiles,
            resolution: result.resolution,
        });
    }
    for ((source, corners), output) in sources.iter().zip(packed).zip(&outputs) {
        let uvs = UvMap::of_corners(&corners).map_err(Failure::work)?;
        let written = source
            .document
            .write_mesh_uvs(&uvs, output, &WriteOptions::default());
        written.map_err(|error| match error.fault {
            WriteFault::NoPlaceForUvs(_) | WriteFault::NoPlaceForSurface { .. } => {
                Failure::input(error)
            }
            _ => Failure::work(error),
        })?;
    }
    if arguments.json {
        print_json(&Summary {
            files: &outputs,
            squares: summaries,
        })?;
    } else {
        summaries
            .iter()
            .for_each(|square| print_line(&square.line()));
    }
    Ok(SUCCESS)
}

impl Source {
    fn read(path: &Path) -> Result<Self, Failure> {
        let document = fam_io::read_surface(path).map_err(Failure::input)?;
        let fail = |reason: &str| Failure::input(format!("{}: {reason}", path.display()));
        let Surface::Mesh(mesh) = document.surface() else {
            return Err(fail("it is a point cloud, which has no charts"));
        };
        let uvs = document.uv_map().cloned();
        Ok(Self {
            path: path.to_owned(),
            areas: mesh.triangle_areas(),
            factors: vec![1.0; mesh.triangles().len()],
            uvs: uvs.ok_or_else(|| fail("it has no texture coordinates on all of its faces"))?,
            document,
        })
    }

    fn material(&self, triangle: u32) -> Option<&str> {
        let labels = self.document.labels();
        let material = (*labels.materials.get(triangle as usize)?)?;
        labels
            .material_names
            .get(material as usize)
            .map(String::as_str)
    }
}

/// Gives the triangles of a material or an object their factor, in all files that have it.
fn weigh(sources: &mut [Source], weight: &Weight) -> Result<(), Failure> {
    let mut unknown = Vec::new();
    for source in &mut *sources {
        if let Err(failure) = weight.give(source.document.labels(), &mut source.factors) {
            unknown.push(failure.of(&source.path.display().to_string()));
        }
    }
    match unknown.len() == sources.len() {
        true => Err(unknown.swap_remove(0)),
        false => Ok(()),
    }
}

/// The file to write for every input.
fn outputs(arguments: &args::Pack) -> Result<Vec<PathBuf>, Failure> {
    let out = &arguments.out;
    let [_] = &arguments.inputs[..] else {
        std::fs::create_dir_all(out)
            .map_err(|error| Failure::input(format!("{}: {error}", out.display())))?;
        let mut names: HashMap<PathBuf, &Path> = HashMap::new();
        return arguments
            .inputs
            .iter()
            .map(|input| {
                let mut name = PathBuf::from(input.file_name().unwrap_or_default());
                // STL has no place for UVs, but none to read either.
                if Format::of_path(&name).is_none() {
                    name.set_extension(Format::Obj.extension());
                }
                match names.insert(name.clone(), input) {
                    None => Ok(out.join(name)),
                    Some(other) => Err(Failure::input(format!(
                        "{} and {} would be one file in {}",
                        other.display(),
                        input.display(),
                        out.display()
                    ))),
                }
            })
            .collect();
    };
    Ok(vec![out.clone()])
}

/// The UV squares: one, or one for each material by its name, first that of faces without any.
fn squares(sources: &[Source], per_material: bool) -> Vec<(Option<String>, Members)> {
    let mut squares: BTreeMap<Option<&str>, Members> = BTreeMap::new();
    for (file, source) in sources.iter().enumerate() {
        for t in 0..source.uvs.triangles().len() as u32 {
            let material = source.material(t).filter(|_| per_material);
            squares.entry(material).or_default().push((file, t));
        }
    }
    let named = squares.into_iter();
    named
        .map(|(name, members)| (name.map(str::to_owned), members))
        .collect()
}

/// The UVs of some triangles.
fn gathered(sources: &[Source], members: &[(usize, u32)]) -> Result<UvMap, SurfaceError> {
    let mut numbers: HashMap<(usize, u32), u32> = HashMap::new();
    let mut uvs = Vec::new();
    let mut triangles = Vec::with_capacity(members.len());
    for &(file, t) in members {
        let map = &sources[file].uvs;
        triangles.push(map.triangles()[t as usize].map(|v| {
            *numbers.entry((file, v)).or_insert_with(|| {
                uvs.push(map.uvs()[v as usize]);
                uvs.len() as u32 - 1
            })
        }));
    }
    UvMap::new(uvs, triangles)
}

/// The areas that triangles are to have; `None` if all charts keep their sizes relative to each other.
///
/// With a texel density they are those on the surface, otherwise those in the plane, each times the
/// square of the largest factor in its chart.
fn areas(
    arguments: &args::Pack,
    sources: &[Source],
    members: &[(usize, u32)],
    uvs: &UvMap,
    files: &[u32],
) -> Option<Vec<f64>> {
    let on_surface = arguments.texel_density.is_some();
    if !on_surface && arguments.weight.is_empty() {
        return None;
    }
    let charts = charts_apart(uvs, files);
    let mut largest = vec![0.0_f64; members.len()];
    for (&chart, &(file, t)) in charts.iter().zip(members) {
        let largest = &mut largest[chart as usize];
        *largest = largest.max(sources[file].factors[t as usize]);
    }
    let of_triangle = |(t, (&chart, &(file, own))): (usize, (&u32, &(usize, u32)))| {
        let area = match on_surface {
            true => sources[file].areas[own as usize],
            false => uvs.area(t),
        };
        area * largest[chart as usize].powi(2)
    };
    let all = charts.iter().zip(members).enumerate();
    Some(all.map(of_triangle).collect())
}

fn repack(
    arguments: &args::Pack,
    uvs: &UvMap,
    files: &[u32],
    areas: Option<&[f64]>,
    tiles: u32,
    first_tile: u32,
) -> Result<Repacked, Failure> {
    let size = match arguments.texel_density {
        Some(density) if arguments.udim > 1 => Size::Tiles { density },
        Some(density) => Size::Side { density },
        None => Size::Largest {
            tiles,
            at_most: f64::INFINITY,
        },
    };
    let options = PackOptions {
        size,
        whole_texels: arguments.whole_texels,
        first_tile,
        ..PackOptions::new(arguments.margin, arguments.resolution)
    };
    let result = repacked(uvs, files, areas, arguments.turns.into(), &options);
    let result = result.map_err(Failure::input)?;
    let needed = result.tiles;
    match needed > tiles {
        true => Err(Failure::input(PackError::MoreTiles { needed, tiles })),
        false => Ok(result),
    }
}

/// A chart that is mirrored or overlaps itself, for the user to find.
fn named(chart: &ChartFlaws, sources: &[Source], members: &[(usize, u32)]) -> String {
    let (file, triangle) = members[chart.first_triangle as usize];
    let source = &sources[file];
    let material = match source.material(triangle) {
        Some(name) => format!(", material {name:?}"),
        None => String::new(),
    };
    let overlaps = |count: u64| match count {
        0 => None,
        1 => Some(String::from("one pair of its triangles overlaps")),
        count => Some(format!("{count} pairs of its triangles overlap")),
    };
    let mirrored = chart.is_mirrored.then(|| String::from("it is mirrored"));
    let flaws: Vec<String> = mirrored
        .into_iter()
        .chain(overlaps(chart.overlapping))
        .collect();
    format!(
        "{}: the chart of {} triangles from number {triangle}{material}: {}",
        source.path.display(),
        chart.triangles,
        flaws.join(", ")
    )
}

impl SquareSummary {
    fn line(&self) -> String {
        let material = match &self.material {
            Some(name) => format!("material {name:?}: "),
            None => String::new(),
        };
        let tiles = match self.tiles {
            1 => String::new(),
            tiles => format!(" of {tiles} tiles"),
        };
        format!(
            "{material}{} charts cover {:.0} %{tiles} at {} texels, {} texels apart",
            self.charts,
            100.0 * self.coverage,
            self.resolution,
            self.margin
        )
    }
}
