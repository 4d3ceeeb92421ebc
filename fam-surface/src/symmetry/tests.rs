use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::*;
use crate::TriangleMesh;
use crate::shapes;
use crate::vector::{length, normalize};

fn moved(mesh: &TriangleMesh, place: impl FnMut(&[f64; 3]) -> [f64; 3]) -> TriangleMesh {
    let positions = mesh.positions().iter().map(place).collect();
    TriangleMesh::new(positions, mesh.triangles().to_vec()).unwrap()
}

/// A head with a nose: symmetric at x = 0 alone.
fn head() -> TriangleMesh {
    moved(&shapes::sphere(8), |&[x, y, z]| {
        let nose = 0.5 * (-8.0 * (x * x + (z - 0.1) * (z - 0.1))).exp() * y.max(0.0);
        [0.8 * x, y + nose, 1.2 * z + 0.2 * y * y]
    })
}

/// A surface without any symmetry.
fn odd() -> TriangleMesh {
    moved(&shapes::sphere(10), |&[x, y, z]| {
        let r = 1.0 + 0.4 * x * y * z + 0.3 * x * x * x + 0.2 * y * z * z;
        [
            1.4 * r * x + 0.4 * y * z,
            0.8 * r * y + 0.5 * x * x,
            r * z + 0.4 * x * y,
        ]
    })
}

fn turned([x, y, z]: [f64; 3]) -> [f64; 3] {
    let (sin, cos) = 0.7_f64.sin_cos();
    let [x, y] = [cos * x - sin * y, sin * x + cos * y];
    let (sin, cos) = 0.4_f64.sin_cos();
    [x, cos * y - sin * z, sin * y + cos * z]
}

#[test]
fn an_exact_plane_across_an_axis_is_found_as_it_is() {
    assert_eq!(find(&head()), Some(MirrorPlane::across(0, 0.0)));
    let moved = moved(&head(), |&[x, y, z]| [y, x + 0.5, z]);
    let plane = find(&moved).unwrap();
    assert_eq!((plane.axis(), plane.offset()), (Some(1), 0.5));
    let pairing = paired(&moved, &moved, &plane).unwrap();
    assert!(pairing.exactness <= Match::Close);
    assert_eq!(coordinate_plane(&head(), 0), MirrorPlane::across(0, 0.0));
}

#[test]
fn the_plane_of_a_turned_surface_is_found() {
    for unit in [1.0, 1e-200, 1e200] {
        let mesh = moved(&head(), |p| turned(*p).map(|c| unit * (c + 3.0)));
        let plane = find(&mesh).unwrap();
        let normal = turned([1.0, 0.0, 0.0]);
        let cosine = dot(plane.normal(), normal).abs();
        assert!(cosine > 1.0 - 1e-4, "{cosine}");
        let away = plane.height([3.0 * unit; 3]).abs() / unit;
        assert!(away < 0.02, "{away}");
        let judgement = judged(&mesh, &plane).unwrap();
        assert!(
            judgement.share > 0.99 && judgement.deviation < 2e-3,
            "{judgement:?}"
        );
        let pairing = paired(&mesh, &mesh, &plane).unwrap();
        assert_eq!(pairing.exactness, Match::Close);
        let exact = paired(&head(), &head(), &MirrorPlane::across(0, 0.0)).unwrap();
        assert_eq!(
            (pairing.images, pairing.corners),
            (exact.images, exact.corners)
        );
    }
}

#[test]
fn noise_does_not_hide_the_plane_and_what_is_odd_has_none() {
    let mut random = Pcg64::seed_from_u64(4);
    let noisy = moved(&head(), |p| {
        turned(p.map(|c| c + random.random_range(-0.01..0.01)))
    });
    let plane = find(&noisy).unwrap();
    assert!(dot(plane.normal(), turned([1.0, 0.0, 0.0])).abs() > 0.999);
    assert!(paired(&noisy, &noisy, &plane).is_some());
    assert_eq!(find(&odd()), None);
    let judgement = judged(&odd(), &MirrorPlane::across(0, 0.0)).unwrap();
    assert!(!judgement.is_symmetric());
    assert_eq!(paired(&odd(), &odd(), &MirrorPlane::across(0, 0.0)), None);
}

/// A sheet is its own mirror image at the plane that it lies in; that is no symmetry.
#[test]
fn a_sheet_is_not_symmetric_at_its_own_plane() {
    let sheet = shapes::rectangle(3.0, 2.0, 8, 8);
    let odd = moved(&sheet, |&[x, y, _]| [x + 0.6 * y * y, y + 0.3 * x * y, 0.0]);
    let found = find(&odd);
    assert!(
        found.is_none_or(|plane| plane.normal()[2].abs() < 0.5),
        "{found:?}"
    );
    assert_eq!(judged(&odd, &MirrorPlane::across(2, 0.0)), None);
}

#[test]
fn vertices_and_triangles_are_told_their_images() {
    let mesh = head();
    let plane = MirrorPlane::across(0, 0.0);
    let pairing = paired(&mesh, &mesh, &plane).unwrap();
    assert_eq!(pairing.exactness, Match::Exact);
    for (v, image) in pairing.images.iter().enumerate() {
        let image = mesh.positions()[image.unwrap() as usize];
        assert_eq!(plane.reflected(mesh.positions()[v]), image);
    }
    let mut divided = 0;
    for (u, corners) in pairing.corners.iter().enumerate() {
        for (&w, &corner) in mesh.triangles()[u].iter().zip(corners) {
            let v = mesh.triangles()[corner as usize / 3][corner as usize % 3];
            assert_eq!(pairing.images[v as usize], Some(w));
        }
        divided += usize::from(corners.iter().any(|c| c / 3 != corners[0] / 3));
    }
    // All diagonals of a cube's sides run the same way.
    assert!(divided > 0);
    let shifted = moved(&mesh, |p| [p[0] + 5.0, p[1], p[2]]);
    assert!(paired(&mesh, &shifted, &MirrorPlane::across(0, 2.5)).is_some());
    assert!(paired(&mesh, &shifted, &MirrorPlane::across(0, 2.0)).is_none());
    let without = TriangleMesh::new(mesh.positions().to_vec(), mesh.triangles()[1..].to_vec());
    assert!(paired(&mesh, &without.unwrap(), &plane).is_none());
}

#[test]
fn any_mesh_will_do() {
    let line = TriangleMesh::new(
        vec![[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]],
        vec![[0, 1, 2]; 50],
    )
    .unwrap();
    let point = TriangleMesh::new(vec![[3.0; 3]; 3], vec![[0, 1, 2]]).unwrap();
    let triangle = TriangleMesh::new(
        vec![[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.3, 1.0, 0.0]],
        vec![[0, 1, 2]],
    )
    .unwrap();
    let huge = moved(&shapes::sphere(2), |p| p.map(|c| 1e308 * c));
    for mesh in [line, point, triangle, huge] {
        let plane = find(&mesh).unwrap_or(MirrorPlane::across(0, 0.0));
        let _ = (judged(&mesh, &plane), paired(&mesh, &mesh, &plane));
        for axis in 0..3 {
            let _ = coordinate_plane(&mesh, axis);
        }
    }
    assert_eq!(MirrorPlane::new([0.0; 3], 1.0), None);
    assert_eq!(MirrorPlane::new([f64::NAN, 0.0, 1.0], 1.0), None);
    assert_eq!(
        MirrorPlane::new([0.0, -4.0, 0.0], 2.0).unwrap().offset(),
        0.5
    );
    let aslant = MirrorPlane::new([1.0, 2.0, 3.0], 4.0).unwrap();
    let p = [0.3, -0.2, 0.9];
    let back = aslant.reflected(aslant.reflected(p));
    assert!(length(sub(back, p)) < 1e-12);
    assert!((aslant.height(p) + aslant.height(aslant.reflected(p))).abs() < 1e-12);
    assert_eq!(normalize(aslant.normal()), aslant.normal());
}
