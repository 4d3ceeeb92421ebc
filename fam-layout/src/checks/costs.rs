//! What seams cost: creases, hard edges, paint.

use super::marked::edges_where;
use super::{Task, moved};
use crate::LayoutConfig;
use fam_surface::shapes::{cube, open_cylinder};

#[test]
fn a_cube_is_cut_at_its_right_angles_where_hard_angles_are() {
    for (angle, charts) in [(89.0, 6), (90.0, 6), (91.0, 1)] {
        let task = Task {
            config: LayoutConfig {
                hard_angle: Some(angle),
                ..LayoutConfig::default()
            },
            ..Task::default()
        };
        let outcome = task.run(&cube(3));
        assert_eq!(outcome.charts(), charts, "at {angle} degrees");
    }
}

/// Turned, its corners are rounded.
#[test]
fn right_angles_count_however_positions_are_rounded() {
    let (sin, cos) = 0.7_f64.sin_cos();
    let turned = moved(&cube(2), |&[x, y, z]| {
        let [x, y] = [cos * x - sin * y, sin * x + cos * y];
        [x, cos * y - sin * z, sin * y + cos * z].map(|c| f64::from(c as f32))
    });
    let task = Task {
        config: LayoutConfig {
            hard_angle: Some(90.0),
            ..LayoutConfig::default()
        },
        ..Task::default()
    };
    assert_eq!(task.run(&turned).charts(), 6);
}

#[test]
fn forbidden_edges_are_not_hard() {
    let cube = cube(3);
    let top = edges_where(&cube, |ends| ends.iter().all(|p| p[2] == 1.0));
    let task = Task {
        config: LayoutConfig {
            hard_angle: Some(90.0),
            ..LayoutConfig::default()
        },
        forbidden: &top,
        ..Task::default()
    };
    let outcome = task.run(&cube);
    let seams = outcome.seam_edges();
    assert!(top.iter().all(|edge| !seams.contains(edge)));
}

/// It could be unrolled along any of its lines.
#[test]
fn a_cylinder_is_unrolled_along_its_hard_line() {
    let cylinder = open_cylinder(1.0, 2.0, 24, 9);
    for step in [3, 11, 20] {
        let angle = std::f64::consts::TAU * f64::from(step) / 24.0;
        let is_there = |p: &[f64; 3]| (p[0] - angle.cos()).hypot(p[1] - angle.sin()) < 1e-6;
        let line = edges_where(&cylinder, |ends| ends.iter().all(is_there));
        assert_eq!(line.len(), 9);
        let task = Task {
            hard: &line,
            ..Task::default()
        };
        assert_eq!(task.run(&cylinder).seam_edges(), line);
    }
}

#[test]
fn seams_avoid_what_is_painted() {
    let cylinder = open_cylinder(1.0, 2.0, 24, 9);
    for angle in [0.5_f64, 2.0, 5.0] {
        let towards = move |p: [f64; 3]| p[0] * angle.cos() + p[1] * angle.sin();
        let paint = move |p: [f64; 3]| f64::from(u8::from(towards(p) < 0.8));
        let task = Task {
            paint: Some(&paint),
            ..Task::default()
        };
        let outcome = task.run(&cylinder);
        let seams = outcome.seams();
        assert!(!seams.is_empty());
        assert!(seams.iter().flatten().all(|&p| towards(p) > 0.79));
    }
}

#[test]
fn creases_are_cut_more_the_more_they_count() {
    let cube = cube(8);
    let on_creases = |weight: f64| {
        let task = Task {
            config: LayoutConfig {
                crease_weight: weight,
                ..LayoutConfig::default()
            },
            ..Task::default()
        };
        let outcome = task.run(&cube);
        let seams = outcome.seams();
        let is_crease = |ends: &&[[f64; 3]; 2]| {
            let on_side = |k: usize| ends[0][k] == ends[1][k] && [0.0, 1.0].contains(&ends[0][k]);
            (0..3).filter(|&k| on_side(k)).count() == 2
        };
        seams.iter().filter(is_crease).count() as f64 / seams.len() as f64
    };
    let [none, usual, much] = [0.0, 1.0, 8.0].map(on_creases);
    assert!(
        none <= usual && usual <= much && none < much,
        "{none} {usual} {much}"
    );
}
