use std::f64::consts::{PI, SQRT_2};

use crate::{SurfaceError, TriangleMesh, UvMap, shapes};

use super::Metrics;

fn near(found: f64, expected: f64) {
    let tolerance = 1e-12 * expected.abs().max(1.0);
    assert!(
        (found - expected).abs() < tolerance,
        "{found} instead of {expected}"
    );
}

/// A flat grid of 1 × 1 on lattice points that are exact in `f32`.
fn square() -> TriangleMesh {
    shapes::rectangle(1.0, 1.0, 4, 4)
}

/// The map that gives each vertex one UV coordinate.
fn per_vertex(mesh: &TriangleMesh, place: impl Fn([f64; 3]) -> [f64; 2]) -> UvMap {
    let uvs = mesh.positions().iter().map(|&p| place(p).map(|c| c as f32));
    UvMap::new(uvs.collect(), mesh.triangles().to_vec()).unwrap()
}

fn measure_mapped(mesh: &TriangleMesh, place: impl Fn([f64; 3]) -> [f64; 2]) -> Metrics {
    Metrics::measure(mesh, &per_vertex(mesh, place)).unwrap()
}

/// Triangles with corners of their own.
fn soup(corners: &[[[f64; 3]; 3]], uvs: &[[[f32; 2]; 3]]) -> (TriangleMesh, UvMap) {
    let indices = |count: usize| (0..count as u32).map(|t| [0, 1, 2].map(|c| 3 * t + c));
    (
        TriangleMesh::new(corners.concat(), indices(corners.len()).collect()).unwrap(),
        UvMap::new(uvs.concat(), indices(uvs.len()).collect()).unwrap(),
    )
}

fn measure_soup(corners: &[[[f64; 3]; 3]], uvs: &[[[f32; 2]; 3]]) -> Metrics {
    let (mesh, uv) = soup(corners, uvs);
    Metrics::measure(&mesh, &uv).unwrap()
}

const RIGHT: [[f64; 3]; 3] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
const RIGHT_UV: [[f32; 2]; 3] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];

#[test]
fn the_identity_is_perfect() {
    let metrics = measure_mapped(&square(), |[x, y, _]| [x, y]);
    let expected = Metrics {
        vertices: 25,
        triangles: 32,
        degenerate_triangles: 0,
        collapsed_triangles: 0,
        flipped_triangles: 0,
        overlapping_pairs: 0,
        overlap_percentage: 0.0,
        stacked_pairs: 0,
        stacked_charts: 0,
        mirrored_charts: 0,
        conformality: 0.0,
        area_distortion: 1.0,
        symmetric_dirichlet: metrics.symmetric_dirichlet,
        charts: 1,
        seam_length: 0.0,
        uv_coverage: 1.0,
    };
    assert_eq!(metrics, expected);
    near(metrics.symmetric_dirichlet, 4.0);
    assert!(metrics.seam_length.is_sign_positive());
}

#[test]
fn a_shear_has_its_closed_form() {
    // Corners of 90°, 45°, 45° become 135°, atan ½ and 45° − atan ½; J = [1 1; 0 1].
    let metrics = measure_mapped(&square(), |[x, y, _]| [x + y, y]);
    near(metrics.conformality, PI / 6.0);
    near(metrics.area_distortion, 1.0);
    near(metrics.symmetric_dirichlet, 6.0);
    near(metrics.uv_coverage, 0.25);
}

#[test]
fn an_anisotropic_stretch_has_its_closed_form() {
    // σ = 2, 1: 2·√(5 · 5/4).
    let metrics = measure_mapped(&square(), |[x, y, _]| [2.0 * x, y]);
    near(
        metrics.conformality,
        2.0 / 3.0 * (PI / 4.0 - 0.5_f64.atan()),
    );
    near(metrics.area_distortion, 1.0);
    near(metrics.symmetric_dirichlet, 5.0);
    near(metrics.uv_coverage, 0.5);
}

#[test]
fn a_right_triangle_mapped_to_an_equilateral_one() {
    let metrics = measure_soup(
        &[RIGHT],
        &[[[0.0, 0.0], [1.0, 0.0], [0.5, 0.75_f32.sqrt()]]],
    );
    // 90° and twice 45° against 60°.
    assert!((metrics.conformality - PI / 9.0).abs() < 1e-7);
}

#[test]
fn means_are_weighted_by_area() {
    // 3D areas 1/2 and 3/2, both similar to their UV triangles, of σ = 1 and σ = 2.
    let wide = RIGHT.map(|[x, y, _]| [3.0 * x, y, 5.0]);
    let wide_uv = RIGHT_UV.map(|[u, v]| [6.0 * u + 3.0, 2.0 * v]);
    let metrics = measure_soup(&[RIGHT, wide], &[RIGHT_UV, wide_uv]);
    assert_eq!(metrics.conformality, 0.0);
    let (dirichlet, inverse) = ((2.0 + 3.0 * 8.0) / 4.0, (2.0 + 3.0 * 0.5) / 4.0);
    near(
        metrics.symmetric_dirichlet,
        2.0 * f64::sqrt(dirichlet * inverse),
    );
    // Shares 1/4, 3/4 in 3D and 1/13, 12/13 in UV space.
    let exponent = 0.25 * f64::ln(13.0 / 4.0) + 0.75 * f64::ln(16.0 / 13.0);
    near(metrics.area_distortion, exponent.exp());
    assert_eq!(metrics.charts, 2);
    near(metrics.uv_coverage, 6.5 / 81.0);
}

#[test]
fn scale_rotation_and_reflection_change_nothing() {
    let mesh = shapes::open_sphere(0.9, 12, 7);
    let place = |[x, y, z]: [f64; 3]| {
        let factor = 1.0 / (1.1 + z);
        [x * factor, 1.5 * y * factor]
    };
    let reference = measure_mapped(&mesh, place);
    assert!(reference.conformality > 0.05);
    assert!(reference.area_distortion > 1.05);
    assert!(reference.symmetric_dirichlet > 4.05);
    assert_eq!(reference.overlapping_pairs, 0);
    let uv = per_vertex(&mesh, place);
    let mapped = |change: fn([f32; 2]) -> [f32; 2]| {
        let uvs = uv.uvs().iter().map(|&q| change(q)).collect();
        UvMap::new(uvs, uv.triangles().to_vec()).unwrap()
    };
    for changed in [
        mapped(|[u, v]| [-v, u]),
        mapped(|[u, v]| [v, u]),
        mapped(|[u, v]| [0.125 * u, 0.125 * v]),
        mapped(|[u, v]| [-1024.0 * v, 1024.0 * u]),
    ] {
        assert_close(&Metrics::measure(&mesh, &changed).unwrap(), &reference);
    }
    for scale in [3.0, 1e-290, 1e300] {
        let positions = mesh.positions().iter();
        let scaled = positions
            .map(|&[x, y, z]| [z * scale, -x * scale, -y * scale])
            .collect();
        let scaled = TriangleMesh::new(scaled, mesh.triangles().to_vec()).unwrap();
        assert_close(&Metrics::measure(&scaled, &uv).unwrap(), &reference);
    }
}

fn assert_close(found: &Metrics, expected: &Metrics) {
    near(found.conformality, expected.conformality);
    near(found.area_distortion, expected.area_distortion);
    near(found.symmetric_dirichlet, expected.symmetric_dirichlet);
    near(found.seam_length, expected.seam_length);
    near(found.uv_coverage, expected.uv_coverage);
    let rest = Metrics {
        conformality: expected.conformality,
        area_distortion: expected.area_distortion,
        symmetric_dirichlet: expected.symmetric_dirichlet,
        seam_length: expected.seam_length,
        uv_coverage: expected.uv_coverage,
        // A mirrored map has mirrored charts.
        mirrored_charts: expected.mirrored_charts,
        ..found.clone()
    };
    assert_eq!(&rest, expected);
}

#[test]
fn slivers_keep_their_energy() {
    let height: f64 = 1e-9;
    // J = diag(2, 1/height).
    let (dirichlet, inverse) = (4.0 + height.powi(-2), 0.25 + height.powi(2));
    let expected = 2.0 * f64::sqrt(dirichlet * inverse);
    let mut corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.25, 0.0, height]];
    let mut uvs = [[0.0, 0.0], [2.0, 0.0], [0.5, 1.0]];
    for _ in 0..3 {
        corners.rotate_left(1);
        uvs.rotate_left(1);
        let metrics = measure_soup(&[corners], &[uvs]);
        assert!((metrics.symmetric_dirichlet / expected - 1.0).abs() < 1e-6);
    }
}

#[test]
fn a_collapsed_triangle_has_angles_but_infinite_distortion() {
    // 90°, 45°, 45° against 180°, 0°, 0° or 0°, 180°, 0° on a line, 0° at a double point.
    for (collapsed, differences) in [
        ([[0.0, 0.0], [-1.0, -1.0], [2.0, 2.0]], PI),
        ([[0.0, 0.0], [1.0, 1.0], [3.0, 3.0]], 1.5 * PI),
        ([[0.0, 0.0], [-1.0, -1.0], [0.0, 0.0]], PI),
        ([[0.5, 0.5], [0.5, 0.5], [0.5, 0.5]], PI),
    ] {
        let metrics = measure_soup(&[RIGHT, RIGHT], &[RIGHT_UV, collapsed]);
        near(metrics.conformality, differences / 6.0);
        assert_eq!(metrics.collapsed_triangles, 1);
        assert_eq!(metrics.degenerate_triangles, 0);
        assert_eq!(metrics.area_distortion, f64::INFINITY);
        assert_eq!(metrics.symmetric_dirichlet, f64::INFINITY);
        assert_eq!(metrics.flipped_triangles, 0);
        assert_eq!(metrics.overlapping_pairs, 0);
    }
}

#[test]
fn a_map_to_one_point_has_no_nan() {
    let metrics = measure_mapped(&square(), |_| [0.25, 0.75]);
    assert_eq!(metrics.collapsed_triangles, 32);
    near(metrics.conformality, PI / 3.0);
    assert_eq!(metrics.area_distortion, f64::INFINITY);
    assert_eq!(metrics.symmetric_dirichlet, f64::INFINITY);
    assert_eq!(metrics.uv_coverage, 0.0);
}

#[test]
fn degenerate_triangles_are_counted_and_left_out() {
    let point = [[1.0, 0.0, 0.0]; 3];
    // Collinear but for the rounding of the coordinates.
    let line = [[0.1, 0.2, 0.3], [0.2, 0.4, 0.6], [0.3, 0.6, 0.9]];
    let sliver = [[0.0; 3], [1.0, 0.0, 0.0], [2.0, 1e-12, 0.0]];
    let uvs = [
        RIGHT_UV,
        [[3.0, 0.0], [4.0, 0.0], [4.0, 2.0]],
        [[6.0, 0.0], [6.0, 0.0], [6.0, 0.0]],
    ];
    let metrics = measure_soup(&[RIGHT, point, line], &uvs);
    assert_eq!(metrics.degenerate_triangles, 2);
    assert_eq!(metrics.collapsed_triangles, 0);
    assert_eq!(metrics.charts, 1);
    assert_eq!(metrics.conformality, 0.0);
    assert_eq!(metrics.area_distortion, 1.0);
    near(metrics.symmetric_dirichlet, 4.0);
    near(metrics.uv_coverage, 1.5 / 36.0);
    let metrics = measure_soup(&[RIGHT, sliver], &uvs[..2]);
    assert_eq!(metrics.degenerate_triangles, 0);
    assert_eq!(metrics.charts, 2);
}

#[test]
fn what_cannot_be_measured_is_an_error() {
    let (mesh, uv) = soup(&[RIGHT, RIGHT], &[RIGHT_UV]);
    assert!(matches!(
        Metrics::measure(&mesh, &uv),
        Err(SurfaceError::LengthMismatch {
            expected: 2,
            found: 1,
            ..
        })
    ));
    let (mesh, uv) = soup(&[[[0.0; 3]; 3], [[7.0; 3]; 3]], &[RIGHT_UV, RIGHT_UV]);
    assert!(matches!(
        Metrics::measure(&mesh, &uv),
        Err(SurfaceError::TooSmall(_))
    ));
}

#[test]
fn extreme_coordinates_give_numbers() {
    let sizes = [f64::MAX, 1e-300, 5e-324];
    let uv_sizes = [f32::MAX, 1e-38, 1e-45];
    for (size, uv_size) in sizes.into_iter().zip(uv_sizes) {
        let corners = RIGHT.map(|p| p.map(|c| (2.0 * c - 1.0) * size));
        let uvs = RIGHT_UV.map(|q| q.map(|c| (2.0 * c - 1.0) * uv_size));
        let metrics = measure_soup(&[corners, RIGHT], &[uvs, RIGHT_UV]);
        for value in [
            metrics.conformality,
            metrics.area_distortion,
            metrics.symmetric_dirichlet,
            metrics.seam_length,
            metrics.uv_coverage,
        ] {
            assert!(value >= 0.0, "{metrics:?}");
        }
        let alone = measure_soup(&[corners], &[uvs]);
        near(alone.symmetric_dirichlet, 4.0);
        near(alone.conformality, 0.0);
    }
}

/// An open fan around the vertex 0 of four right triangles, the last of which can be
/// folded back over the third in UV space.
fn fan(folded: bool) -> (TriangleMesh, UvMap) {
    let ring = [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0]];
    let positions = [[0, 0]]
        .into_iter()
        .chain(ring)
        .map(|q: [i8; 2]| [f64::from(q[0]), f64::from(q[1]), 0.0]);
    let positions: Vec<_> = positions.collect();
    let mut uvs: Vec<_> = positions
        .iter()
        .map(|p| [p[0] as f32, p[1] as f32])
        .collect();
    if folded {
        uvs[5] = [0.0, 1.0];
    }
    let triangles: Vec<_> = (1..5).map(|i| [0, i, i + 1]).collect();
    (
        TriangleMesh::new(positions, triangles.clone()).unwrap(),
        UvMap::new(uvs, triangles).unwrap(),
    )
}

#[test]
fn a_triangle_folded_back_is_flipped() {
    for (folded, flipped) in [(false, 0), (true, 1)] {
        let (mesh, uv) = fan(folded);
        let metrics = Metrics::measure(&mesh, &uv).unwrap();
        assert_eq!(metrics.flipped_triangles, flipped);
        assert_eq!(metrics.overlapping_pairs, flipped as u64);
        assert_eq!(metrics.charts, 1);
        near(metrics.overlap_percentage, 100.0 * flipped as f64 / 6.0);
    }
}

#[test]
fn orientation_is_relative_to_the_chart() {
    // A mirrored triangle that is a chart of its own.
    let away = RIGHT.map(|[x, y, z]| [x, y, z + 1.0]);
    let mirrored = [[3.0, 0.0], [3.0, 1.0], [4.0, 0.0]];
    let metrics = measure_soup(&[RIGHT, away], &[RIGHT_UV, mirrored]);
    assert_eq!(metrics.flipped_triangles, 0);
    assert_eq!(metrics.charts, 2);
    // Two triangles and one folded back over them: the larger number is the majority, however
    // large the one is. Of two equal numbers the counter-clockwise one is.
    let below = [RIGHT[1], RIGHT[0], [0.0, -1.0, 0.0]];
    let beside = [RIGHT[2], RIGHT[1], [1.0, 1.0, 0.0]];
    let beside_uv = [RIGHT_UV[2], RIGHT_UV[1], [1.0, 1.0]];
    for tip in [30.0, 1.0] {
        let folded = [RIGHT_UV[1], RIGHT_UV[0], [0.0, tip]];
        let metrics = measure_soup(&[RIGHT, beside, below], &[RIGHT_UV, beside_uv, folded]);
        assert_eq!((metrics.charts, metrics.flipped_triangles), (1, 1));
        let metrics = measure_soup(&[RIGHT, below], &[RIGHT_UV, folded]);
        assert_eq!((metrics.charts, metrics.flipped_triangles), (1, 1));
    }
}

#[test]
fn mixed_winding_flips_nothing() {
    for reversed in 0..16_u32 {
        let turned = |triangles: &[[u32; 3]]| -> Vec<[u32; 3]> {
            let turn = |(i, &[a, b, c]): (usize, &[u32; 3])| match reversed >> i & 1 {
                0 => [a, b, c],
                _ => [a, c, b],
            };
            triangles.iter().enumerate().map(turn).collect()
        };
        for (folded, flipped) in [(false, 0), (true, 1)] {
            let (mesh, uv) = fan(folded);
            let triangles = turned(mesh.triangles());
            let mesh = TriangleMesh::new(mesh.positions().to_vec(), triangles.clone()).unwrap();
            let uv = UvMap::new(uv.uvs().to_vec(), triangles).unwrap();
            let metrics = Metrics::measure(&mesh, &uv).unwrap();
            assert_eq!(metrics.flipped_triangles, flipped, "{reversed:04b}");
        }
    }
}

/// The four walls of a cube, unrolled to a strip that is cut before each wall in `cuts`;
/// every wall has two triangles, and positions are shared.
fn walls(cuts: [bool; 4]) -> (TriangleMesh, UvMap) {
    let ring = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let positions = [0.0, 1.0]
        .into_iter()
        .flat_map(|z| ring.map(|[x, y]| [x, y, z]))
        .collect();
    let (mut triangles, mut uvs, mut uv_triangles) = (vec![], vec![], vec![]);
    let mut start = 0.0;
    for wall in 0..4_u32 {
        let next = (wall + 1) % 4;
        triangles.extend([[wall, next, next + 4], [wall, next + 4, wall + 4]]);
        if cuts[wall as usize] {
            start += 1.0;
        }
        let first = uvs.len() as u32;
        uvs.extend([
            [start, 0.0],
            [start + 1.0, 0.0],
            [start + 1.0, 1.0],
            [start, 1.0],
        ]);
        uv_triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        start += 1.0;
    }
    (
        TriangleMesh::new(positions, triangles).unwrap(),
        UvMap::new(uvs, uv_triangles).unwrap(),
    )
}

#[test]
fn a_cut_cylinder_has_charts_and_seams() {
    for (cuts, charts) in [
        // The strip never closes: its ends differ without a gap before the first wall.
        ([false; 4], 1),
        ([true, false, false, false], 1),
        ([false, true, false, false], 2),
        ([true, false, true, false], 2),
        ([true; 4], 4),
    ] {
        let (mesh, uv) = walls(cuts);
        let metrics = Metrics::measure(&mesh, &uv).unwrap();
        assert_eq!(metrics.charts, charts);
        // Each seam has length 1, the surface area 4.
        near(metrics.seam_length, charts as f64 / 2.0);
        assert_eq!(metrics.overlapping_pairs, 0);
    }
}

#[test]
fn vertices_at_one_position_are_one_vertex() {
    let (mesh, uv) = walls([false, true, false, false]);
    // Zeros of either sign are equal.
    let corners: Vec<_> = (0..8)
        .map(|t| {
            let zero = [-0.0, 0.0][t % 2];
            mesh.corners(t)
                .map(|p| p.map(|c| if c == 0.0 { zero } else { c }))
        })
        .collect();
    let uvs: Vec<_> = (0..8)
        .map(|t| {
            let zero = [-0.0, 0.0][t % 2];
            uv.corners(t)
                .map(|q| q.map(|c| if c == 0.0 { zero } else { c }))
        })
        .collect();
    let expected = Metrics {
        vertices: 24,
        ..Metrics::measure(&mesh, &uv).unwrap()
    };
    assert_eq!(measure_soup(&corners, &uvs), expected);
}

#[test]
fn a_non_manifold_edge_joins_the_triangles_of_equal_uvs() {
    let wing = |y: f64, z: f64| [[0.0; 3], [1.0, 0.0, 0.0], [0.0, y, z]];
    let corners = [wing(1.0, 0.0), wing(-1.0, 0.0), wing(0.0, 1.0)];
    let wing_uv = |v: f32, shift: f32| [[shift, 0.0], [1.0 + shift, 0.0], [shift, v]];
    for (shift, charts, seam) in [(0.0, 1, 0.0), (2.0, 2, 1.0)] {
        let uvs = [wing_uv(1.0, 0.0), wing_uv(-1.0, 0.0), wing_uv(2.0, shift)];
        let metrics = measure_soup(&corners, &uvs);
        assert_eq!(metrics.charts, charts);
        near(metrics.seam_length, seam / 1.5_f64.sqrt());
    }
}

#[test]
fn an_edge_of_zero_length_joins_nothing() {
    // Two triangles that share the origin, each with a degenerate neighbour that has the
    // origin twice, at the same two UV points.
    let [origin, right, _] = RIGHT;
    let opposite = RIGHT.map(|p| p.map(|c| -c));
    let (here, there, left_uv) = ([0.0, 0.0], [5.0, 5.0], [4.0, 5.0]);
    let metrics = measure_soup(
        &[
            RIGHT,
            [origin, origin, right],
            opposite,
            [origin, origin, opposite[1]],
        ],
        &[
            RIGHT_UV,
            [here, there, RIGHT_UV[1]],
            [there, left_uv, [5.0, 4.0]],
            [here, there, left_uv],
        ],
    );
    assert_eq!(metrics.charts, 2);
    assert_eq!(metrics.degenerate_triangles, 2);
    near(metrics.seam_length, 2.0);
}

#[test]
fn a_triangle_makes_no_seam_with_itself() {
    let apart = [[2.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0]];
    let metrics = measure_soup(&[RIGHT, apart], &[RIGHT_UV, RIGHT_UV]);
    assert_eq!(metrics.seam_length, 0.0);
}

#[test]
fn one_differing_end_is_a_seam() {
    // A quad opened at one end of its diagonal, as at the tip of a cut.
    let other = [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let uvs = |end: f32| [RIGHT_UV, [[1.0, 0.0], [1.0, 1.0], [end, 1.0]]];
    let closed = measure_soup(&[RIGHT, other], &uvs(0.0));
    assert_eq!((closed.charts, closed.seam_length), (1, 0.0));
    let open = measure_soup(&[RIGHT, other], &uvs(0.5));
    assert_eq!(open.charts, 2);
    near(open.seam_length, SQRT_2);
}

#[test]
fn json_has_flat_fields_and_null_for_infinity() {
    let finite = measure_mapped(&square(), |[x, y, _]| [x + y, y]);
    let json = serde_json::to_value(&finite).unwrap();
    assert_eq!(json["triangles"], 32);
    assert_eq!(json["charts"], 1);
    assert!(json["symmetric_dirichlet"].is_f64());
    assert!(json.as_object().unwrap().values().all(|v| v.is_number()));
    assert_eq!(serde_json::from_value::<Metrics>(json).unwrap(), finite);
    let infinite = measure_mapped(&square(), |_| [0.0, 0.0]);
    let json = serde_json::to_value(&infinite).unwrap();
    assert!(json["area_distortion"].is_null());
    assert!(json["symmetric_dirichlet"].is_null());
    assert_eq!(serde_json::from_value::<Metrics>(json).unwrap(), infinite);
}

#[test]
fn the_table_is_aligned() {
    let metrics = measure_mapped(&square(), |[x, y, _]| [x + y, y]);
    let table = metrics.to_string();
    let lines: Vec<_> = table.lines().collect();
    assert_eq!(lines.len(), 13);
    assert_eq!(lines[1], "triangles                        32");
    assert_eq!(lines[6], "overlap percentage         0.000000 %");
    assert_eq!(lines[7], "conformality               0.523599 rad");
    let columns = lines.iter().map(|line| line[..35].trim_end().len());
    assert!(columns.into_iter().all(|column| column == 35));
    let collapsed = measure_mapped(&square(), |_| [0.0, 0.0]).to_string();
    assert!(collapsed.contains("area distortion                 inf"));
}

/// A square, front and back, over vertices of their own or the same; in any order.
#[test]
fn a_sheet_drawn_front_and_back_is_one_chart_without_flips() {
    let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
    let both = [corners, corners].concat();
    for triangles in [
        [[2, 1, 0], [5, 6, 4], [2, 3, 1], [5, 7, 6]],
        [[2, 1, 0], [1, 2, 0], [2, 3, 1], [1, 3, 2]],
        [[5, 6, 4], [2, 1, 0], [5, 7, 6], [2, 3, 1]],
    ] {
        let mesh = TriangleMesh::new(both.clone(), triangles.to_vec()).unwrap();
        let metrics = measure_mapped(&mesh, |[x, y, _]| [x, y]);
        let found = (
            metrics.charts,
            metrics.flipped_triangles,
            metrics.overlapping_pairs,
        );
        assert_eq!(found, (1, 0, 0));
        assert_eq!(metrics.seam_length, 0.0);
    }
}

#[test]
fn a_triangle_drawn_twice_is_no_overlap_but_one_laid_over_another_is() {
    let [a, b, c] = RIGHT;
    let [p, q, r] = RIGHT_UV;
    let twice = measure_soup(&[RIGHT, [a, c, b]], &[RIGHT_UV, [p, r, q]]);
    assert_eq!((twice.overlapping_pairs, twice.flipped_triangles), (0, 0));
    let turned = measure_soup(&[RIGHT, [a, c, b]], &[RIGHT_UV, [q, p, r]]);
    assert_eq!(turned.overlapping_pairs, 1);
    let above = RIGHT.map(|[x, y, z]| [x, y, z + 1.0]);
    let others = measure_soup(&[RIGHT, above], &[RIGHT_UV, RIGHT_UV]);
    assert_eq!(others.overlapping_pairs, 1);
}
