//! Which components are trained together.

use fam_surface::{Component, SurfaceError, TriangleMesh};

/// Share of the area of all trained components from which on one has networks of its own. There is
/// at most one other that large, so that at most three are trained in place of one.
const LARGE_SHARE: f64 = 1.0 / 3.0;

/// Components that one set of networks is trained on: each of the large ones alone, the others
/// together, as the paper trains a surface whatever its parts. `trained` are indices into `list`;
/// groups come in the order of their first members.
pub fn groups(list: &[Component], trained: &[usize]) -> Vec<Vec<usize>> {
    let area = |i: usize| list[i].mesh.triangle_areas().iter().sum::<f64>();
    let areas: Vec<f64> = trained.iter().map(|&i| area(i)).collect();
    let least = LARGE_SHARE * areas.iter().sum::<f64>();
    let (mut groups, mut small) = (Vec::new(), Vec::new());
    for (&i, area) in trained.iter().zip(areas) {
        match area > least {
            true => groups.push(vec![i]),
            false => small.push(i),
        }
    }
    if !small.is_empty() {
        groups.push(small);
    }
    groups.sort_by_key(|group| group[0]);
    groups
}

/// The meshes of components as one.
///
/// # Errors
/// None, for meshes that are valid.
pub fn joined(list: &[Component], group: &[usize]) -> Result<TriangleMesh, SurfaceError> {
    let (mut positions, mut triangles, mut normals) = (Vec::new(), Vec::new(), Vec::new());
    for &i in group {
        let mesh = &list[i].mesh;
        let first = positions.len() as u32;
        positions.extend_from_slice(mesh.positions());
        triangles.extend(mesh.triangles().iter().map(|t| t.map(|v| first + v)));
        normals.extend(mesh.normals().into_iter().flatten());
    }
    let has_normals = normals.len() == positions.len();
    let mesh = TriangleMesh::new(positions, triangles)?;
    match has_normals {
        true => mesh.with_normals(normals),
        false => Ok(mesh),
    }
}

#[cfg(test)]
mod tests {
    use fam_surface::{Components, shapes};

    use super::*;

    /// Tori of different sizes beside each other.
    fn tori(sizes: &[f64]) -> Vec<Component> {
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        for (i, &size) in sizes.iter().enumerate() {
            let torus = shapes::torus(size, 0.4 * size, 12, 8);
            let first = positions.len() as u32;
            let x = 10.0 * i as f64;
            positions.extend(torus.positions().iter().map(|p| [p[0] + x, p[1], p[2]]));
            triangles.extend(torus.triangles().iter().map(|t| t.map(|v| first + v)));
        }
        let mesh = TriangleMesh::new(positions, triangles).unwrap();
        Components::of(&mesh, &[]).unwrap().list
    }

    #[test]
    fn large_components_are_trained_alone_and_small_ones_together() {
        let list = tori(&[0.3, 3.0, 0.5, 2.8, 0.4]);
        let all = [0, 1, 2, 3, 4];
        assert_eq!(groups(&list, &all), [vec![0, 2, 4], vec![1], vec![3]]);
        // Those that are not trained do not count.
        assert_eq!(groups(&list, &[0, 4]), [vec![0], vec![4]]);
        assert_eq!(
            groups(&tori(&[1.0; 30]), &(0..30).collect::<Vec<_>>()).len(),
            1
        );
        assert_eq!(groups(&list, &[]), Vec::<Vec<usize>>::new());
    }

    #[test]
    fn joined_meshes_keep_their_triangles() {
        let list = tori(&[1.0, 2.0]);
        let joined = joined(&list, &[0, 1]).unwrap();
        let count = |i: usize| list[i].mesh.triangles().len();
        assert_eq!(joined.triangles().len(), count(0) + count(1));
        let last = joined.corners(count(0));
        assert_eq!(last, list[1].mesh.corners(0));
    }
}
