use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::*;

struct Flat {
    uvs: Vec<[f64; 2]>,
    triangles: Vec<[u32; 3]>,
}

impl Flat {
    fn chart(&self) -> Chart<'_> {
        Chart::new(&self.uvs, &self.triangles).unwrap()
    }

    /// The image of a sheet of `n` by `m` cells over the unit square.
    fn sheet(n: u32, m: u32, map: impl Fn(f64, f64) -> [f64; 2]) -> Self {
        let at = |i: u32| {
            let [x, y] = [i % (n + 1), i / (n + 1)].map(f64::from);
            map(x / f64::from(n), y / f64::from(m))
        };
        let cell = |i: u32| {
            let a = i % n + i / n * (n + 1);
            [[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]]
        };
        Self {
            uvs: (0..(n + 1) * (m + 1)).map(at).collect(),
            triangles: (0..n * m).flat_map(cell).collect(),
        }
    }

    fn rectangle(width: f64, height: f64, angle: f64) -> Self {
        Self::sheet(3, 2, |x, y| {
            turned([width * x, height * y], [angle.cos(), angle.sin()])
        })
    }

    /// Part of a ring.
    fn arc(radius: f64, width: f64, angle: f64) -> Self {
        Self::sheet(12, 1, |x, y| {
            let (sin, cos) = (angle * x).sin_cos();
            [cos, sin].map(|c| (radius - width * y) * c)
        })
    }
}

fn mixture(count: u32, seed: u64) -> Vec<Flat> {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    (0..count)
        .map(|i| {
            let size = random.random_range(0.3..2.0);
            match i % 2 {
                0 => Flat::rectangle(size, size * random.random_range(0.1..1.0), size),
                _ => Flat::arc(size, 0.3 * size, random.random_range(1.0..5.0)),
            }
        })
        .collect()
}

fn packed(flats: &[Flat], margin: f64, resolution: u32) -> (Packing, Vec<Vec<[f64; 2]>>) {
    let charts: Vec<Chart> = flats.iter().map(Flat::chart).collect();
    let packing = pack(&charts, margin, resolution, &|| true);
    let places = flats
        .iter()
        .zip(&packing.placements)
        .map(|(flat, placement)| flat.uvs.iter().map(|&q| placement.place(q)).collect())
        .collect();
    (packing, places)
}

fn distance_to_segment(p: [f64; 2], [a, b]: [[f64; 2]; 2]) -> f64 {
    let along = [b[0] - a[0], b[1] - a[1]];
    let to = [p[0] - a[0], p[1] - a[1]];
    let squared = along[0] * along[0] + along[1] * along[1];
    let share = ((to[0] * along[0] + to[1] * along[1]) / squared.max(1e-300)).clamp(0.0, 1.0);
    (to[0] - share * along[0]).hypot(to[1] - share * along[1])
}

fn double_area([a, b, c]: [[f64; 2]; 3]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// The distance of two triangles that do not cross each other; 0 if one has a corner of the
/// other inside.
fn distance(a: [[f64; 2]; 3], b: [[f64; 2]; 3]) -> f64 {
    let one_way = |a: [[f64; 2]; 3], b: [[f64; 2]; 3]| {
        let edges = [[b[0], b[1]], [b[1], b[2]], [b[2], b[0]]];
        a.into_iter()
            .map(|p| {
                let inside = edges.iter().all(|&[s, e]| double_area([s, e, p]) >= 0.0);
                let to_edges = edges.iter().map(|&edge| distance_to_segment(p, edge));
                if inside {
                    0.0
                } else {
                    to_edges.fold(f64::MAX, f64::min)
                }
            })
            .fold(f64::MAX, f64::min)
    };
    one_way(a, b).min(one_way(b, a))
}

#[test]
fn charts_keep_their_margin_their_orientation_and_one_scale() {
    for (count, margin, resolution) in [(2, 16.0, 256), (9, 3.0, 512), (40, 4.0, 1024)] {
        let flats = mixture(count, u64::from(count));
        let (packing, places) = packed(&flats, margin, resolution);
        let texels = f64::from(resolution);
        let border = 0.5 * margin / texels * (1.0 - 1e-9);
        let corners = |i: usize| {
            let triangles = flats[i].triangles.iter();
            triangles
                .map(|t| t.map(|v| places[i][v as usize]))
                .collect::<Vec<_>>()
        };
        let mut area = 0.0;
        for i in 0..flats.len() {
            assert_eq!(packing.placements[i].scale, packing.placements[0].scale);
            let [cos, sin] = packing.placements[i].turn;
            assert!((cos.hypot(sin) - 1.0).abs() < 1e-12);
            for p in places[i].iter().flatten() {
                assert!((border..=1.0 - border).contains(p), "{p}");
            }
            for (t, placed) in flats[i].triangles.iter().zip(corners(i)) {
                let before = double_area(t.map(|v| flats[i].uvs[v as usize]));
                assert_eq!(before > 0.0, double_area(placed) > 0.0);
                area += 0.5 * double_area(placed).abs();
            }
            for j in 0..i {
                for a in corners(i) {
                    for b in corners(j) {
                        let apart = distance(a, b) * texels;
                        assert!(apart >= margin * (1.0 - 1e-9), "{i} and {j}: {apart}");
                    }
                }
            }
        }
        assert_eq!(packing.margin, margin);
        assert!((packing.coverage - area).abs() < 1e-9);
        assert!(packing.coverage > 0.35, "{}", packing.coverage);
    }
}

#[test]
fn rectangle_alone_becomes_parallel_to_the_axes_and_as_wide_as_the_square() {
    for step in 0..20 {
        let flats = [Flat::rectangle(2.0, 1.0, 0.4 * f64::from(step))];
        let (packing, places) = packed(&flats, 8.0, 512);
        let margin = 8.0 / 512.0;
        assert!((packing.placements[0].scale - 0.5 * (1.0 - margin)).abs() < 1e-12);
        let extent = |k: usize| {
            let values = || places[0].iter().map(|p| p[k]);
            [values().fold(1.0, f64::min), values().fold(0.0, f64::max)]
        };
        let [[left, right], [low, high]] = [extent(0), extent(1)];
        assert!((left - 0.5 * margin).abs() < 1e-12 && (right - 1.0 + 0.5 * margin).abs() < 1e-12);
        assert!((low - left).abs() < 1e-12 && (high - low - 0.5 * (right - left)).abs() < 1e-12);
    }
}

#[test]
fn thin_chart_alone_lies_aslant() {
    let (packing, _) = packed(&[Flat::rectangle(10.0, 1.0, 0.3)], 0.0, 1024);
    let diagonal = 2f64.sqrt() / 11.0;
    assert!((packing.placements[0].scale / diagonal - 1.0).abs() < 1e-5);
}

/// Their boxes would not: a small ring segment lies inside a large one.
#[test]
fn charts_fill_the_bays_of_others() {
    let flats = [Flat::arc(1.0, 0.1, 6.0), Flat::rectangle(1.0, 1.0, 0.0)];
    let (packing, _) = packed(&flats, 4.0, 2048);
    assert!(
        packing.placements[0].scale > 0.48,
        "{:?}",
        packing.placements
    );
}

#[test]
fn points_lines_and_nothing_have_a_place() {
    let point = || Flat {
        uvs: vec![[3.0, -1e9]; 4],
        triangles: vec![[0, 1, 2], [1, 2, 3]],
    };
    let line = || Flat {
        uvs: vec![[0.0, 0.0], [1.0, 2.0], [2.0, 4.0]],
        triangles: vec![[0, 1, 2]],
    };
    let nothing = || Flat {
        uvs: vec![],
        triangles: vec![],
    };
    let sets = [
        vec![],
        vec![point()],
        vec![line()],
        vec![nothing()],
        vec![nothing(), point()],
        vec![point(), line(), nothing(), Flat::rectangle(1.0, 2.0, 1.0)],
        (0..50).map(|_| point()).collect(),
        (0..50).map(|_| line()).collect(),
    ];
    for flats in sets {
        let (packing, places) = packed(&flats, 4.0, 256);
        assert_eq!(packing.placements.len(), flats.len());
        assert!(packing.coverage.is_finite());
        for place in places.iter().flatten().flatten() {
            assert!((0.0..=1.0).contains(place), "{place}");
        }
    }
}

#[test]
fn extreme_sizes_and_margins_have_a_place() {
    for size in [1e-310, 1e-200, 1e200, 1e308] {
        let flats = [0.3, 0.7].map(|angle| Flat::rectangle(size, 0.4 * size, angle));
        for (margin, resolution) in [(0.0, 0), (1e9, 1), (f64::NAN, 64), (-3.0, 64)] {
            let (_, places) = packed(&flats, margin, resolution);
            for place in places.iter().flatten().flatten() {
                assert!((0.0..=1.0).contains(place), "{size} {margin} {place}");
            }
        }
    }
}

#[test]
fn a_margin_that_has_no_room_is_reduced_and_told() {
    let flats = mixture(90, 3);
    let (packing, places) = packed(&flats, 16.0, 128);
    assert_eq!(packing.margin, 6.4);
    let border = 0.5 * 6.4 / 128.0 * (1.0 - 1e-9);
    let mut inside = places.iter().flatten().flatten();
    assert!(inside.all(|c| (border..=1.0 - border).contains(c)));
}

#[test]
fn charts_out_of_range_are_refused() {
    let uvs = [[0.0, f64::NAN], [0.0, 1.0]];
    let error = Chart::new(&uvs, &[]).unwrap_err();
    assert_eq!(error, SurfaceError::NonFiniteUv { index: 0 });
    let error = Chart::new(&uvs[1..], &[[0, 0, 1]]).unwrap_err();
    let expected = SurfaceError::IndexOutOfRange {
        face: 0,
        index: 1,
        count: 1,
    };
    assert_eq!(error, expected);
}

#[test]
fn packing_can_be_broken_off() {
    let flats = mixture(40, 5);
    let charts: Vec<Chart> = flats.iter().map(Flat::chart).collect();
    let [quick, best] = [false, true].map(|goes_on| pack(&charts, 4.0, 1024, &|| goes_on));
    let scale = |packing: &Packing| packing.placements[0].scale;
    assert!(scale(&quick) < scale(&best));
    let places = std::iter::zip(&flats, &quick.placements);
    let mut places = places.flat_map(|(flat, at)| flat.uvs.iter().map(|&q| at.place(q)));
    assert!(places.all(|p| p.iter().all(|c| (0.0..=1.0).contains(c))));
}

#[test]
fn thousands_of_charts_fit() {
    let flats = mixture(3000, 9);
    let (packing, places) = packed(&flats, 1.0, 4096);
    assert!(packing.coverage > 0.6, "{}", packing.coverage);
    let mut inside = places.iter().flatten().flatten();
    assert!(inside.all(|c| (0.0..=1.0).contains(c)));
}

#[test]
fn a_thousand_charts_fit() {
    let flats = mixture(1000, 7);
    let (packing, places) = packed(&flats, 2.0, 2048);
    assert!(packing.coverage > 0.55, "{}", packing.coverage);
    let mut inside = places.iter().flatten().flatten();
    assert!(inside.all(|c| (0.0..=1.0).contains(c)));
}
