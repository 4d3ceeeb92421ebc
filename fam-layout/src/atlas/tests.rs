use std::ops::ControlFlow;

use super::*;
use crate::refine::problem::Problem;
use fam_surface::{TriangleMesh, shapes};

/// An atlas of a mesh; panics if a chart is not valid or above the bound.
fn atlas(mesh: &TriangleMesh) -> Vec<Piece> {
    let patch = Patch::of(mesh);
    let mut observe = |_| ControlFlow::Continue(());
    let mut observe: &mut (dyn FnMut(_) -> _ + Send) = &mut observe;
    let watch = Watch::new(1, &mut observe);
    let pieces = by_shape(&patch, 4.1, &watch).unwrap();
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
    let pieces = atlas(&shapes::cube(4));
    assert!(pieces.len() <= 3, "{}", pieces.len());
    for piece in pieces {
        assert!(piece.layout.energy < 4.0001);
    }
}

#[test]
fn what_rolls_is_unrolled_within_the_bound() {
    assert!(atlas(&shapes::open_cylinder(1.0, 3.0, 24, 6)).len() <= 2);
    assert!(atlas(&shapes::torus(1.0, 0.4, 36, 18)).len() < 40);
}
