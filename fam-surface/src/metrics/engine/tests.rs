use std::time::Instant;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::*;

/// Texels along the side of the square in these tests.
const SIDE: u32 = 256;

const LIGHTMAP: EngineCheck = EngineCheck {
    resolution: SIDE,
    margin: 4.0,
    ..EngineCheck::LIGHTMAP
};

const TEXTURE: EngineCheck = EngineCheck {
    resolution: SIDE,
    ..EngineCheck::TEXTURE
};

/// Flat pieces of surface, each in a plane of its own in space, and their UVs in texels.
#[derive(Default)]
struct Sheets {
    positions: Vec<[f64; 3]>,
    uvs: Vec<[f32; 2]>,
    triangles: Vec<[u32; 3]>,
}

impl Sheets {
    /// Two triangles over four corners, which have the distances in space that they have in the plane.
    fn quad(self, corners: [[f64; 2]; 4]) -> Self {
        self.stretched(corners, 1.0)
    }

    /// The same, larger in space.
    fn stretched(mut self, corners: [[f64; 2]; 4], factor: f64) -> Self {
        let first = self.positions.len() as u32;
        let height = f64::from(first);
        let in_space = |[x, y]: [f64; 2]| [factor * x, factor * y, height];
        self.positions.extend(corners.map(in_space));
        self.uvs.extend(corners.map(in_plane));
        let own = [[0, 1, 2], [0, 2, 3]].map(|t| t.map(|v| first + v));
        self.triangles.extend(own);
        self
    }

    fn square(self, low: [f64; 2], side: f64) -> Self {
        self.rectangle(low, [side; 2])
    }

    fn rectangle(self, low: [f64; 2], sides: [f64; 2]) -> Self {
        self.quad(rectangle(low, sides))
    }

    /// The UVs of a quad's corners, moved to others.
    fn moved(mut self, quad: usize, corners: [[f64; 2]; 4]) -> Self {
        self.uvs[4 * quad..4 * quad + 4].copy_from_slice(&corners.map(in_plane));
        self
    }

    fn findings(&self, check: &EngineCheck) -> Vec<Finding> {
        let mesh = TriangleMesh::new(self.positions.clone(), self.triangles.clone()).unwrap();
        let uv = UvMap::new(self.uvs.clone(), self.triangles.clone()).unwrap();
        findings(&mesh, &uv, check).unwrap()
    }

    /// The only finding.
    fn finding(&self, check: &EngineCheck) -> Finding {
        let mut found = self.findings(check);
        assert_eq!(found.len(), 1, "{found:?}");
        found.remove(0)
    }

    fn kinds(&self, check: &EngineCheck) -> Vec<(Kind, Severity)> {
        let found = self.findings(check);
        found.iter().map(|one| (one.kind, one.severity)).collect()
    }
}

fn in_plane(corner: [f64; 2]) -> [f32; 2] {
    corner.map(|c| (c / f64::from(SIDE)) as f32)
}

fn rectangle([x, y]: [f64; 2], [width, height]: [f64; 2]) -> [[f64; 2]; 4] {
    [
        [x, y],
        [x + width, y],
        [x + width, y + height],
        [x, y + height],
    ]
}

fn assert_at(finding: &Finding, texels: [f64; 2]) {
    for (at, texel) in finding.at.iter().zip(texels) {
        let found = at * f64::from(SIDE);
        assert!((found - texel).abs() < 1e-3, "{finding:?}");
    }
}

fn near(found: f64, expected: f64) {
    assert!((found - expected).abs() < 1e-4, "{found}, not {expected}");
}

#[test]
fn two_squares_three_texels_apart_are_nearer_than_four() {
    let two = Sheets::default()
        .square([10.0, 10.0], 20.0)
        .square([33.0, 10.0], 20.0);
    let found = two.finding(&LIGHTMAP);
    assert_eq!((found.kind, found.severity), (Kind::Near, Severity::Error));
    assert_eq!((found.count, found.complete, found.limit), (1, true, 4.0));
    near(found.worst, 3.0);
    near(found.at[0] * 256.0, 31.5);
    assert_eq!(found.charts, [0, 1]);
    assert_eq!(found.triangles.len(), 2);
    assert_eq!(
        found.to_string().split(" at (").next(),
        Some("1 pair of charts is nearer than 4 texels at 256: the nearest 3 texels")
    );
    assert_eq!(two.finding(&TEXTURE).severity, Severity::Warning);
    for margin in [3.0, 2.0, 0.0] {
        assert_eq!(two.findings(&EngineCheck { margin, ..LIGHTMAP }), []);
    }
}

#[test]
fn charts_are_as_near_as_their_corners_and_holes_are() {
    let corners = Sheets::default()
        .square([10.0, 10.0], 20.0)
        .square([33.0, 34.0], 20.0);
    let at = |margin| corners.findings(&EngineCheck { margin, ..LIGHTMAP });
    assert_eq!(at(5.0), []);
    let found = &at(5.1)[0];
    near(found.worst, 5.0);
    assert_at(found, [31.5, 32.0]);
    // A square in the hole of a frame.
    let frame = Sheets::default()
        .quad([[0.0, 0.0], [60.0, 0.0], [40.0, 20.0], [20.0, 20.0]])
        .quad([[60.0, 0.0], [60.0, 60.0], [40.0, 40.0], [40.0, 20.0]])
        .quad([[60.0, 60.0], [0.0, 60.0], [20.0, 40.0], [40.0, 40.0]])
        .quad([[0.0, 60.0], [0.0, 0.0], [20.0, 20.0], [20.0, 40.0]])
        .square([23.0, 22.0], 14.0);
    let joined = Sheets {
        positions: frame
            .positions
            .iter()
            .map(|&[x, y, z]| match z < 16.0 {
                true => [x, y, 0.0],
                false => [x, y, z],
            })
            .collect(),
        ..frame
    };
    let found = joined.finding(&LIGHTMAP);
    assert_eq!(found.count, 1);
    near(found.worst, 2.0);
    assert_eq!(found.charts, [0, 1]);
}

#[test]
fn overlaps_are_measured_where_they_are_largest() {
    let three = Sheets::default()
        .square([10.0, 10.0], 40.0)
        .rectangle([40.0, 40.0], [40.0, 30.0])
        .rectangle([100.0, 10.0], [40.0, 40.0])
        .rectangle([138.0, 12.0], [30.0, 36.0]);
    for check in [LIGHTMAP, TEXTURE] {
        let found = three.finding(&check);
        assert_eq!(
            (found.kind, found.severity),
            (Kind::Overlapping, Severity::Error)
        );
        // In the first corner a diagonal of slope 1 and one of 0.75 start: three pieces. The strip
        // lies below the third square's diagonal, and that of the fourth cuts off a corner.
        assert_eq!(found.count, 5);
        near(found.worst, 72.0 - 2.4);
        assert_eq!(found.charts, [2, 3]);
        let text = found.to_string();
        let beginning =
            "5 pairs of triangles overlap each other: by at most 69.6 texels at 256 at (0.5";
        assert!(text.starts_with(beginning), "{text}");
    }
    let one = Sheets::default().quad(rectangle([0.0; 2], [8.0; 2]));
    let uv = UvMap::new(one.uvs.clone(), one.triangles.clone()).unwrap();
    let corners = |t: usize| uv.corners(t).map(|q| q.map(|c| f64::from(c * 256.0)));
    let shifted = corners(1).map(|[x, y]| [x, y - 2.0]);
    let (area, _) = clip::common([corners(0), shifted]);
    // Of x ≤ y + 2 and x ≥ y, from y = 0 to 6: a strip of width 2 and its end.
    near(area, 14.0 - 2.0);
    for turned in [[shifted[2], shifted[1], shifted[0]], shifted] {
        near(clip::common([turned, corners(0)]).0, 12.0);
    }
}

#[test]
fn charts_on_one_place_are_wrong_in_lightmaps_and_told_of_textures() {
    let place = rectangle([40.0; 2], [50.0, 20.0]);
    let [a, b, c, d] = place;
    // As it is, and over to its mirror image; a chart elsewhere.
    let stack = Sheets::default()
        .quad(place)
        .quad(place)
        .square([100.0; 2], 30.0)
        .quad(place);
    let found = stack.finding(&LIGHTMAP);
    assert_eq!(
        (found.kind, found.severity),
        (Kind::Stacked, Severity::Error)
    );
    assert_eq!((found.count, found.worst), (2, 3.0));
    assert_eq!(found.charts, [0, 1]);
    assert_eq!(stack.kinds(&TEXTURE), [(Kind::Stacked, Severity::Note)]);
    // The diagonal from a to c is that of the mirror image d, c, b, a too, if it begins at c.
    let mirrored = stack.moved(3, [c, b, a, d]);
    let flat = EngineCheck {
        normal_map: false,
        ..TEXTURE
    };
    assert_eq!(mirrored.kinds(&flat), [(Kind::Stacked, Severity::Note)]);
    let all = [
        (Kind::Mirrored, Severity::Warning),
        (Kind::Stacked, Severity::Note),
    ];
    assert_eq!(mirrored.kinds(&TEXTURE), all);
    assert_eq!(mirrored.findings(&TEXTURE)[0].count, 1);
    near(mirrored.findings(&TEXTURE)[0].worst, 0.25);
    let all = [
        (Kind::Stacked, Severity::Error),
        (Kind::Mirrored, Severity::Note),
    ];
    assert_eq!(mirrored.kinds(&LIGHTMAP), all);
    // The same square with the other diagonal is a copy, too; one that is moved a little is none.
    let other = mirrored.moved(3, [b, c, d, a]);
    assert_eq!(other.kinds(&TEXTURE), [(Kind::Stacked, Severity::Note)]);
    let shifted = other.moved(3, [[b[0], b[1] + 0.01], c, d, a]);
    let kinds = shifted.kinds(&TEXTURE);
    assert!(
        kinds.contains(&(Kind::Overlapping, Severity::Error)),
        "{kinds:?}"
    );
}

/// Two charts of which one has one triangle where the other has, and one elsewhere.
#[test]
fn charts_that_coincide_in_a_part_overlap() {
    let place = rectangle([40.0; 2], [20.0; 2]);
    let [a, b, c, _] = place;
    let folded = Sheets::default()
        .quad(place)
        .quad(place)
        .moved(1, [a, b, c, [90.0, 10.0]]);
    let found = &folded.findings(&TEXTURE)[0];
    assert_eq!(found.kind, Kind::Overlapping);
    near(found.worst, 200.0);
    assert_eq!(found.charts, [0, 1]);
}

#[test]
fn a_sheet_drawn_twice_takes_light_from_both_sides() {
    let mut sheet = Sheets::default().square([10.0; 2], 20.0);
    sheet.triangles.extend([[2, 1, 0], [3, 2, 0]]);
    let found = sheet.finding(&LIGHTMAP);
    assert_eq!(
        (found.kind, found.severity),
        (Kind::Repeated, Severity::Error)
    );
    assert_eq!((found.count, &found.triangles[..]), (2, &[0, 2][..]));
    assert_eq!(sheet.findings(&TEXTURE), []);
}

#[test]
fn lightmaps_lie_in_the_square_and_textures_in_tiles() {
    let inside = Sheets::default().square([0.0; 2], 256.0);
    assert_eq!(inside.findings(&LIGHTMAP), []);
    assert_eq!(inside.findings(&TEXTURE), []);
    let tile = Sheets::default().square([256.0 * 9.0 + 10.0, 256.0 * 3.0 + 10.0], 20.0);
    assert_eq!(tile.findings(&TEXTURE), []);
    let found = tile.finding(&LIGHTMAP);
    assert_eq!(
        (found.kind, found.severity),
        (Kind::Outside, Severity::Error)
    );
    near(found.worst, 8.0 + 30.0 / 256.0);
    for (low, excess) in [
        ([250.0, 10.0], 14.0),
        ([2550.0, 10.0], 10.0),
        ([10.0, -6.0], 6.0),
    ] {
        let across = Sheets::default().square(low, 20.0);
        let found = across.finding(&TEXTURE);
        assert_eq!(
            (found.kind, found.severity),
            (Kind::AcrossTiles, Severity::Warning)
        );
        let least = f64::min(excess, 20.0 - excess);
        near(found.worst * 256.0, least);
    }
    let beyond = Sheets::default().square([-30.0, 10.0], 20.0);
    let found = beyond.finding(&TEXTURE);
    near(found.worst * 256.0, 30.0);
    assert_at(&found, [-30.0, 20.0]);
}

#[test]
fn what_lies_between_texels_is_told() {
    let strips = Sheets::default()
        .rectangle([10.0; 2], [0.75, 50.0])
        .quad([[50.0, 50.0], [90.0, 90.0], [89.75, 90.25], [49.75, 50.25]])
        .square([100.0; 2], 1.0)
        .rectangle([120.0; 2], [50.0, 1.25]);
    let found = strips.finding(&LIGHTMAP);
    assert_eq!(
        (found.kind, found.severity, found.count),
        (Kind::Narrow, Severity::Error, 2)
    );
    assert_eq!(found.charts, [1]);
    near(found.worst, 20.0 / 40.25);
    assert_at(&found, [69.875, 70.125]);
    assert_eq!(strips.finding(&TEXTURE).severity, Severity::Warning);
    let wider = EngineCheck {
        least_width: 1.5,
        ..LIGHTMAP
    };
    assert_eq!(strips.finding(&wider).count, 4);
}

#[test]
fn triangles_without_area_in_the_plane_are_told() {
    let line = Sheets::default()
        .square([10.0; 2], 20.0)
        .square([100.0; 2], 4.0)
        .moved(1, [[100.0; 2], [110.0; 2], [120.0; 2], [90.0; 2]]);
    let found = line.finding(&LIGHTMAP);
    assert_eq!(
        (found.kind, found.severity, found.count),
        (Kind::Collapsed, Severity::Error, 2)
    );
    near(found.worst, 8.0 / 416.0);
    assert_eq!(found.triangles, [2]);
    assert_eq!(line.finding(&TEXTURE).severity, Severity::Warning);
}

#[test]
fn densities_that_differ_are_told_but_not_a_few() {
    let place = |low: f64, side: f64| rectangle([low; 2], [side; 2]);
    // 2.5 times less dense than the first; a third one on a fiftieth of the surface.
    let two = Sheets::default()
        .quad(place(10.0, 50.0))
        .stretched(place(100.0, 20.0), 2.5);
    for check in [LIGHTMAP, TEXTURE] {
        let found = two.finding(&check);
        assert_eq!(
            (found.kind, found.severity),
            (Kind::DensitySpread, Severity::Warning)
        );
        near(found.worst, 2.5);
        assert_eq!(found.count, 2);
    }
    let few = Sheets::default()
        .quad(place(10.0, 70.0))
        .stretched(place(100.0, 1.0), 10.0);
    assert_eq!(few.findings(&LIGHTMAP), []);
    let none = Sheets::default()
        .square([10.0; 2], 20.0)
        .square([100.0; 2], 20.0)
        .moved(1, [[100.0; 2]; 4]);
    let all = none.findings(&LIGHTMAP);
    let spread = all
        .iter()
        .find(|one| one.kind == Kind::DensitySpread)
        .unwrap();
    assert_eq!(spread.worst, f64::INFINITY);
    let json = serde_json::to_value(spread).unwrap();
    assert_eq!(json["worst"], serde_json::Value::Null);
    assert_eq!(
        (&json["kind"], &json["severity"]),
        (&"density-spread".into(), &"warning".into())
    );
}

/// Small triangles, each a chart, held against all pairs.
#[test]
fn near_pairs_are_those_of_all_pairs() {
    for seed in 0..20 {
        let mut random = Pcg64::seed_from_u64(seed);
        let count = random.random_range(2..120);
        let size = random.random_range(1.0..60.0);
        let mut soup = Sheets::default();
        for t in 0..count {
            let low = [0; 2].map(|_| random.random_range(0.0..256.0));
            for c in 0..3 {
                let corner = low.map(|x| x + random.random_range(0.0..size));
                soup.uvs.push(in_plane(corner));
                soup.positions
                    .push([corner[0], corner[1], f64::from(t * 9 + c / 9)]);
            }
            soup.triangles.push([0, 1, 2].map(|c| 3 * t as u32 + c));
        }
        let uv = UvMap::new(soup.uvs.clone(), soup.triangles.clone()).unwrap();
        let mut overlapping = HashSet::new();
        super::super::for_each_overlapping_pair(&uv, |pair| {
            overlapping.insert(pair);
        });
        let mut gaps = Vec::new();
        let corners = |t: usize| uv.corners(t).map(|q| q.map(f64::from));
        let to_edge = |q: [f64; 2], [a, b]: [[f64; 2]; 2]| {
            let samples = (0..=400).map(|i| {
                let share = f64::from(i) / 400.0;
                let at = [0, 1].map(|k| a[k] + share * (b[k] - a[k]));
                (q[0] - at[0]).hypot(q[1] - at[1])
            });
            samples.fold(f64::INFINITY, f64::min)
        };
        for b in 0..count as usize {
            for a in (0..b).filter(|&a| !overlapping.contains(&[a as u32, b as u32])) {
                let (one, other) = (corners(a), corners(b));
                let mut least = f64::INFINITY;
                for k in 0..3 {
                    for l in 0..3 {
                        least = least
                            .min(to_edge(one[k], [other[l], other[(l + 1) % 3]]))
                            .min(to_edge(other[k], [one[l], one[(l + 1) % 3]]));
                    }
                }
                gaps.push(least * 256.0);
            }
        }
        gaps.sort_by(f64::total_cmp);
        let found = soup.findings(&LIGHTMAP);
        let found = found.iter().find(|one| one.kind == Kind::Near);
        let count = found.map_or(0, |one| one.count) as usize;
        // Samples are a little farther than the nearest point.
        let slack = size / 200.0;
        let least = gaps.iter().filter(|&&gap| gap < 4.0).count();
        let most = gaps.iter().filter(|&&gap| gap < 4.0 + slack).count();
        assert!(
            (least..=most).contains(&count),
            "{count}, not {least} to {most}"
        );
        if let Some(found) = found {
            assert!(
                (found.worst - gaps[0]).abs() < slack,
                "{} {}",
                found.worst,
                gaps[0]
            );
        }
    }
}

/// Squares of a side.
fn many(count: usize, side: f64, place: impl Fn(usize) -> [f64; 2]) -> Sheets {
    let mut all = Sheets::default();
    for i in 0..count {
        all = all.square(place(i), side);
    }
    all
}

#[test]
fn hostile_maps_are_checked_in_time() {
    let row =
        |i: usize, pitch: f64| [0, 1].map(|k| pitch * [(i % 225) as f64, (i / 225) as f64][k]);
    let maps = [
        // All within a texel; at one place; in one point; far apart; very far.
        many(20_000, 1e-4, |i| row(i, 2e-4)),
        many(20_000, 20.0, |_| [10.0; 2]),
        many(20_000, 0.0, |_| [10.0; 2]),
        many(20_000, 20.0, |i| [i as f64 / 500.0; 2]),
        many(20_000, 1e30, |i| row(i, 2e30)),
        many(20_000, 0.5, |i| row(i, 1.0)),
    ];
    for sheets in &maps {
        let mesh = TriangleMesh::new(
            (0..sheets.uvs.len())
                .map(|v| [v as f64, (v % 3) as f64, (v % 2) as f64])
                .collect(),
            sheets.triangles.clone(),
        )
        .unwrap();
        let uv = UvMap::new(sheets.uvs.clone(), sheets.triangles.clone()).unwrap();
        for check in [LIGHTMAP, TEXTURE] {
            let started = Instant::now();
            let found = findings(&mesh, &uv, &check).unwrap();
            let seconds = started.elapsed().as_secs_f64();
            assert!(seconds < 60.0, "{seconds} s");
            assert!(!found.is_empty() || sheets.uvs[5][0] > 0.0);
            assert!(found.iter().all(|one| !one.worst.is_nan()));
        }
    }
}

#[test]
fn checks_without_sense_are_named() {
    let of = |change: fn(&mut EngineCheck)| {
        let mut check = LIGHTMAP;
        change(&mut check);
        check.problem().unwrap_or("").split(' ').next()
    };
    assert_eq!(of(|_| ()), Some(""));
    assert_eq!(of(|c| c.resolution = 0), Some("resolution"));
    assert_eq!(of(|c| c.margin = -1.0), Some("margin"));
    assert_eq!(of(|c| c.margin = f64::NAN), Some("margin"));
    assert_eq!(of(|c| c.least_width = 300.0), Some("least-width"));
    assert_eq!(of(|c| c.density_spread = 0.5), Some("density-spread"));
    assert_eq!(of(|c| c.density_spread = f64::NAN), Some("density-spread"));
    // Even so, nothing fails.
    let two = Sheets::default()
        .square([10.0; 2], 20.0)
        .square([33.0; 2], 20.0);
    for value in [f64::NAN, f64::INFINITY, -1.0, 0.0] {
        let check = EngineCheck {
            margin: value,
            least_width: value,
            density_spread: value,
            resolution: 0,
            ..LIGHTMAP
        };
        two.findings(&check);
    }
}

/// 1,600 charts of 64 triangles each, 3 texels apart in one square of 1024: with a margin of 4 each is
/// near its neighbours.
#[test]
fn a_hundred_thousand_triangles_take_about_a_second() {
    let (mut positions, mut uvs, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    let (rows, squares) = (40_u32, [8_u32, 4]);
    for chart in 0..rows * rows {
        let first = uvs.len() as u32;
        let low = [chart % rows, chart / rows].map(|c| 25.0 * f64::from(c));
        for y in 0..=squares[1] {
            for x in 0..=squares[0] {
                let q = [
                    low[0] + f64::from(x) * 22.0 / 8.0,
                    low[1] + f64::from(y) * 22.0 / 4.0,
                ];
                positions.push([q[0], q[1], f64::from(chart)]);
                uvs.push(q.map(|c| (c / 1024.0) as f32));
            }
        }
        for y in 0..squares[1] {
            for x in 0..squares[0] {
                let a = first + y * (squares[0] + 1) + x;
                let c = a + squares[0] + 2;
                triangles.extend([[a, a + 1, c], [a, c, c - 1]]);
            }
        }
    }
    let mesh = TriangleMesh::new(positions, triangles.clone()).unwrap();
    let uv = UvMap::new(uvs, triangles).unwrap();
    let started = Instant::now();
    let found = findings(
        &mesh,
        &uv,
        &EngineCheck {
            margin: 4.0,
            ..EngineCheck::LIGHTMAP
        },
    )
    .unwrap();
    let seconds = started.elapsed().as_secs_f64();
    println!("{} triangles: {seconds:.2} s", uv.triangles().len());
    assert_eq!(found.len(), 1);
    // Beside and above each other; across the corners they are 3 √2 apart.
    assert_eq!((found[0].kind, found[0].count), (Kind::Near, 2 * 40 * 39));
    near(found[0].worst, 3.0);
    assert!(seconds < 30.0);
}
