//! What seams cost for each unit of length: more where the surface is seen, and where somebody painted
//! that they shall not be.

use fam_surface::occlusion::Occluders;
use fam_surface::vector::{cross, length, sub};
use fam_surface::{Component, TriangleMesh};

use crate::{LayoutConfig, MeshInput};

/// How much more a seam costs at a weight of 1 where it is in full view, in multiples of what it costs
/// where it is hidden.
const IN_VIEW: f64 = 30.0;

/// The power of the visibility that a seam costs by. Most of a surface is in view, so that with the second
/// power what is half hidden costs hardly less than the rest.
const POWER: i32 = 3;

/// How much more a seam costs at a weight of 1 where it is painted with 1, in multiples of what it costs
/// where it is painted with 0.
const PAINTED: f64 = 10.0;

/// For every component what a seam costs at each of its vertices for each unit of length, 1 on average
/// over its area. It grows with a power of its [visibility](Occluders::visibility), and with what is
/// painted there. `None` if it is the same everywhere, and where `goes_on` says no.
pub fn seam_rates(
    config: &LayoutConfig,
    input: &MeshInput,
    goes_on: &(dyn Fn() -> bool + Sync),
) -> Option<Vec<Vec<f64>>> {
    let list = &input.components.list;
    let is_painted = config.paint_weight > 0.0 && !input.marks.paint().is_empty();
    let occluders = (config.hide_seams > 0.0)
        .then(|| Occluders::of(list.iter().map(|component| &component.mesh)));
    if occluders.is_none() && !is_painted {
        return None;
    }
    let rates = |component: &Component| {
        let mesh = &component.mesh;
        let mut rates = vec![1.0; mesh.positions().len()];
        if let Some(occluders) = &occluders {
            let visibility = occluders.visibility(mesh, config.seen_from, goes_on)?;
            for (rate, visible) in rates.iter_mut().zip(visibility) {
                *rate += config.hide_seams * IN_VIEW * visible.powi(POWER);
            }
        }
        if is_painted {
            for (rate, &vertex) in rates.iter_mut().zip(&component.vertices) {
                let paint = input.marks.paint().get(vertex as usize).copied();
                *rate += config.paint_weight * PAINTED * paint.unwrap_or(0.0);
            }
        }
        let mean = mean(mesh, &rates);
        Some(rates.into_iter().map(|rate| rate / mean).collect())
    };
    list.iter().map(rates).collect()
}

/// The mean over the area of a mesh of what its vertices have; 1 without any area.
fn mean(mesh: &TriangleMesh, values: &[f64]) -> f64 {
    let coordinates = mesh.positions().iter().flatten();
    // In this unit no area overflows.
    let unit = coordinates.fold(0.0_f64, |largest, c| largest.max(0.5 * c.abs()));
    let (mut sum, mut area) = (0.0, 0.0);
    for (t, triangle) in mesh.triangles().iter().enumerate() {
        let [a, b, c] = mesh.corners(t).map(|p| p.map(|x| 0.5 * x / unit));
        let own = 0.5 * length(cross(sub(b, a), sub(c, a)));
        let value: f64 = triangle.iter().map(|&v| values[v as usize]).sum();
        sum += own * value / 3.0;
        area += own;
    }
    if area > 0.0 { sum / area } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Marks;
    use fam_surface::{Components, shapes};

    fn rates_of(components: &Components, config: &LayoutConfig, marks: &Marks) -> Option<Vec<f64>> {
        let input = MeshInput {
            marks,
            ..MeshInput::of(components)
        };
        let mut all = seam_rates(config, &input, &|| true)?;
        assert_eq!(all.len(), 1);
        all.pop()
    }

    fn hiding() -> LayoutConfig {
        LayoutConfig {
            hide_seams: 1.0,
            ..LayoutConfig::default()
        }
    }

    #[test]
    fn seams_cost_more_where_they_are_seen_and_on_average_as_much_as_elsewhere() {
        let bucket = shapes::bucket(0.1);
        let components = Components::of(&bucket, &[]).unwrap();
        let rates = rates_of(&components, &hiding(), &Marks::default()).unwrap();
        let mesh = &components.list[0].mesh;
        let mean = mean(mesh, &rates);
        assert!((mean - 1.0).abs() < 1e-9);
        let light = Occluders::of([mesh])
            .visibility(mesh, None, &|| true)
            .unwrap();
        let (darkest, lightest) = (0..light.len()).fold((0, 0), |(low, high), v| {
            let low = if light[v] < light[low] { v } else { low };
            (low, if light[v] > light[high] { v } else { high })
        });
        let ratio = rates[lightest] / rates[darkest];
        let rate = |v: usize| 1.0 + 30.0 * light[v].powi(3);
        let expected = rate(lightest) / rate(darkest);
        assert!((ratio - expected).abs() < 1e-9 && ratio > 4.0, "{ratio}");
    }

    #[test]
    fn a_convex_surface_is_alike_all_over() {
        let components = Components::of(&shapes::sphere(8), &[]).unwrap();
        let rates = rates_of(&components, &hiding(), &Marks::default()).unwrap();
        assert!(rates.iter().all(|rate| (rate - 1.0).abs() < 1e-12));
    }

    #[test]
    fn seams_cost_more_where_that_is_painted() {
        let sheet = shapes::rectangle(1.0, 1.0, 6, 6);
        let components = Components::of(&sheet, &[]).unwrap();
        let config = LayoutConfig::default();
        assert_eq!(rates_of(&components, &config, &Marks::default()), None);
        // What is no share counts as the nearest.
        let paint = |v: usize| [0.0, 0.5, 1.0, -3.0, 7.0, f64::NAN][v % 6];
        let count = sheet.positions().len();
        let marks = Marks::default().with_paint((0..count).map(paint).collect());
        let rates = rates_of(&components, &config, &marks).unwrap();
        let ratio = |v: usize| rates[v] / rates[0];
        let expected = [1.0, 6.0, 11.0, 1.0, 11.0, 1.0];
        let vertices = &components.list[0].vertices;
        assert_eq!(vertices[0], 0);
        for (own, &v) in (0..).zip(vertices) {
            assert!((ratio(own) - expected[v as usize % 6]).abs() < 1e-9);
        }
        let without = LayoutConfig {
            paint_weight: 0.0,
            ..config
        };
        assert_eq!(rates_of(&components, &without, &marks), None);
    }
}
