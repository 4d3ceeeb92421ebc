//! The charts of a component that is the mirror image of another.

use super::Mirror;
use super::chart::{Winding, judged};
use crate::component::FlatChart;
use fam_surface::TriangleMesh;
use fam_surface::symmetry::{Match, Pairing};

/// The mirror images of all charts of the component `of`, over the `mesh` that is its mirror image; none
/// if they are not valid there.
pub fn image_of(
    mesh: &TriangleMesh,
    charts: &[FlatChart],
    of: usize,
    pairing: &Pairing,
) -> Option<(Vec<FlatChart>, Vec<Mirror>)> {
    let all: Vec<u32> = (0..mesh.triangles().len() as u32).collect();
    let images = images(mesh, charts, &all, pairing)?;
    let of = (0..images.len()).map(|chart| Mirror::Of {
        component: of,
        chart,
    });
    let mirrors = of.collect();
    Some((images, mirrors))
}

/// The mirror images of charts over some triangles of a mesh.
pub fn images(
    mesh: &TriangleMesh,
    charts: &[FlatChart],
    triangles: &[u32],
    pairing: &Pairing,
) -> Option<Vec<FlatChart>> {
    // The chart of every corner of the first mesh, and its point there.
    let mut places: Vec<Option<(u32, u32)>> = vec![None; 3 * pairing.corners.len()];
    for (k, chart) in (0..).zip(charts) {
        for (&t, corners) in chart.source.iter().zip(&chart.triangles) {
            for (c, &point) in (0..).zip(corners) {
                places[(3 * t + c) as usize] = Some((k, point));
            }
        }
    }
    let image = |chart: &FlatChart| FlatChart {
        uvs: chart.uvs.iter().map(|&[u, v]| [-u, v]).collect(),
        triangles: Vec::new(),
        source: Vec::new(),
        distortion: chart.distortion,
        is_straight: chart.is_straight,
    };
    let mut images: Vec<FlatChart> = charts.iter().map(image).collect();
    let mut whole: Vec<bool> = vec![pairing.exactness == Match::Exact; charts.len()];
    for &u in triangles {
        let own = pairing.corners[u as usize];
        let [a, b, c] = own.map(|corner| places[corner as usize]);
        let all = [a?, b?, c?];
        let [(k, _), ..] = all;
        if all.iter().any(|(other, _)| *other != k) {
            return None;
        }
        whole[k as usize] &= own.iter().all(|corner| corner / 3 == own[0] / 3);
        images[k as usize]
            .triangles
            .push(all.map(|(_, point)| point));
        images[k as usize].source.push(u);
    }
    let winding = Winding::of(mesh);
    for (image, is_exact) in images.iter_mut().zip(whole) {
        if image.triangles.is_empty() || !winding.is_positive(image) {
            return None;
        }
        if !is_exact {
            image.distortion = judged(mesh, image)?;
        }
    }
    Some(images)
}
