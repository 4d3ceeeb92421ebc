//! The layout of a surface, with or without a map that says where to cut.

use std::collections::BTreeSet;

use fam_layout::{
    Beside, CloudLayout, LayoutConfig, Marks, MeshInput, MeshLayout, lay_out, lay_out_cloud,
};
use fam_surface::metrics::seam_edges;
use fam_surface::seams::{SeamRule, SeamThreshold, Seams};
use fam_surface::{Components, Normalization, PointCloud, SurfaceError, TriangleMesh, UvMap};
use serde::Serialize;

use crate::error::UnwrapError;
use crate::options::Options;
use crate::progress::Watch;

/// The UVs of a surface.
#[derive(Debug, Clone, PartialEq)]
pub enum Uvs {
    /// Of a mesh: a UV for every corner.
    Mesh(UvMap),
    /// Of a point cloud: one for each point.
    Points(Vec<[f32; 2]>),
}

/// How a surface was laid out.
#[derive(Debug, Clone)]
pub struct LaidOut {
    /// What was asked for.
    pub config: LayoutConfig,
    /// Whether it was stopped before the seams were as short as they could be.
    pub stopped: bool,
    /// What came of marked edges, if there were any.
    pub marks: Option<MarksReport>,
    /// The charts of every component.
    pub layout: MeshLayout,
    /// Of a cloud: points that have no place in the surface and keep the raw map's UVs.
    pub unreached: Option<usize>,
}

/// What came of marked edges.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct MarksReport {
    /// Edges along which a seam was wanted.
    pub wanted: usize,
    /// Edges that were not to be cut.
    pub forbidden: usize,
    /// How many of those were cut all the same.
    pub forbidden_cut: usize,
}

impl MarksReport {
    fn of(marks: &Marks, seams: &[[u32; 2]]) -> Option<Self> {
        let (wanted, forbidden) = (marks.wanted().len(), marks.forbidden().len());
        (wanted + forbidden > 0).then(|| Self {
            wanted,
            forbidden,
            forbidden_cut: marks.forbidden_among(seams),
        })
    }
}

/// UVs and where they cut the surface.
pub struct Placed {
    pub uvs: Uvs,
    pub seams: Seams,
    pub thresholds: Vec<Option<SeamThreshold>>,
    /// None for a raw map.
    pub laid_out: Option<LaidOut>,
}

/// Lays out a mesh; `map` says where to cut, `cuts` are the edges between components, and charts
/// `beside` stay where they are.
pub fn mesh(
    options: &Options,
    components: &Components,
    map: Option<&[Vec<[f32; 2]>]>,
    cuts: &[[u32; 2]],
    beside: Option<Beside>,
    watch: &mut Watch,
) -> Result<Placed, UnwrapError> {
    let input = MeshInput {
        map,
        squares: &options.parting.squares,
        weights: &options.parting.weights,
        marks: &options.marks,
        beside,
        ..MeshInput::of(components)
    };
    let layout = lay_out(&options.layout, &input, &mut |now| watch.lays_out(now))?;
    let maps: Vec<UvMap> = layout.components.iter().map(|c| c.uvs.clone()).collect();
    let seams = Seams::of_components(components, &maps, cuts)?;
    Ok(Placed {
        uvs: Uvs::Mesh(components.uv_map(&maps)?),
        thresholds: vec![None; maps.len()],
        laid_out: Some(LaidOut {
            config: options.layout.clone(),
            stopped: watch.stopped,
            marks: MarksReport::of(&options.marks, &seams.edges),
            layout,
            unreached: None,
        }),
        seams,
    })
}

/// A mesh whose UVs all stay.
pub fn untouched(
    options: &Options,
    mesh: &TriangleMesh,
    uvs: &UvMap,
) -> Result<Placed, SurfaceError> {
    Ok(Placed {
        seams: seams(mesh, uvs)?,
        uvs: Uvs::Mesh(uvs.clone()),
        thresholds: Vec::new(),
        laid_out: Some(LaidOut {
            config: options.layout.clone(),
            stopped: false,
            marks: None,
            layout: MeshLayout {
                components: Vec::new(),
                squares: Vec::new(),
            },
            unreached: None,
        }),
    })
}

/// Where UVs cut a mesh.
pub fn seams(mesh: &TriangleMesh, uvs: &UvMap) -> Result<Seams, SurfaceError> {
    let edges = seam_edges(mesh, uvs)?;
    let points: BTreeSet<u32> = edges.iter().flatten().copied().collect();
    Ok(Seams {
        points: points.into_iter().collect(),
        edges,
    })
}

/// Lays out a point cloud that a map gives the UVs `raw`.
pub fn cloud(
    options: &Options,
    cloud: &PointCloud,
    raw: &[[f32; 2]],
    watch: &mut Watch,
) -> Result<Placed, UnwrapError> {
    let points = cloud.points();
    let CloudLayout {
        uvs,
        unreached,
        atlas,
    } = lay_out_cloud(&options.layout, points, raw, &mut |now| watch.lays_out(now))?;
    let normalization = Normalization::of(points)?;
    let (seams, threshold) = point_seams(options.seam_rule, points, &uvs, &normalization);
    Ok(Placed {
        uvs: Uvs::Points(uvs),
        seams,
        thresholds: vec![Some(threshold)],
        laid_out: Some(LaidOut {
            config: options.layout.clone(),
            stopped: watch.stopped,
            marks: None,
            layout: atlas,
            unreached: Some(unreached),
        }),
    })
}

/// Where points are cut apart, and by what threshold in input units.
fn point_seams(
    rule: SeamRule,
    points: &[[f64; 3]],
    uvs: &[[f32; 2]],
    normalization: &Normalization,
) -> (Seams, SeamThreshold) {
    let placed: Vec<_> = points.iter().map(|&p| normalization.apply(p)).collect();
    let threshold = SeamThreshold::of(rule, &placed, uvs);
    let in_input_units = SeamThreshold {
        spacing: threshold.spacing.map(|s| s * normalization.radius),
        ..threshold
    };
    (Seams::of_points(&placed, uvs, threshold), in_input_units)
}
