//! Charts in tiles, at given densities and beside others.

use std::ops::ControlFlow;

use super::{Task, doubled_area, moved, together};
use crate::{Beside, LayoutConfig, MeshInput, MeshLayout, PackError, lay_out};
use fam_surface::metrics::for_each_overlapping_pair;
use fam_surface::shapes::{cube, rectangle, sphere};
use fam_surface::{Components, TriangleMesh, UvMap};

fn laid_out(config: &LayoutConfig, input: &MeshInput) -> Result<MeshLayout, PackError> {
    lay_out(config, input, &mut |_| ControlFlow::Continue(()))
}

/// Squares of a side each, far apart.
fn squares(sides: &[f64]) -> TriangleMesh {
    let square =
        |(k, &side): (usize, &f64)| moved(&rectangle(side, side, 2, 2), |p| [p[0], p[1], k as f64]);
    together(&sides.iter().enumerate().map(square).collect::<Vec<_>>())
}

/// The side of each square in the plane.
fn sides_in_plane(layout: &MeshLayout) -> Vec<f64> {
    let area = |uvs: &UvMap| {
        let triangles = 0..uvs.triangles().len();
        triangles
            .map(|t| 0.5 * doubled_area(uvs.corners(t)))
            .sum::<f64>()
    };
    layout
        .components
        .iter()
        .map(|c| area(&c.uvs).sqrt())
        .collect()
}

fn overlapping(maps: &[&UvMap]) -> usize {
    let (mut uvs, mut triangles) = (Vec::new(), Vec::new());
    for map in maps {
        let first = uvs.len() as u32;
        uvs.extend(map.uvs());
        triangles.extend(map.triangles().iter().map(|t| t.map(|v| v + first)));
    }
    let mut count = 0;
    for_each_overlapping_pair(&UvMap::new(uvs, triangles).unwrap(), |_| count += 1);
    count
}

/// The tile in which a map lies as a whole.
fn tile_of(map: &UvMap) -> [u32; 2] {
    let first = map.uvs()[0].map(|c| c as u32);
    for q in map.uvs() {
        assert_eq!(q.map(|c| c as u32), first);
    }
    first
}

#[test]
fn a_square_is_as_large_as_its_texel_density_takes() {
    let mesh = squares(&[2.0, 1.0]);
    let components = Components::of(&mesh, &[]).unwrap();
    for (density, unit) in [(64.0, 1.0), (300.0, 1.0), (64e100, 1e-100)] {
        let mesh = moved(&mesh, |p| p.map(|c| unit * c));
        let components = Components::of(&mesh, &[]).unwrap();
        let config = LayoutConfig {
            texel_density: Some(density),
            margin: 2.0,
            ..LayoutConfig::default()
        };
        let layout = laid_out(&config, &MeshInput::of(&components)).unwrap();
        let square = layout.squares[0];
        assert_eq!((square.tiles, square.margin), (1, 2.0));
        let texels = f64::from(square.resolution);
        for (side, expected) in sides_in_plane(&layout).into_iter().zip([2.0, 1.0]) {
            let expected = expected * density * unit;
            assert!((side * texels - expected).abs() < 0.01, "{side}");
        }
        // No larger than both in a row.
        assert!(texels <= 3.0 * density * unit + 4.0 + 2.0, "{texels}");
    }
    let config = LayoutConfig {
        texel_density: Some(1e300),
        ..LayoutConfig::default()
    };
    assert!(laid_out(&config, &MeshInput::of(&components)).is_err());
}

#[test]
fn charts_are_spread_over_tiles_at_one_scale() {
    let mesh = squares(&[1.0; 6]);
    let components = Components::of(&mesh, &[]).unwrap();
    let config = LayoutConfig {
        tiles: 6,
        ..LayoutConfig::default()
    };
    let layout = laid_out(&config, &MeshInput::of(&components)).unwrap();
    assert_eq!(layout.squares[0].tiles, 6);
    assert!(sides_in_plane(&layout).iter().all(|side| *side > 0.97));
    let mut tiles: Vec<[u32; 2]> = layout.components.iter().map(|c| tile_of(&c.uvs)).collect();
    tiles.sort_unstable();
    assert_eq!(tiles, [0, 1, 2, 3, 4, 5].map(|t| [t, 0]));
}

#[test]
fn tiles_are_added_up_to_the_limit() {
    let mesh = squares(&[1.0; 12]);
    let components = Components::of(&mesh, &[]).unwrap();
    let config = |tiles: u32| LayoutConfig {
        texel_density: Some(900.0),
        resolution: 1024,
        tiles,
        ..LayoutConfig::default()
    };
    let layout = laid_out(&config(20), &MeshInput::of(&components)).unwrap();
    assert_eq!(layout.squares[0].tiles, 12);
    for (component, side) in layout.components.iter().zip(sides_in_plane(&layout)) {
        assert!((1024.0 * side - 900.0).abs() < 0.01, "{side}");
        let [column, row] = tile_of(&component.uvs);
        assert!(column < 10 && 10 * row + column < 12);
    }
    let maps: Vec<&UvMap> = layout.components.iter().map(|c| &c.uvs).collect();
    assert_eq!(overlapping(&maps), 0);
    let refused = laid_out(&config(11), &MeshInput::of(&components));
    let (needed, tiles) = (12, 11);
    assert_eq!(refused, Err(PackError::MoreTiles { needed, tiles }));
}

#[test]
fn squares_of_labels_are_tiles_of_their_own() {
    let mesh = squares(&[1.0, 1.0, 0.5]);
    let labels: Vec<u32> = (0..24).map(|t| t / 8).collect();
    let components = Components::of(&mesh, &labels).unwrap();
    let input = MeshInput {
        squares: &[0, 1, 2],
        ..MeshInput::of(&components)
    };
    let config = |tiles: u32| LayoutConfig {
        tiles,
        ..LayoutConfig::default()
    };
    let layout = laid_out(&config(3), &input).unwrap();
    let tiles: Vec<[u32; 2]> = layout.components.iter().map(|c| tile_of(&c.uvs)).collect();
    assert_eq!(tiles, [[0, 0], [1, 0], [2, 0]]);
    assert!(sides_in_plane(&layout).iter().all(|side| *side > 0.97));
    assert!(laid_out(&config(2), &input).is_err());
}

#[test]
fn weights_enlarge_charts() {
    let mesh = squares(&[1.0, 1.0]);
    let labels: Vec<u32> = (0..16).map(|t| t / 8).collect();
    let components = Components::of(&mesh, &labels).unwrap();
    let input = MeshInput {
        weights: &[1.0, 3.0],
        ..MeshInput::of(&components)
    };
    let layout = laid_out(&LayoutConfig::default(), &input).unwrap();
    let sides = sides_in_plane(&layout);
    assert!((sides[1] / sides[0] - 3.0).abs() < 1e-4, "{sides:?}");
}

#[test]
fn charts_keep_clear_of_those_that_stay() {
    let mesh = together(&[cube(3), moved(&sphere(6), |p| p.map(|c| 0.3 * c + 4.0))]);
    let components = Components::of(&mesh, &[]).unwrap();
    // A frame, and a chart across the border of the first tile and the second.
    let corners = |[x, y]: [f32; 2], [w, h]: [f32; 2]| {
        let [a, b, c, d] = [[x, y], [x + w, y], [x + w, y + h], [x, y + h]];
        [a, b, c, a, c, d]
    };
    let stay = [
        corners([0.1, 0.1], [0.7, 0.05]),
        corners([0.1, 0.2], [0.05, 0.7]),
        corners([0.9, 0.5], [0.3, 0.3]),
        corners([3.0, 0.0], [1.0, 1.0]),
    ];
    let uvs = UvMap::of_corners(&stay.concat()).unwrap();
    for (scale, tiles) in [(0.05, 1), (f64::INFINITY, 1), (0.2, 3)] {
        let beside = Beside {
            uvs: &uvs,
            squares: &[],
            scale,
        };
        let input = MeshInput {
            beside: Some(beside),
            ..MeshInput::of(&components)
        };
        let config = LayoutConfig {
            tiles,
            ..LayoutConfig::default()
        };
        let layout = laid_out(&config, &input).unwrap();
        let mut maps: Vec<&UvMap> = layout.components.iter().map(|c| &c.uvs).collect();
        maps.push(&uvs);
        assert_eq!(overlapping(&maps), 0);
        let area: f64 = components.list[0].mesh.triangle_areas().iter().sum();
        let found = sides_in_plane(&layout)[0] / area.sqrt();
        assert!(found <= scale * 1.01, "{found} of {scale}");
        let is_free = scale > 0.1 || found > 0.99 * scale;
        assert!(is_free, "{found} of {scale}");
    }
}

/// What no random mesh shall break.
#[test]
fn squares_and_tiles_of_anything_are_valid() {
    for (tiles, density, whole_texels) in [
        (1, None, true),
        (4, None, false),
        (9, None, true),
        (1, Some(20.0), false),
        (100, Some(50.0), true),
    ] {
        let mesh = together(&[
            cube(2),
            moved(&sphere(4), |p| p.map(|c| c + 5.0)),
            moved(&rectangle(9.0, 0.01, 3, 1), |p| [p[0], p[1], 9.0]),
        ]);
        let config = LayoutConfig {
            tiles,
            texel_density: density,
            whole_texels,
            resolution: 512,
            ..LayoutConfig::default()
        };
        let task = Task {
            config: config.clone(),
            ..Task::default()
        };
        let outcome = task.run_unchecked(&mesh);
        let metrics = outcome.metrics();
        assert_eq!(
            (metrics.flipped_triangles, metrics.overlapping_pairs),
            (0, 0)
        );
        assert_eq!(metrics.collapsed_triangles, 0);
        for component in &outcome.atlas.components {
            let [column, row] = tile_of(&component.uvs);
            assert!(10 * row + column < tiles);
        }
    }
}
