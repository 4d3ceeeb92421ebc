//! The layout of a mesh or a cloud, from its components to the packed square.

use std::ops::ControlFlow;

use rayon::prelude::*;

use crate::cloud::Reconstruction;
use crate::cloud::places::places;
use crate::component::FlatChart;
use crate::costs::rates::seam_rates;
use crate::distortion::Distortion;
use crate::flattening::Flattening;
use crate::pack::PackError;
use crate::placing::{Belonging, coverage, estimate, placed};
use crate::shape::{Shaping, Surface, is_shaped};
use crate::stack::{laid_upon, stacked};
use crate::symmetry::{Mirror, roles};
use crate::unit::{common_unit, half_extent, scaled};
use crate::watch::Watch;
use crate::{CloudLayout, ComponentLayout, LayoutConfig, MeshInput, MeshLayout, Progress};
use fam_surface::congruence::Congruence;
use fam_surface::vector::{length, sub};
use fam_surface::{Components, TriangleMesh, UvMap};

/// Of what the energy may be above that of an isometry, the share up to which surfaces are cut; the
/// rest is left for better angles, of which the first per cent brings most. A seam through a cloud
/// has no two sides that would have to match, it only tears the triangles along it; so it counts
/// for less there: conformality on a bust of 13,000 points is least at about this share.
const SHARE_OF_MESHES: f64 = 0.97;
const SHARE_OF_CLOUDS: f64 = 0.2;

/// Triangles from which on a component of a cloud is cut as a mesh is: scans of this size have noise
/// that no cut takes away, and to look for cuts all the same takes minutes.
const LARGE_CLOUD: usize = 60_000;

/// Finishes the raw map of a mesh. `observe` is called often, whether there is something new or
/// not; after it breaks off, nothing is refined any more. The result is valid all the same.
///
/// # Errors
/// The charts cannot be packed as asked: at a given texel density they need more room than there is, or
/// those that stay leave none.
///
/// # Panics
/// If the map does not fit the components.
pub fn lay_out(
    config: &LayoutConfig,
    unfinished: &MeshInput,
    observe: &mut (dyn FnMut(Progress) -> ControlFlow<()> + Send),
) -> Result<MeshLayout, PackError> {
    lay_out_within(config, |_| SHARE_OF_MESHES, unfinished, observe)
}

/// [`lay_out`], where a component of so many triangles is cut until a `share` of what the energy may
/// be above that of an isometry is reached; all of it is used for better angles then.
fn lay_out_within(
    config: &LayoutConfig,
    share: impl Fn(usize) -> f64 + Sync,
    unfinished: &MeshInput,
    observe: &mut (dyn FnMut(Progress) -> ControlFlow<()> + Send),
) -> Result<MeshLayout, PackError> {
    let list = &unfinished.components.list;
    let sizes: Vec<usize> = list.iter().map(|c| c.mesh.triangles().len()).collect();
    let unit = common_unit(list);
    let mut observe = observe;
    let watch = Watch::new(list.len(), &mut observe);
    watch.counts(&sizes);
    let copies = stacked(config.stack, unfinished);
    let rates = seam_rates(config, unfinished, &|| watch.goes_on());
    let square = |i: usize| unfinished.belonging(list[i].label).square;
    let flattening = Flattening {
        config,
        share: &share,
        input: unfinished,
        unit,
        rates: rates.as_deref(),
        watch: &watch,
    };
    let roles = roles(config.symmetry, unfinished.components, square);
    let (charts, mirrors) = flattening.charts(&roles, |i| copies[i].is_some());
    watch.packs();
    let belonging: Vec<Belonging> = list
        .iter()
        .map(|component| unfinished.belonging(component.label))
        .collect();
    let goes_on = || watch.goes_on();
    let squares: Vec<u32> = belonging.iter().map(|own| own.square).collect();
    let surfaces: Vec<Surface> = match is_shaped(config) {
        true => (0..list.len())
            .into_par_iter()
            .map(|i| Surface {
                mesh: scaled(&list[i].mesh, unit),
                marks: unfinished.marks.of_component(&list[i]),
                rates: rates.as_ref().map(|rates| rates[i].as_slice()),
                crease_weight: config.crease_weight,
            })
            .collect(),
        false => Vec::new(),
    };
    let shaping = Shaping {
        config,
        surfaces: &surfaces,
        coverage: &|charts| coverage(config, charts, &goes_on),
        estimate: &|charts| estimate(config, charts, &goes_on),
        pace: &watch,
    };
    let charts = all_but_symmetric(charts, &mirrors, |others| shaping.shaped(others, &squares));
    // Of a surface without extent any unit will do.
    let unit = if unit > 0.0 { 2.0 * unit } else { 1.0 };
    let placed = placed(
        config,
        unit,
        &charts,
        &mirrors,
        &belonging,
        unfinished.beside,
        &goes_on,
    )?;
    let originals: Vec<Option<ComponentLayout>> = (0..list.len())
        .into_par_iter()
        .map(|c| {
            let is_original = copies[c].is_none();
            is_original.then(|| finished(&list[c].mesh, &charts[c], &placed.uvs[c]))
        })
        .collect();
    let upon = |(c, copy): (usize, &Option<Congruence>)| {
        let copy = copy.as_ref()?;
        let layout = originals[copy.original].as_ref()?;
        Some(laid_upon(&list[c], copy, &list[copy.original], layout))
    };
    let upon: Vec<Option<ComponentLayout>> = copies.par_iter().enumerate().map(upon).collect();
    let all = originals.into_iter().zip(upon);
    let components = all.filter_map(|(own, upon)| own.or(upon)).collect();
    Ok(MeshLayout {
        components,
        squares: placed.squares,
    })
}

/// The charts of all components, those without symmetric charts changed: these would not be symmetric any
/// more.
fn all_but_symmetric(
    mut charts: Vec<Vec<FlatChart>>,
    mirrors: &[Vec<Mirror>],
    change: impl FnOnce(Vec<Vec<FlatChart>>) -> Vec<Vec<FlatChart>>,
) -> Vec<Vec<FlatChart>> {
    let mut is_symmetric = vec![false; charts.len()];
    for (c, mirror) in mirrors
        .iter()
        .enumerate()
        .flat_map(|(c, own)| own.iter().map(move |m| (c, m)))
    {
        is_symmetric[c] |= *mirror != Mirror::None;
        if let Mirror::Of { component, .. } = mirror {
            is_symmetric[*component] = true;
        }
    }
    let mut symmetric: Vec<Vec<FlatChart>> = charts.iter().map(|_| Vec::new()).collect();
    for c in (0..charts.len()).filter(|&c| is_symmetric[c]) {
        symmetric[c] = std::mem::take(&mut charts[c]);
    }
    let mut changed = change(charts);
    for c in (0..changed.len()).filter(|&c| is_symmetric[c]) {
        changed[c] = std::mem::take(&mut symmetric[c]);
    }
    changed
}

/// How far a component of a cloud is cut.
fn share_of_cloud(triangles: usize) -> f64 {
    match triangles < LARGE_CLOUD {
        true => SHARE_OF_CLOUDS,
        false => SHARE_OF_MESHES,
    }
}

/// A component put together from its charts; triangles of none lie at (0, 0).
fn finished(
    mesh: &TriangleMesh,
    charts: &[FlatChart],
    placed: &[Vec<[f32; 2]>],
) -> ComponentLayout {
    let mut uvs = Vec::new();
    let mut triangles = vec![[0; 3]; mesh.triangles().len()];
    for (chart, placed) in charts.iter().zip(placed) {
        let first = uvs.len() as u32;
        uvs.extend(placed);
        for (corners, &t) in chart.triangles.iter().zip(&chart.source) {
            triangles[t as usize] = corners.map(|v| first + v);
        }
    }
    if uvs.is_empty() {
        uvs.push([0.0; 2]);
    }
    // In a unit of its own no square of a length is out of range.
    let half_unit = half_extent(mesh);
    let own = scaled(mesh, half_unit);
    let in_input_units = |length: f64| 2.0 * (length * half_unit);
    let areas = own.triangle_areas();
    let area = |chart: &FlatChart| chart.source.iter().map(|&t| areas[t as usize]).sum::<f64>();
    let distortions: Vec<(Distortion, f64, usize)> = charts
        .iter()
        .map(|chart| (chart.distortion, area(chart), chart.source.len()))
        .collect();
    ComponentLayout {
        charts: charts.len(),
        distortion: Distortion::together(&distortions),
        root_area: in_input_units(areas.iter().sum::<f64>().sqrt()),
        seam_length: in_input_units(seam_length(&own, &triangles)),
        uvs: UvMap::new(uvs, triangles).unwrap_or_else(|_| flat(mesh)),
        stacked: None,
    }
}

/// A map without any extent.
fn flat(mesh: &TriangleMesh) -> UvMap {
    let none = UvMap::new(vec![[0.0; 2]], vec![[0; 3]; mesh.triangles().len()]);
    none.unwrap_or_else(|error| unreachable!("{error}"))
}

/// The length of the edges whose two sides lie apart in the plane.
fn seam_length(mesh: &TriangleMesh, uv_triangles: &[[u32; 3]]) -> f64 {
    let mut sides: Vec<([u32; 2], [u32; 2])> = mesh
        .triangles()
        .iter()
        .zip(uv_triangles)
        .flat_map(|(t, uv)| {
            [(0, 1), (1, 2), (2, 0)].map(|(i, j)| {
                let (i, j) = if t[i] < t[j] { (i, j) } else { (j, i) };
                ([t[i], t[j]], [uv[i], uv[j]])
            })
        })
        .collect();
    sides.sort_unstable();
    let apart = |pair: &&[([u32; 2], [u32; 2])]| pair.len() == 2 && pair[0].1 != pair[1].1;
    let at = |v: u32| mesh.positions()[v as usize];
    sides
        .chunk_by(|a, b| a.0 == b.0)
        .filter(apart)
        .map(|pair| pair[0].0)
        .map(|[a, b]| length(sub(at(b), at(a))))
        .fold(0.0, |sum, length| sum + length)
}

/// Finishes the raw map of a point cloud, one UV for each point, as [`lay_out`] does a mesh's:
/// the surface through the points is cut as little as the bound allows, and each point has the
/// UV of one of its triangles, chosen so that few triangles are torn. It is cut further than a
/// mesh: to a fifth of what the bound is above the energy of an isometry. If `observe` breaks off
/// before the surface is found, all points keep the raw map's UVs.
///
/// # Errors
/// As [`lay_out`].
pub fn lay_out_cloud(
    config: &LayoutConfig,
    points: &[[f64; 3]],
    raw: &[[f32; 2]],
    observe: &mut (dyn FnMut(Progress) -> ControlFlow<()> + Send),
) -> Result<CloudLayout, PackError> {
    let left = || {
        Ok(CloudLayout {
            uvs: raw.to_vec(),
            unreached: points.len(),
            atlas: MeshLayout {
                components: Vec::new(),
                squares: Vec::new(),
            },
        })
    };
    let found = {
        let mut observe = &mut *observe;
        let watch = Watch::of_reconstruction(&mut observe);
        Reconstruction::of(points, raw, &|| watch.goes_on())
    };
    let Ok(Some(reconstruction)) = found else {
        return left();
    };
    let Ok(components) = Components::of(&reconstruction.mesh, &[]) else {
        return left();
    };
    let own: Vec<Vec<[f32; 2]>> = components
        .list
        .iter()
        .map(|component| {
            component
                .vertices
                .iter()
                .map(|&v| raw[v as usize])
                .collect()
        })
        .collect();
    let unfinished = MeshInput {
        map: Some(&own),
        ..MeshInput::of(&components)
    };
    let atlas = lay_out_within(config, share_of_cloud, &unfinished, observe)?;
    let mut placed: Vec<Option<[f32; 2]>> = vec![None; points.len()];
    for (component, finished) in components.list.iter().zip(&atlas.components) {
        let own = places(&component.mesh, &finished.uvs);
        for (&v, place) in component.vertices.iter().zip(own) {
            placed[v as usize] = placed[v as usize].or(place);
        }
    }
    let of_point = |vertex: &Option<u32>| placed[(*vertex)? as usize];
    let uvs: Vec<Option<[f32; 2]>> = reconstruction.vertices.iter().map(of_point).collect();
    Ok(CloudLayout {
        unreached: uvs.iter().filter(|uv| uv.is_none()).count(),
        uvs: uvs
            .iter()
            .zip(raw)
            .map(|(uv, raw)| uv.unwrap_or(*raw))
            .collect(),
        atlas,
    })
}
