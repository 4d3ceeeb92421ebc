//! Seams where little is seen.

use super::{Task, moved, together};
use crate::LayoutConfig;
use fam_surface::metrics::seam_visibility;
use fam_surface::shapes::{bucket, open_cylinder, rectangle, sphere};

fn hiding(seen_from: Option<[f64; 3]>) -> Task<'static> {
    Task {
        config: LayoutConfig {
            hide_seams: 1.0,
            seen_from,
            ..LayoutConfig::default()
        },
        ..Task::default()
    }
}

/// It could be unrolled along any line. The wall is as wide as the cylinder's radius, which hides the
/// lines within a sixth of a turn.
#[test]
fn a_cylinder_is_cut_behind_the_wall_that_stands_before_it() {
    for step in 0..4 {
        let angle = 0.3 + f64::from(step) * std::f64::consts::FRAC_PI_2;
        let (sin, cos) = angle.sin_cos();
        let wall = moved(&rectangle(1.0, 4.0, 2, 6), |&[x, y, _]| {
            [1.1 * cos - x * sin, 1.1 * sin + x * cos, y + 1.0]
        });
        let cylinder = open_cylinder(1.0, 2.0, 24, 9);
        let outcome = hiding(None).run(&together(&[cylinder, wall]));
        let seams = outcome.seams();
        assert!(!seams.is_empty());
        for p in seams.iter().flatten() {
            let towards = (p[0] * cos + p[1] * sin) / p[0].hypot(p[1]);
            assert!(towards > 0.5, "{towards} at {angle}");
        }
    }
}

#[test]
fn a_ball_is_cut_on_the_side_that_is_not_seen() {
    for z in [1.0, -1.0] {
        let outcome = hiding(Some([0.0, 0.0, z])).run(&sphere(8));
        let seams = outcome.seams();
        let heights = seams.iter().flatten().map(|p| z * p[2]);
        let mean = heights.sum::<f64>() / (2 * seams.len()) as f64;
        assert!(mean < -0.3, "{mean} from {z}");
    }
}

#[test]
fn the_seams_of_a_bucket_are_less_visible_and_not_much_longer() {
    let bucket = bucket(0.08);
    let measured = |task: Task| {
        let outcome = task.run(&bucket);
        outcome.check_energy();
        assert!(outcome.energy() <= 4.1, "{}", outcome.energy());
        let visibility = seam_visibility(&bucket, &outcome.uv).unwrap();
        (outcome.seam_length(), visibility.unwrap())
    };
    let (length, visibility) = measured(Task::default());
    let (hidden_length, hidden_visibility) = measured(hiding(None));
    assert!(
        hidden_visibility < 0.92 * visibility,
        "{hidden_visibility} {visibility}"
    );
    assert!(hidden_length < 1.15 * length, "{hidden_length} {length}");
}
