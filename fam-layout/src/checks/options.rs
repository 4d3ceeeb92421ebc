//! Every option alone and with every other one: the result is valid and within the bound.

use rand::SeedableRng;
use rand_pcg::Pcg64;

use super::random::{closed, jittered};
use super::symmetric::glued;
use super::{Outcome, Task, moved, part, smoothed, subdivided, together};
use crate::{Stack, Symmetry};
use fam_surface::TriangleMesh;

/// An option by its name on the command line, and how it is set.
type Setting = (&'static str, fn(&mut Task));

const OPTIONS: [Setting; 16] = [
    ("hide-seams", |task| task.config.hide_seams = 1.0),
    ("seen-from", |task| {
        task.config.hide_seams = 3.0;
        task.config.seen_from = Some([0.2, -1.0, 0.3]);
    }),
    ("paint", |task| task.paint = Some(&painted)),
    ("hard-angle", |task| task.config.hard_angle = Some(70.0)),
    ("crease-weight", |task| task.config.crease_weight = 6.0),
    ("max-charts", |task| task.config.max_charts = Some(2)),
    ("symmetry", |task| task.config.symmetry = Symmetry::X),
    ("stack identical", |task| {
        task.config.stack = Stack::Identical;
    }),
    ("stack mirrored", |task| {
        task.config.stack = Stack::Mirrored;
    }),
    ("straighten", |task| task.config.straighten = true),
    ("upright", |task| {
        task.config.upright = Some([0.0, 0.0, 1.0]);
    }),
    ("coverage-weight", |task| task.config.coverage_weight = 1.0),
    ("whole-texels", |task| task.config.whole_texels = true),
    ("texel-density", |task| {
        task.config.texel_density = Some(8.0);
    }),
    ("udim", |task| task.config.tiles = 3),
    ("distortion-bound", |task| {
        task.config.distortion_bound = 4.3;
    }),
];

fn painted([x, y, z]: [f64; 3]) -> f64 {
    0.5 + 0.5 * (2.0 * x + y).sin() * (z + 0.3 * y).cos()
}

/// What is symmetric about a surface.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// Nothing: it is there twice, the second time turned.
    Copied,
    /// Its vertices at x = 0.
    Symmetric,
    /// Its shape at x = 0, but one side has more vertices.
    Uneven,
}

/// The surface of random cells. Open surfaces lack their upper half.
fn surface(is_open: bool, kind: Kind, random: &mut Pcg64) -> TriangleMesh {
    let mut solid = loop {
        let solids = closed(random);
        // Half of it, open, and with one side divided still has 200 triangles.
        let sizes = match kind {
            Kind::Uneven => 56..96,
            Kind::Copied | Kind::Symmetric => 24..56,
        };
        let sizes = |mesh: &TriangleMesh| sizes.contains(&mesh.triangles().len());
        if let Some(solid) = solids.into_iter().find(sizes) {
            break smoothed(&subdivided(&solid), 1);
        }
    };
    if is_open {
        let middle = mean(&solid, 2);
        solid = part(&solid, |p| p[2] < middle);
    }
    if kind != Kind::Copied {
        let middle = mean(&solid, 0);
        let half = part(&solid, |p| p[0] > middle);
        let whole = glued(&moved(&half, |p| [(p[0] - middle).max(0.0), p[1], p[2]]));
        return match kind {
            Kind::Uneven => divided_below_0(&whole),
            Kind::Copied | Kind::Symmetric => whole,
        };
    }
    let solid = jittered(&solid, 0.03, random);
    let away = moved(&solid, |p| [p[1] + 9.0, -p[0], p[2]]);
    together(&[solid, away])
}

/// A mesh with its triangles at negative x divided in three.
fn divided_below_0(mesh: &TriangleMesh) -> TriangleMesh {
    let (mut positions, mut triangles) = (mesh.positions().to_vec(), Vec::new());
    for (t, &[a, b, c]) in mesh.triangles().iter().enumerate() {
        let corners = mesh.corners(t);
        let middle = [0, 1, 2].map(|k| corners.iter().map(|p| p[k]).sum::<f64>() / 3.0);
        if middle[0] >= 0.0 {
            triangles.push([a, b, c]);
            continue;
        }
        let d = positions.len() as u32;
        positions.push(middle);
        triangles.extend([[a, b, d], [b, c, d], [c, a, d]]);
    }
    TriangleMesh::new(positions, triangles).unwrap()
}

/// The mean of a coordinate of the triangles' centres: some are above it and some below.
fn mean(mesh: &TriangleMesh, axis: usize) -> f64 {
    let count = mesh.triangles().len();
    let center = |t: usize| mesh.corners(t).iter().map(|p| p[axis]).sum::<f64>() / 3.0;
    (0..count).map(center).sum::<f64>() / count as f64
}

fn check(names: &str, task: &Task, outcome: &Outcome) {
    let metrics = outcome.metrics();
    assert_eq!(metrics.flipped_triangles, 0, "{names}");
    assert_eq!(metrics.collapsed_triangles, 0, "{names}");
    assert_eq!(metrics.unintended_overlaps(), 0, "{names}");
    let wide = task.config.tiles as f32;
    let is_inside = |[u, v]: &[f32; 2]| (0.0..=wide).contains(u) && (0.0..=1.0).contains(v);
    assert!(outcome.uv.uvs().iter().all(is_inside), "{names}");
    if task.config.max_charts.is_none() {
        for component in &outcome.atlas.components {
            let energy = component.distortion.energy;
            assert!(energy <= task.config.distortion_bound, "{names}: {energy}");
        }
    }
}

#[test]
fn options_alone_and_in_pairs_keep_layouts_valid() {
    let mut random = Pcg64::seed_from_u64(12);
    let alone = OPTIONS.iter().map(|one| vec![*one]);
    let pairs = (0..OPTIONS.len()).flat_map(|i| (0..i).map(move |j| vec![OPTIONS[i], OPTIONS[j]]));
    for (round, options) in alone.chain(pairs).enumerate() {
        let mut task = Task::default();
        options.iter().for_each(|(_, set)| set(&mut task));
        let names: Vec<&str> = options.iter().map(|(name, _)| *name).collect();
        let is_symmetric = options.iter().any(|(name, _)| *name == "symmetry");
        let kinds: &[Kind] = match (is_symmetric, round / 2 % 2) {
            (true, _) => &[Kind::Symmetric, Kind::Uneven],
            (false, 0) => &[Kind::Copied],
            (false, _) => &[Kind::Symmetric],
        };
        for &kind in kinds {
            let mesh = surface(round % 2 == 1, kind, &mut random);
            assert!(kind != Kind::Uneven || mesh.triangles().len() >= 200);
            check(&names.join(" and "), &task, &task.run_unchecked(&mesh));
        }
    }
}
