use super::*;
use crate::shapes;
use rand::{RngExt, SeedableRng};

fn components(mesh: &TriangleMesh) -> Components {
    Components::of(mesh, &[]).unwrap()
}

fn mesh(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> TriangleMesh {
    TriangleMesh::new(positions.to_vec(), triangles.to_vec()).unwrap()
}

const FIVE: [[f64; 3]; 5] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [-1.0, -1.0, 0.0],
];

#[test]
fn a_manifold_mesh_is_its_only_component() {
    let torus = shapes::torus(1.0, 0.4, 12, 8);
    let found = components(&torus);
    assert_eq!(found.conditioning, Conditioning::default());
    assert_eq!(found.list.len(), 1);
    let component = &found.list[0];
    let back = |t: &[u32; 3]| t.map(|v| component.vertices[v as usize]);
    let triangles: Vec<_> = component.mesh.triangles().iter().map(back).collect();
    assert_eq!(triangles, torus.triangles());
    assert_eq!(component.mesh.positions().len(), torus.positions().len());
}

#[test]
fn a_mesh_split_at_every_corner_hangs_together_again() {
    let torus = shapes::torus(1.0, 0.4, 12, 8);
    let soup = soup(&torus);
    let found = components(&soup);
    assert_eq!(found.list.len(), 1);
    assert_eq!(
        found.list[0].mesh.positions().len(),
        torus.positions().len()
    );
    let welded = soup.positions().len() - torus.positions().len();
    assert_eq!(found.conditioning.welded_vertices, welded);
}

fn sizes(found: &Components) -> Vec<usize> {
    let list = found.list.iter();
    list.map(|c| c.mesh.triangles().len()).collect()
}

#[test]
fn the_flattest_pair_of_three_triangles_stays_joined() {
    let fins = mesh(&FIVE, &[[0, 1, 2], [0, 1, 3], [1, 0, 4]]);
    let found = components(&fins);
    assert_eq!(found.of_triangle, [Some(0), Some(1), Some(0)]);
    assert_eq!(found.conditioning.non_manifold_edges, 1);
    assert_eq!(found.conditioning.non_manifold_vertices, 0);
    assert_eq!(found.cuts(&fins, false), [[0, 1]]);
    assert_eq!(found.list[0].mesh.positions().len(), 4);
    // The same from triangles that share no vertex of the file.
    let soup = soup(&fins);
    let found = components(&soup);
    assert_eq!(found.of_triangle, [Some(0), Some(1), Some(0)]);
    assert_eq!(found.cuts(&soup, false), [[0, 1]]);
    // One winding goes before a flat angle.
    let turned = components(&mesh(&FIVE, &[[0, 1, 2], [1, 0, 3], [0, 1, 4]]));
    assert_eq!(turned.of_triangle, [Some(0), Some(0), Some(1)]);
    // Labels go before both.
    let labelled = Components::of(&fins, &[0, 1, 1]).unwrap();
    assert_eq!(labelled.of_triangle, [Some(0), Some(1), Some(1)]);
}

#[test]
fn two_sheets_that_cross_go_on() {
    let mut positions = FIVE.to_vec();
    positions.push([0.5, 0.0, -1.0]);
    let crossing = mesh(&positions, &[[0, 1, 2], [0, 1, 3], [1, 0, 4], [1, 0, 5]]);
    let found = components(&crossing);
    assert_eq!(found.of_triangle, [Some(0), Some(1), Some(0), Some(1)]);
    assert_eq!(found.conditioning.non_manifold_edges, 1);
    assert_eq!(found.cuts(&crossing, false), [] as [[u32; 2]; 0]);
}

/// A closed tetrahedron with a fin that continues one of its sides.
#[test]
fn a_surface_that_comes_back_to_its_own_edge_is_taken_apart_there() {
    let positions = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.5, 1.0, 0.0],
        [0.5, 0.5, 1.0],
        [0.5, -1.0, 0.0],
    ];
    let triangles = [[1, 0, 2], [0, 1, 3], [0, 3, 2], [1, 2, 3], [0, 1, 4]];
    let found = components(&mesh(&positions, &triangles));
    assert_eq!(sizes(&found), [4, 1]);
    assert_eq!(found.list[0].mesh.positions().len(), 4);
}

/// The walls between the cells of a grid of so many along each side, each wound at random.
fn foam(cells: u32) -> TriangleMesh {
    let side = cells + 1;
    let vertex = |[x, y, z]: [u32; 3]| x + side * (y + side * z);
    let mut random = rand_pcg::Pcg64::seed_from_u64(1);
    let mut triangles = Vec::new();
    for place in 0..side.pow(3) {
        let at = [place % side, place / side % side, place / side / side];
        for axis in 0..3 {
            let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
            if at[u] == cells || at[v] == cells {
                continue;
            }
            let corner = |du: u32, dv: u32| {
                let mut to = at;
                to[u] += du;
                to[v] += dv;
                vertex(to)
            };
            let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            let wall = if random.random() {
                [a, b, c, d]
            } else {
                [a, d, c, b]
            };
            let [a, b, c, d] = wall;
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    let place = |v: u32| [v % side, v / side % side, v / side / side].map(f64::from);
    mesh(&(0..side.pow(3)).map(place).collect::<Vec<_>>(), &triangles)
}

/// A mesh whose triangles share no vertex of the file.
fn soup(mesh: &TriangleMesh) -> TriangleMesh {
    let count = mesh.triangles().len() as u32;
    let positions = (0..count as usize).flat_map(|t| mesh.corners(t));
    let triangles = (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
    self::mesh(
        &positions.collect::<Vec<_>>(),
        &triangles.collect::<Vec<_>>(),
    )
}

/// Taking apart all sides at once at an edge that the surface comes back to would leave three parts.
#[test]
fn foam_is_one_manifold() {
    let foam = foam(3);
    for foam in [soup(&foam), foam] {
        let found = components(&foam);
        assert!(found.conditioning.non_manifold_edges > 50);
        assert_eq!(found.list.len(), 1);
        assert_eq!(sizes(&found), [foam.triangles().len()]);
        let triangles = found.list[0].mesh.triangles();
        let mut edges: Vec<[u32; 2]> = triangles
            .iter()
            .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
            .map(|[a, b]| [a.min(b), a.max(b)])
            .collect();
        edges.sort_unstable();
        assert!(edges.chunk_by(|a, b| a == b).all(|sides| sides.len() <= 2));
    }
}

/// A disc of so many sectors; every `every`-th spoke bears a fin.
fn hub(sectors: u32, every: u32) -> TriangleMesh {
    let angle = |i: u32| std::f64::consts::TAU * f64::from(i) / f64::from(sectors);
    let mut positions = vec![[0.0; 3]];
    let rim = (0..sectors).map(|i| [angle(i).cos(), angle(i).sin(), 0.0]);
    positions.extend(rim);
    let mut triangles: Vec<[u32; 3]> = (0..sectors)
        .map(|i| [0, 1 + i, 1 + (i + 1) % sectors])
        .collect();
    for i in (0..sectors).step_by(every as usize) {
        positions.push([angle(i).cos(), angle(i).sin(), 1.0]);
        triangles.push([0, 1 + i, positions.len() as u32 - 1]);
    }
    mesh(&positions, &triangles)
}

/// Walking around the hub once for every spoke would take minutes.
#[test]
fn a_hub_of_many_triangles_is_soon_joined() {
    let disc = hub(200_000, 200_000);
    for disc in [soup(&disc), disc] {
        assert_eq!(sizes(&components(&disc)), [200_000, 1]);
    }
    let finned = hub(60_000, 1);
    let count = |found: &Components| sizes(found).iter().sum::<usize>();
    for finned in [soup(&finned), finned] {
        assert_eq!(count(&components(&finned)), 120_000);
    }
}

/// Boxes side by side, each over vertices of its own.
fn boxes(count: usize) -> TriangleMesh {
    let cube = shapes::cube(1);
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    let low = cube
        .positions()
        .iter()
        .fold(f64::MAX, |low, p| low.min(p[0]));
    let high = cube
        .positions()
        .iter()
        .fold(f64::MIN, |high, p| high.max(p[0]));
    for number in 0..count {
        let first = positions.len() as u32;
        let place = |&[x, y, z]: &[f64; 3]| [x + (high - low) * number as f64, y, z];
        positions.extend(cube.positions().iter().map(place));
        triangles.extend(cube.triangles().iter().map(|t| t.map(|v| first + v)));
    }
    mesh(&positions, &triangles)
}

#[test]
fn parts_that_touch_stay_apart() {
    let row = boxes(5);
    let found = components(&row);
    assert_eq!(sizes(&found), [12; 5]);
    assert_eq!(found.conditioning, Conditioning::default());
    assert_eq!(found.cuts(&row, false), [] as [[u32; 2]; 0]);
    // Each of them laid out by itself: as many charts, and seams along its own edges only.
    let maps: Vec<UvMap> = (0..5)
        .map(|c| {
            let component = &found.list[c].mesh;
            let place = |p: &[f64; 3]| [(p[0] + 0.3 * p[2]) as f32 + 9.0 * c as f32, p[1] as f32];
            let uvs = component.positions().iter().map(place).collect();
            UvMap::new(uvs, component.triangles().to_vec()).unwrap()
        })
        .collect();
    let metrics = crate::metrics::Metrics::measure(&row, &found.uv_map(&maps).unwrap()).unwrap();
    assert_eq!((metrics.charts, metrics.seam_length), (5, 0.0));
}

/// A torus whose vertices were split around two of its rings and at every corner of a patch.
#[test]
fn a_mesh_that_is_split_in_part_hangs_together_again() {
    let torus = shapes::torus(1.0, 0.4, 12, 8);
    let mut positions = torus.positions().to_vec();
    let mut triangles = torus.triangles().to_vec();
    let count = positions.len() as u32;
    positions.extend_from_within(..);
    for (t, triangle) in triangles.iter_mut().enumerate() {
        if (40..80).contains(&t) {
            *triangle = triangle.map(|v| v + count);
        } else if t >= 180 {
            let first = positions.len() as u32;
            positions.extend(torus.corners(t));
            *triangle = [first, first + 1, first + 2];
        }
    }
    let found = components(&mesh(&positions, &triangles));
    assert_eq!(found.list.len(), 1);
    assert_eq!(found.list[0].mesh.positions().len(), count as usize);
    assert_eq!(found.conditioning.non_manifold_edges, 0);
}

#[test]
fn sheets_that_lie_on_each_other_are_not_sewn_together() {
    let square = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let both = [square, square].concat();
    // Divided along different diagonals, so that no triangle repeats another.
    let sheets = mesh(&both, &[[0, 1, 2], [0, 2, 3], [4, 7, 5], [5, 7, 6]]);
    assert_eq!(sizes(&components(&sheets)), [2, 2]);
}

#[test]
fn duplicates_share_their_uvs_or_have_their_own() {
    let sheet = shapes::rectangle(1.0, 1.0, 3, 2);
    let count = sheet.positions().len() as u32;
    let back = |first: u32| {
        let triangles = sheet.triangles().iter();
        triangles.map(move |&[a, b, c]| [first + a, first + c, first + b])
    };
    for (first, positions) in [
        (0, sheet.positions().to_vec()),
        (count, sheet.positions().repeat(2)),
    ] {
        let triangles: Vec<_> = sheet
            .triangles()
            .iter()
            .copied()
            .chain(back(first))
            .collect();
        let double = mesh(&positions, &triangles);
        let shared = components(&double);
        assert_eq!(
            (sizes(&shared), shared.conditioning.duplicate_triangles),
            (vec![12], 12)
        );
        let apart = Components::with(&double, &[7; 24], Duplicates::Separate).unwrap();
        assert_eq!(
            (sizes(&apart), apart.conditioning.duplicate_triangles),
            (vec![12; 2], 0)
        );
        assert!(apart.list.iter().all(|c| c.label == 7));
        assert_eq!(apart.cuts(&double, false), [] as [[u32; 2]; 0]);
        let maps = [exploded(&apart.list[0], 0.0), exploded(&apart.list[1], 1.0)];
        let map = apart.uv_map(&maps).unwrap();
        for t in 0..24 {
            assert!(map.corners(t).iter().all(|uv| uv[0] == (t / 12) as f32));
        }
    }
}

#[test]
fn triangles_that_touch_in_a_vertex_are_apart() {
    let bow = mesh(&FIVE, &[[0, 1, 2], [0, 3, 4]]);
    let found = components(&bow);
    assert_eq!(found.list.len(), 2);
    assert_eq!(found.conditioning.non_manifold_vertices, 1);
    assert_eq!(found.conditioning.non_manifold_edges, 0);
    assert_eq!(found.of_triangle, [Some(0), Some(1)]);
}

#[test]
fn a_pinched_vertex_inside_one_component_is_split() {
    // A strip of triangles that comes back to its first vertex.
    let positions = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [2.0, 0.5, 1.0],
        [1.0, 2.0, 1.0],
        [-1.0, 1.0, 1.0],
    ];
    let strip = mesh(
        &positions,
        &[[0, 1, 2], [1, 3, 2], [2, 3, 4], [2, 4, 5], [4, 0, 5]],
    );
    let found = components(&strip);
    assert_eq!(found.list.len(), 1);
    assert_eq!(found.conditioning.non_manifold_vertices, 1);
    assert_eq!(found.list[0].mesh.positions().len(), 7);
    assert_eq!(
        found.list[0].vertices.iter().filter(|&&v| v == 0).count(),
        2
    );
}

#[test]
fn repeated_and_collapsed_triangles_are_counted_and_follow_their_neighbours() {
    let mut positions = FIVE.to_vec();
    positions.push(FIVE[1]);
    positions.push([9.0; 3]);
    let messy = mesh(
        &positions,
        &[
            [0, 1, 2],
            [2, 5, 0],
            [1, 5, 3],
            [0, 3, 4],
            [6, 6, 6],
            [0, 2, 2],
        ],
    );
    let found = components(&messy);
    let expected = Conditioning {
        welded_vertices: 1,
        unreferenced_vertices: 0,
        duplicate_triangles: 1,
        zero_area_triangles: 3,
        non_manifold_edges: 0,
        non_manifold_vertices: 1,
    };
    assert_eq!(found.conditioning, expected);
    let of_triangle = [Some(0), Some(0), Some(0), Some(1), None, Some(0)];
    assert_eq!(found.of_triangle, of_triangle);
    assert_eq!(found.list[0].mesh.triangles().len(), 1);
}

/// The map of a component with three UVs of its own for each triangle.
fn exploded(component: &Component, tag: f32) -> UvMap {
    let count = component.mesh.triangles().len() as u32;
    let uvs = (0..3 * count).map(|i| [tag, i as f32]).collect();
    let triangles = (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
    UvMap::new(uvs, triangles.collect()).unwrap()
}

#[test]
fn maps_with_seams_reach_every_triangle() {
    let mut positions = FIVE.to_vec();
    positions.push(FIVE[1]);
    positions.push([9.0; 3]);
    let messy = mesh(
        &positions,
        &[
            [0, 1, 2],
            [2, 5, 0],
            [1, 5, 3],
            [0, 3, 4],
            [6, 6, 6],
            [0, 2, 2],
            [3, 2, 3],
        ],
    );
    let found = components(&messy);
    assert_eq!(found.list.len(), 2);
    let maps = [exploded(&found.list[0], 0.0), exploded(&found.list[1], 1.0)];
    let map = found.uv_map(&maps).unwrap();
    let corners: Vec<_> = (0..7).map(|t| map.corners(t)).collect();
    let expected = [
        [[0.0, 0.0], [0.0, 1.0], [0.0, 2.0]],
        [[0.0, 2.0], [0.0, 1.0], [0.0, 0.0]],
        // Both ends of the edge are vertex 1, which the first triangle has.
        [[0.0, 1.0]; 3],
        [[1.0, 0.0], [1.0, 1.0], [1.0, 2.0]],
        [[0.0, 0.0]; 3],
        [[0.0, 0.0], [0.0, 2.0], [0.0, 2.0]],
        [[1.0, 1.0]; 3],
    ];
    assert_eq!(corners, expected);
    assert!(found.uv_map(&maps[..1]).is_err());
    assert!(found.uv_map(&[maps[0].clone(), maps[0].clone()]).is_ok());
    let torus = components(&shapes::torus(1.0, 0.4, 12, 8));
    assert!(torus.uv_map(&maps[..1]).is_err());
}

/// The two vertices that a pinched one was split into may have different UVs.
#[test]
fn the_sides_of_a_pinched_vertex_keep_their_uvs() {
    let positions = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [2.0, 0.5, 1.0],
        [1.0, 2.0, 1.0],
        [-1.0, 1.0, 1.0],
    ];
    let strip = mesh(
        &positions,
        &[[0, 1, 2], [1, 3, 2], [2, 3, 4], [2, 4, 5], [4, 0, 5]],
    );
    let found = components(&strip);
    let component = &found.list[0];
    let uvs: Vec<[f32; 2]> = (0..7).map(|i| [i as f32, 1.0]).collect();
    let maps = found.vertex_maps(std::slice::from_ref(&uvs)).unwrap();
    let map = found.uv_map(&maps).unwrap();
    for (t, triangle) in component.mesh.triangles().iter().enumerate() {
        assert_eq!(map.corners(t), triangle.map(|v| uvs[v as usize]));
    }
    assert_ne!(map.corners(0)[0], map.corners(4)[1]);
}

#[test]
fn labels_keep_triangles_apart() {
    let square = shapes::rectangle(1.0, 1.0, 2, 1);
    let found = Components::of(&square, &[7, 7, 3, 3]).unwrap();
    let labels: Vec<u32> = found.list.iter().map(|c| c.label).collect();
    assert_eq!(labels, [7, 3]);
    assert_eq!(found.cuts(&square, false), [] as [[u32; 2]; 0]);
    // The triangles of the first square and of the second share one edge.
    assert_eq!(found.cuts(&square, true).len(), 1);
    assert_eq!(found.conditioning, Conditioning::default());
    assert!(Components::of(&square, &[1]).is_err());
}

#[test]
fn only_collapsed_triangles_are_an_error() {
    let points = mesh(&[[0.0; 3], [1.0; 3]], &[[0, 1, 1], [0, 0, 0]]);
    assert!(Components::of(&points, &[]).is_err());
}
