use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::options::{Fixed, Size};
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

/// A packing, and where the points of every chart come to lie.
type Packed = (Packing, Vec<Vec<[f64; 2]>>);

fn packed(flats: &[Flat], margin: f64, resolution: u32) -> Packed {
    let charts: Vec<Chart> = flats.iter().map(Flat::chart).collect();
    let packing = pack(&charts, &PackOptions::new(margin, resolution), &|| true).unwrap();
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
    let [quick, best] = [false, true]
        .map(|goes_on| pack(&charts, &PackOptions::new(4.0, 1024), &|| goes_on).unwrap());
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

/// The least distance of two charts' boxes and their positions, for charts that are rectangles
/// parallel to the axes.
fn boxes(places: &[Vec<[f64; 2]>]) -> Vec<[[f64; 2]; 2]> {
    places.iter().map(|place| bounds(place)).collect()
}

fn squares(sides: &[f64]) -> Vec<Flat> {
    let square = |&side: &f64| Flat::rectangle(side, side, 0.0);
    sides.iter().map(square).collect()
}

fn with(flats: &[Flat], turns: Turns, options: &PackOptions<'_>) -> Result<Packed, PackError> {
    let charts: Vec<Chart> = flats
        .iter()
        .map(|flat| flat.chart().with_turns(turns))
        .collect();
    let packing = pack(&charts, options, &|| true)?;
    let places = flats
        .iter()
        .zip(&packing.placements)
        .map(|(flat, at)| flat.uvs.iter().map(|&q| at.place(q)).collect())
        .collect();
    Ok((packing, places))
}

fn sized(size: Size) -> PackOptions<'static> {
    PackOptions {
        size,
        ..PackOptions::new(4.0, 512)
    }
}

/// Boxes in the same tile are apart by so much of its side.
fn assert_apart(packing: &Packing, places: &[Vec<[f64; 2]>], least: f64) {
    let boxes = boxes(places);
    for i in 0..boxes.len() {
        assert!(
            boxes[i][0].iter().all(|c| *c >= 0.5 * least - 1e-9),
            "{:?}",
            boxes[i]
        );
        assert!(
            boxes[i][1].iter().all(|c| *c <= 1.0 - 0.5 * least + 1e-9),
            "{:?}",
            boxes[i]
        );
        for j in 0..i {
            if packing.placements[i].tile == packing.placements[j].tile {
                let apart = (0..2).any(|k| {
                    let right = boxes[i][0][k] - boxes[j][1][k];
                    right.max(boxes[j][0][k] - boxes[i][1][k]) >= least - 1e-9
                });
                assert!(apart, "{:?} and {:?}", boxes[i], boxes[j]);
            }
        }
    }
}

#[test]
fn charts_turn_only_as_they_may() {
    let flats = mixture(20, 4);
    for turns in [Turns::Quarters, Turns::None] {
        let (packing, _) = with(&flats, turns, &PackOptions::new(4.0, 512)).unwrap();
        for placement in &packing.placements {
            let [cos, sin] = placement.turn;
            let is_quarter = cos.abs().min(sin.abs()) < 1e-12;
            assert!(
                is_quarter && (turns == Turns::Quarters || cos > 0.5),
                "{placement:?}"
            );
        }
    }
    // Alone a chart would be turned by half a right angle.
    let thin = [Flat::rectangle(10.0, 1.0, 0.0)];
    let (packing, _) = with(&thin, Turns::None, &PackOptions::new(0.0, 512)).unwrap();
    assert!((packing.placements[0].scale - 0.1).abs() < 1e-5);
}

#[test]
fn several_tiles_have_one_scale_and_are_all_used() {
    let flats = squares(&[1.0; 4]);
    let tiles = |tiles| {
        sized(Size::Largest {
            tiles,
            at_most: f64::INFINITY,
        })
    };
    let (one, _) = with(&flats, Turns::Free, &tiles(1)).unwrap();
    let (four, places) = with(&flats, Turns::Free, &tiles(4)).unwrap();
    assert_eq!((one.tiles, four.tiles), (1, 4));
    assert!(four.placements[0].scale > 1.95 * one.placements[0].scale);
    let mut used: Vec<u32> = four.placements.iter().map(|at| at.tile).collect();
    used.sort_unstable();
    assert_eq!(used, [0, 1, 2, 3]);
    assert!(four.coverage > 0.95, "{}", four.coverage);
    assert_apart(&four, &places, 4.0 / 512.0);
    for tiles in [0, 101] {
        let options = sized(Size::Largest {
            tiles,
            at_most: 1.0,
        });
        assert_eq!(
            with(&flats, Turns::Free, &options).unwrap_err(),
            PackError::Tiles(tiles)
        );
    }
}

#[test]
fn scale_stays_below_what_is_asked() {
    let options = sized(Size::Largest {
        tiles: 1,
        at_most: 0.125,
    });
    for count in [1, 5] {
        let flats = squares(&vec![1.0; count]);
        let (packing, places) = with(&flats, Turns::Free, &options).unwrap();
        assert_eq!(packing.placements[0].scale, 0.125);
        assert_apart(&packing, &places, 4.0 / 512.0);
    }
}

#[test]
fn charts_at_a_density_take_as_many_tiles_as_they_need() {
    let flats = squares(&[1.0; 10]);
    // Four of 250 texels with a margin of 4 fill a tile of 512.
    let (packing, places) =
        with(&flats, Turns::Free, &sized(Size::Tiles { density: 250.0 })).unwrap();
    assert_eq!(
        (packing.tiles, packing.resolution, packing.margin),
        (3, 512, 4.0)
    );
    assert!(
        packing
            .placements
            .iter()
            .all(|at| (at.scale * 512.0 - 250.0).abs() < 1e-9)
    );
    assert_apart(&packing, &places, 4.0 / 512.0);
    let charts: Vec<Chart> = flats.iter().map(Flat::chart).collect();
    let rounded = to_f32(&charts, &packing, &[]).unwrap();
    assert_eq!((rounded.flipped, rounded.overlapping), (0, 0));
    for (uvs, at) in rounded.uvs.iter().zip(&packing.placements) {
        let [x, _] = corner_of_tile(at.tile);
        assert!(
            uvs.iter()
                .all(|uv| (x..=x + 1.0).contains(&f64::from(uv[0])))
        );
    }
    let error = with(&flats, Turns::Free, &sized(Size::Tiles { density: 509.0 })).unwrap_err();
    assert!(
        matches!(
            error,
            PackError::TooLarge {
                chart: 0,
                resolution: 512,
                ..
            }
        ),
        "{error}"
    );
    let many = squares(&[1.0; 401]);
    let error = with(&many, Turns::None, &sized(Size::Tiles { density: 250.0 })).unwrap_err();
    assert_eq!(error, PackError::TooMany);
    for density in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = with(&flats, Turns::Free, &sized(Size::Tiles { density })).unwrap_err();
        assert!(matches!(error, PackError::Density(_)));
    }
}

#[test]
fn square_grows_with_the_density() {
    for (count, density, side) in [(1, 100.0, 104), (4, 100.0, 208), (4, 1000.0, 2008)] {
        let flats = squares(&vec![1.0; count]);
        for whole_texels in [false, true] {
            let options = PackOptions {
                whole_texels,
                ..sized(Size::Side { density })
            };
            let (packing, places) = with(&flats, Turns::Free, &options).unwrap();
            let found = f64::from(packing.resolution);
            assert!((packing.placements[0].scale * found - density).abs() < 1e-6);
            assert!(
                found >= f64::from(side) && found < 1.02 * f64::from(side) + 2.0,
                "{found}"
            );
            assert_apart(&packing, &places, 4.0 / found);
        }
    }
}

#[test]
fn charts_are_placed_around_those_that_stay() {
    let stays = Flat::sheet(2, 2, |x, y| [0.25 + 0.5 * x, 0.1 + 0.3 * y]);
    let fixed = [Fixed {
        chart: stays.chart(),
        tile: 0,
    }];
    let flats = squares(&[1.0, 0.5, 0.5, 0.7, 0.2]);
    for whole_texels in [false, true] {
        let options = PackOptions {
            fixed: &fixed,
            whole_texels,
            ..PackOptions::new(4.0, 512)
        };
        let (mut packing, mut places) = with(&flats, Turns::Quarters, &options).unwrap();
        assert!(packing.placements[0].scale > 0.4);
        places.push(stays.uvs.clone());
        packing.placements.push(packing.placements[0]);
        assert_apart(&packing, &places, 4.0 / 512.0);
        let side = PackOptions {
            size: Size::Side { density: 1.0 },
            ..options
        };
        let error = with(&flats, Turns::Free, &side).unwrap_err();
        assert_eq!(error, PackError::FixedInUnknownSquare);
    }
    let all = Flat::sheet(1, 1, |x, y| [x, y]);
    let fixed = [Fixed {
        chart: all.chart(),
        tile: 0,
    }];
    let options = PackOptions {
        fixed: &fixed,
        ..PackOptions::new(4.0, 512)
    };
    let error = with(&flats, Turns::Free, &options).unwrap_err();
    assert_eq!(error, PackError::NoRoom);
}

/// Texels that two charts touch lie apart by whole ones, also where the charts are not rectangles.
#[test]
fn whole_texels_stay_free_between_charts() {
    for (resolution, margin) in [(256, 2.0), (512, 3.0), (2048, 4.0)] {
        let flats = mixture(12, 6);
        let options = PackOptions {
            whole_texels: true,
            ..PackOptions::new(margin, resolution)
        };
        let (packing, places) = with(&flats, Turns::Free, &options).unwrap();
        assert!(packing.margin >= margin && packing.margin < margin + 2.0);
        let side = resolution as usize;
        let mut owner = vec![usize::MAX; side * side];
        for (i, place) in places.iter().enumerate() {
            let [low, _] = bounds(place);
            for c in low.map(|c| c * f64::from(resolution)) {
                assert!((c - c.round()).abs() < 1e-6, "{c}");
            }
            // Points strewn over the chart tell which texels it touches; its lower left corner is
            // on a corner of texels but for rounding.
            for t in &flats[i].triangles {
                let [a, b, c] = t.map(|v| place[v as usize]);
                let steps = 60;
                for u in 0..=steps {
                    for v in 0..=steps - u {
                        let [u, v] = [u, v].map(|w| f64::from(w) / f64::from(steps));
                        let at = [0, 1].map(|k| {
                            let c = a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]);
                            (c * f64::from(resolution) + 1e-7) as usize
                        });
                        owner[at[1] * side + at[0]] = i;
                    }
                }
            }
        }
        let reach = margin as usize;
        for (at, &own) in owner
            .iter()
            .enumerate()
            .filter(|(_, own)| **own != usize::MAX)
        {
            let [x, y] = [at % side, at / side];
            for row in y..(y + reach + 1).min(side) {
                let columns = x.saturating_sub(reach)..(x + reach + 1).min(side);
                let others = &owner[row * side..][columns];
                assert!(
                    others
                        .iter()
                        .all(|&other| other == own || other == usize::MAX)
                );
            }
        }
    }
}

/// A ring that is closed, and squares that are as large as its hole.
#[test]
fn charts_lie_in_the_holes_of_others() {
    let ring = Flat::sheet(48, 1, |x, y| {
        let (sin, cos) = (std::f64::consts::TAU * x).sin_cos();
        [cos, sin].map(|c| (1.0 - 0.15 * y) * c)
    });
    let flats = [ring, Flat::rectangle(1.1, 1.1, 0.3)];
    let (packing, places) = packed(&flats, 4.0, 1024);
    assert!(
        packing.placements[0].scale > 0.49,
        "{}",
        packing.placements[0].scale
    );
    let [[ring, _], [square, _]] = [bounds(&places[0]), bounds(&places[1])];
    assert!((0..2).all(|k| square[k] > ring[k]));
}

#[test]
fn any_number_of_threads_finds_the_same() {
    let flats = mixture(24, 8);
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap().install(|| packed(&flats, 4.0, 1024).0)
    };
    assert_eq!(on(1), on(3));
}

/// The square around a chart alone is no larger than that at any angle.
#[test]
fn chart_alone_is_as_large_as_it_can_be() {
    let mut random = Pcg64Mcg::seed_from_u64(12);
    for _ in 0..20 {
        let [a, b, c] = [0; 3].map(|_| random.random_range(0.2..1.0));
        let flat = Flat::sheet(6, 3, |x, y| [x + a * y, b * y + c * x * (1.0 - x)]);
        let (packing, _) = packed(std::slice::from_ref(&flat), 0.0, 1024);
        for step in 0..1000 {
            let (sin, cos) = (f64::from(step) * 1e-3 * std::f64::consts::FRAC_PI_2).sin_cos();
            let turned: Vec<[f64; 2]> = flat.uvs.iter().map(|&q| turned(q, [cos, sin])).collect();
            let [low, high] = bounds(&turned);
            let side = (high[0] - low[0]).max(high[1] - low[1]);
            // A square that is less than a hundredth smaller is not worth lying aslant.
            assert!(packing.placements[0].scale * side * 1.0102 > 1.0 - 1e-5);
        }
    }
}
