//! Surfaces that have no layout within the bound in one piece, or whose embedding collapses.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::{Task, moved};
use crate::cut::test_surfaces::cubes;
use fam_surface::TriangleMesh;
use fam_surface::shapes::rectangle;

/// Six square arms of so many cubes, along the axes.
fn star(arm: i32) -> TriangleMesh {
    let is_solid = |cell: [i32; 3]| cell.iter().filter(|&&c| c != arm).count() <= 1;
    cubes([2 * arm + 1; 3], is_solid).swap_remove(0)
}

/// Along a limb fifty times as long as wide an embedding shrinks by more than double precision
/// has digits.
#[test]
fn long_limbs_do_not_collapse() {
    let outcome = Task::default().run(&star(50));
    outcome.check_energy();
    assert!(outcome.energy() <= 4.1, "{}", outcome.energy());
    assert!(outcome.charts() <= 3, "{}", outcome.charts());
}

/// A surface of genus 16 with right angles everywhere.
#[test]
fn a_frame_with_many_openings_is_within_the_bound() {
    let frame = cubes([9, 9, 1], |[x, y, _]| x % 2 == 0 || y % 2 == 0).swap_remove(0);
    let outcome = Task::default().run(&frame);
    outcome.check_energy();
    assert!(outcome.energy() <= 4.1, "{}", outcome.energy());
    assert!(outcome.charts() <= 30, "{}", outcome.charts());
}

/// Steps of random heights over a square grid, their walls undivided: four walls that meet in a
/// column have no common vertices but at their ends.
fn steps_with_t_junctions(size: usize) -> TriangleMesh {
    let mut random = Pcg64::seed_from_u64(1);
    let heights: Vec<i32> = (0..size * size)
        .map(|_| random.random_range(1..=6))
        .collect();
    let height = |i: usize, j: usize| heights[size * i + j];
    let mut quads: Vec<[[i32; 3]; 4]> = Vec::new();
    for i in 0..size {
        for j in 0..size {
            let (x, y, z) = (i as i32, j as i32, height(i, j));
            quads.push([[x, y, z], [x + 1, y, z], [x + 1, y + 1, z], [x, y + 1, z]]);
            if i + 1 < size && height(i + 1, j) != z {
                let (x, low) = (x + 1, height(i + 1, j));
                quads.push([[x, y, z], [x, y, low], [x, y + 1, low], [x, y + 1, z]]);
            }
            if j + 1 < size && height(i, j + 1) != z {
                let (y, low) = (y + 1, height(i, j + 1));
                quads.push([[x, y, z], [x + 1, y, z], [x + 1, y, low], [x, y, low]]);
            }
        }
    }
    let mut places: Vec<[i32; 3]> = quads.iter().flatten().copied().collect();
    places.sort_unstable();
    places.dedup();
    let vertex = |p: [i32; 3]| places.partition_point(|q| *q < p) as u32;
    let triangles = quads.iter().flat_map(|quad| {
        let [a, b, c, d] = quad.map(vertex);
        [[a, b, c], [a, c, d]]
    });
    let positions = places.iter().map(|p| p.map(f64::from)).collect();
    TriangleMesh::new(positions, triangles.collect()).unwrap()
}

#[test]
fn steps_with_t_junctions_are_within_the_bound() {
    let outcome = Task::default().run(&steps_with_t_junctions(12));
    outcome.check_energy();
    assert!(outcome.energy() <= 4.1, "{}", outcome.energy());
    assert!(outcome.charts() <= 80, "{}", outcome.charts());
}

/// So rough that every triangle points elsewhere.
#[test]
fn a_rough_sheet_is_within_the_bound() {
    let mut random = Pcg64::seed_from_u64(5);
    let rough = moved(&rectangle(1.0, 1.0, 20, 20), |&[x, y, _]| {
        [x, y, random.random_range(0.0..0.2)]
    });
    let outcome = Task::default().run(&rough);
    outcome.check_energy();
    assert!(outcome.energy() <= 4.1, "{}", outcome.energy());
    assert!(outcome.charts() <= 200, "{}", outcome.charts());
}

/// The bound is missed then.
#[test]
fn no_more_charts_than_allowed() {
    let mut task = Task::default();
    task.config.max_charts = Some(2);
    let outcome = task.run(&steps_with_t_junctions(6));
    outcome.check_energy();
    assert!(outcome.charts() <= 2, "{}", outcome.charts());
}
