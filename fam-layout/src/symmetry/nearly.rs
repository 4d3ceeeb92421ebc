//! A component that is nearly its own mirror image, without vertices that correspond.
//!
//! One half of it and the mirror image of that half make up a proxy that is exactly symmetric. The seams
//! of the proxy's layout are carried to the component, which is flattened along them. Its charts are then
//! turned to lie as the proxy's do.

use std::collections::{BTreeMap, HashMap, HashSet};

use super::Mirror;
use super::carried::carried;
use super::chart::Winding;
use super::halves::{Symmetric, charts_of_both_halves};
use super::places::Frame;
use super::proxy::Proxy;
use crate::component::{FlatChart, Task, flat_charts};
use crate::marks::ComponentMarks;
use crate::part::Part;
use crate::{LayoutConfig, Stack};
use fam_surface::TriangleMesh;
use fam_surface::neighbors::nearest;
use fam_surface::symmetry::MirrorPlane;
use fam_surface::vector::{dot, scale, sub};

/// How far the energy of the proxy may be above that of an isometry, as a share of what the bound
/// allows: the component itself is not quite symmetric, and the same seams serve it less well.
const SHARE: f64 = 0.9;

/// A mesh of fewer triangles has too few edges for seams that are mirror images of others.
pub const FEW: usize = 200;

/// Charts of a component whose seams are about mirror images at a plane, turned so that they lie as mirror
/// images. `None` if it has few triangles, if it or its proxy has no such layout within what is allowed, or
/// if refining is not to go on.
pub fn nearly_symmetric_charts(
    task: &Task,
    plane: &MirrorPlane,
) -> Option<(Vec<FlatChart>, Vec<Mirror>)> {
    if task.mesh.triangles().len() < FEW || !task.watch.goes_on() {
        return None;
    }
    let proxy = Proxy::of(task.mesh, plane, &heights(task, plane))?;
    let model = charts_of_proxy(task, plane, &proxy)?;
    let patch = task.marks.patch(&Part::whole(task.mesh), None, 0.0);
    let goes_on = || task.watch.goes_on();
    let seams = seams(&proxy.mesh, &model);
    let seams = carried(&proxy, &seams, task.mesh, &patch, &goes_on)?;
    let marks = ComponentMarks {
        wanted: &task.marks.wanted | &seams,
        forbidden: task.marks.forbidden.clone(),
        hard: task.marks.hard.clone(),
    };
    let charts = flat_charts(&Task {
        share: 1.0,
        marks: &marks,
        ..*task
    });
    let most = task.config.max_charts.unwrap_or(usize::MAX);
    if charts.len() > most {
        return None;
    }
    let charts = turned(task.mesh, charts, &proxy.mesh, &model);
    let mirrors = vec![Mirror::Nearly; charts.len()];
    Some((charts, mirrors))
}

/// The height of every vertex over the plane, positive on the side with more wanted seams.
fn heights(task: &Task, plane: &MirrorPlane) -> Vec<f64> {
    let positions = task.mesh.positions().iter();
    let heights: Vec<f64> = positions.map(|&p| plane.height(p)).collect();
    let wanted = &task.marks.wanted;
    let is_above = |[a, b]: &&[u32; 2]| heights[*a as usize] + heights[*b as usize] > 0.0;
    let above = wanted.iter().filter(is_above).count();
    match 2 * above < wanted.len() {
        true => heights.iter().map(|h| -h).collect(),
        false => heights,
    }
}

/// A symmetric layout of the proxy of a component, with what is known of this.
fn charts_of_proxy(task: &Task, plane: &MirrorPlane, proxy: &Proxy) -> Option<Vec<FlatChart>> {
    let sides = proxy.mesh.triangles().iter();
    let edges: HashSet<[u32; 2]> = sides
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    let marked = |marked: &HashSet<[u32; 2]>| -> HashSet<[u32; 2]> {
        let under = |edge: &[u32; 2]| proxy.edge_under(*edge);
        let is_marked = |edge: &&[u32; 2]| under(edge).is_some_and(|under| marked.contains(&under));
        edges.iter().filter(is_marked).copied().collect()
    };
    let marks = ComponentMarks {
        wanted: marked(&task.marks.wanted),
        forbidden: marked(&task.marks.forbidden),
        hard: marked(&task.marks.hard),
    };
    let origins = || proxy.origins.iter().map(|&v| v as usize);
    let map = task
        .map
        .map(|map| origins().map(|v| map[v]).collect::<Vec<_>>());
    let rates = task.rates.map(|rates| {
        // Seams cost on both sides what they cost on the mean of them.
        let images = images(task.mesh, plane);
        let rate = |v: usize| 0.5 * (rates[v] + rates[images[v] as usize]);
        origins().map(rate).collect::<Vec<_>>()
    });
    let config = LayoutConfig {
        distortion_bound: 4.0 + SHARE * (task.config.distortion_bound - 4.0),
        // Halves that do not correspond cannot share their place.
        stack: Stack::None,
        ..task.config.clone()
    };
    let symmetric = Symmetric {
        task: Task {
            config: &config,
            share: task.share,
            mesh: &proxy.mesh,
            map: map.as_deref(),
            marks: &marks,
            rates: rates.as_deref(),
            watch: task.watch,
        },
        placed: &proxy.mesh,
        pairing: &proxy.pairing,
        plane,
    };
    Some(charts_of_both_halves(&symmetric, 0)?.0)
}

/// For every vertex the one that is nearest to its mirror image; for those in no triangle any.
fn images(mesh: &TriangleMesh, plane: &MirrorPlane) -> Vec<u32> {
    let frame = Frame::of(mesh);
    let used = mesh.used_vertices();
    let normals = mesh.vertex_normals();
    let reflected = |v: usize| {
        let along = dot(normals[v], plane.normal());
        let normal = sub(normals[v], scale(plane.normal(), 2.0 * along));
        frame.place(plane.reflected(mesh.positions()[v]), normal)
    };
    let reflected: Vec<[f32; 6]> = (0..mesh.positions().len()).map(reflected).collect();
    let nearest = nearest(&frame.vertices(mesh, &used), &reflected);
    nearest.into_iter().map(|n| used[n as usize]).collect()
}

/// The edges of a mesh whose two sides lie apart in its charts.
fn seams(mesh: &TriangleMesh, charts: &[FlatChart]) -> Vec<[u32; 2]> {
    let mut sides: HashMap<[u32; 2], Vec<[u32; 3]>> = HashMap::new();
    for (k, chart) in (0..).zip(charts) {
        for (corners, &t) in chart.triangles.iter().zip(&chart.source) {
            let own = mesh.triangles()[t as usize];
            for (i, j) in [(0, 1), (1, 2), (2, 0)] {
                let (i, j) = if own[i] < own[j] { (i, j) } else { (j, i) };
                let side = [k, corners[i], corners[j]];
                sides.entry([own[i], own[j]]).or_default().push(side);
            }
        }
    }
    let is_seam = |sides: &[[u32; 3]]| sides.len() == 2 && sides[0] != sides[1];
    let mut seams: Vec<[u32; 2]> = sides
        .into_iter()
        .filter(|(_, sides)| is_seam(sides))
        .map(|(edge, _)| edge)
        .collect();
    seams.sort_unstable();
    seams
}

/// Charts of a mesh, each turned so that it lies as that chart of a mesh nearby does with which it has most
/// in common.
fn turned(
    mesh: &TriangleMesh,
    charts: Vec<FlatChart>,
    nearby: &TriangleMesh,
    model: &[FlatChart],
) -> Vec<FlatChart> {
    let frame = Frame::of(mesh);
    let nearest = nearest(&frame.middles(nearby), &frame.middles(mesh));
    let mut places: Vec<Option<(usize, [f64; 2])>> = vec![None; nearby.triangles().len()];
    for (k, chart) in model.iter().enumerate() {
        for (place, &t) in middles_in(chart).zip(&chart.source) {
            places[t as usize] = Some((k, place));
        }
    }
    let areas = mesh.triangle_areas();
    let winding = Winding::of(mesh);
    let turned = charts.into_iter().map(|chart| {
        let mut chart = winding.righted(chart);
        let mut pairs: BTreeMap<usize, Vec<Pair>> = BTreeMap::new();
        for (own, &t) in middles_in(&chart).zip(&chart.source) {
            if let Some((k, model)) = places[nearest[t as usize] as usize] {
                let weight = areas[t as usize];
                let of_model = pairs.entry(k).or_default();
                of_model.push(Pair { own, model, weight });
            }
        }
        let weight = |pairs: &Vec<Pair>| pairs.iter().map(|pair| pair.weight).sum::<f64>();
        let most = pairs.into_values().reduce(|best, one| {
            if weight(&one) > weight(&best) {
                one
            } else {
                best
            }
        });
        let [cos, sin] = most.map_or([1.0, 0.0], |pairs| rotation(&pairs));
        for [u, v] in &mut chart.uvs {
            [*u, *v] = [cos * *u - sin * *v, sin * *u + cos * *v];
        }
        chart
    });
    turned.collect()
}

/// The middles of the triangles of a chart.
fn middles_in(chart: &FlatChart) -> impl Iterator<Item = [f64; 2]> {
    chart.triangles.iter().map(|corners| {
        let [a, b, c] = corners.map(|v| chart.uvs[v as usize]);
        [0, 1].map(|k| (a[k] + b[k] + c[k]) / 3.0)
    })
}

/// A point of a chart, where the chart is that it is to lie as, and how much it counts.
struct Pair {
    own: [f64; 2],
    model: [f64; 2],
    weight: f64,
}

/// The cosine and the sine of the angle by which points are turned to lie about as their models do, up
/// to a shift; 0 if they have no weight.
fn rotation(pairs: &[Pair]) -> [f64; 2] {
    let total: f64 = pairs.iter().map(|pair| pair.weight).sum();
    if total <= 0.0 {
        return [1.0, 0.0];
    }
    let mean = |of: fn(&Pair) -> [f64; 2]| {
        [0, 1].map(|k| pairs.iter().map(|p| p.weight * of(p)[k]).sum::<f64>() / total)
    };
    let [own, model] = [mean(|pair| pair.own), mean(|pair| pair.model)];
    let (mut cos, mut sin) = (0.0, 0.0);
    for pair in pairs {
        let [a, b] = [pair.own[0] - own[0], pair.own[1] - own[1]];
        let [c, d] = [pair.model[0] - model[0], pair.model[1] - model[1]];
        cos += pair.weight * (a * c + b * d);
        sin += pair.weight * (a * d - b * c);
    }
    let (sin, cos) = sin.atan2(cos).sin_cos();
    [cos, sin]
}
