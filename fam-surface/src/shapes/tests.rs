use std::f64::consts::{PI, TAU};

use super::*;
use crate::TriangleMesh;
use crate::vector::{cross, dot};

#[test]
fn areas_are_those_of_the_smooth_surfaces() {
    let area = |mesh: TriangleMesh| mesh.triangle_areas().iter().sum::<f64>();
    let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 5e-3, "{a} against {b}");
    near(area(torus(1.0, 0.4, 120, 60)), 4.0 * PI * PI * 0.4);
    near(area(open_cylinder(0.5, 2.0, 100, 4)), TAU);
    near(area(rectangle(2.0, 3.0, 4, 5)), 6.0);
    near(area(cone(3.0, 4.0, 100, 5)), 15.0 * PI);
    near(area(cube(7)), 6.0);
    near(area(sphere(24)), 2.0 * TAU);
    near(area(open_sphere(0.5, 100, 60)), TAU * (1.0 + 0.5_f64.cos()));
}

/// The signed volume is positive where triangles are counter-clockwise from outside.
#[test]
fn closed_surfaces_enclose_their_volume() {
    let volume = |mesh: TriangleMesh| {
        let signed = |t: usize| {
            let [a, b, c] = mesh.corners(t);
            dot(a, cross(b, c)) / 6.0
        };
        (0..mesh.triangles().len()).map(signed).sum::<f64>()
    };
    assert!((volume(cube(3)) - 1.0).abs() < 1e-12);
    assert!((volume(sphere(24)) / (4.0 / 3.0 * PI) - 1.0).abs() < 5e-3);
    let apex = cone(3.0, 4.0, 100, 5);
    let down = |p: &[f64; 3]| [p[0], p[1], p[2] - 4.0];
    let positions = apex.positions().iter().map(down).collect();
    let from_apex = TriangleMesh::new(positions, apex.triangles().to_vec()).unwrap();
    assert!(volume(from_apex).abs() < 1e-9);
    assert!((volume(apex) - 12.0 * PI).abs() < 0.1 * PI);
}
