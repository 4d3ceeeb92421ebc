use std::ops::ControlFlow;

use rand::{RngExt, SeedableRng};

use super::*;
use crate::refine::problem::Problem;
use fam_surface::{TriangleMesh, shapes};

/// The charts of a mesh; panics if a chart is not valid or above the bound.
fn charts(mesh: &TriangleMesh) -> Vec<Piece> {
    let patch = Patch::of(mesh);
    let mut observe = |_| ControlFlow::Continue(());
    let mut observe: &mut (dyn FnMut(_) -> _ + Send) = &mut observe;
    let watch = Watch::new(1, &mut observe);
    let pieces = divided(&patch, 4.1, &watch).unwrap();
    let mut all: Vec<u32> = Vec::new();
    for piece in &pieces {
        let own = patch.subset(&piece.triangles);
        let goes_on = || true;
        let mut problem = Problem::new(&own, own.lengths.clone(), &goes_on);
        problem.injective = true;
        assert!(problem.is_valid(&piece.layout));
        assert!(piece.layout.energy <= 4.1, "{}", piece.layout.energy);
        all.extend(&piece.triangles);
    }
    all.sort_unstable();
    assert_eq!(all, (0..patch.areas.len() as u32).collect::<Vec<u32>>());
    pieces
}

/// Not always into one chart: what is joined first may be in the way of the rest.
#[test]
fn a_box_unfolds() {
    let pieces = charts(&shapes::cube(4));
    assert!(pieces.len() <= 2, "{}", pieces.len());
    for piece in pieces {
        assert!(piece.layout.energy < 4.001);
    }
}

#[test]
fn what_rolls_is_unrolled_within_the_bound() {
    assert!(charts(&shapes::open_cylinder(1.0, 3.0, 24, 6)).len() <= 2);
    assert!(charts(&shapes::torus(1.0, 0.4, 36, 18)).len() < 40);
}

/// A square sheet of so many cells along each side, with heights that have nothing to do with each
/// other.
pub(super) fn noise(cells: u32, height: f64) -> TriangleMesh {
    let sheet = shapes::rectangle(1.0, 1.0, cells, cells);
    let mut random = rand_pcg::Pcg64::seed_from_u64(1);
    let place = |p: &[f64; 3]| [p[0], p[1], random.random_range(0.0..height)];
    let positions = sheet.positions().iter().map(place).collect();
    TriangleMesh::new(positions, sheet.triangles().to_vec()).unwrap()
}

/// Where each step that makes charts fewer counts: without the last there are 59.
#[test]
fn a_rough_surface_has_few_charts_within_the_bound() {
    let pieces = charts(&noise(30, 0.132));
    assert!(pieces.len() < 55, "{}", pieces.len());
}
