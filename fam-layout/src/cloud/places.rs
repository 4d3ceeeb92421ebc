//! Which of its places in a layout a point takes that lies on a seam.

use crate::patch::topology::{Opened, Topology};
use fam_surface::{TriangleMesh, UvMap};

/// For every vertex of a mesh the UV that it has, of those that its corners have in the layout
/// `uvs`; none for a vertex in no triangle.
///
/// A triangle is torn unless all of its corners are where it lies in the layout. So that few are,
/// the vertices along a seam all take their places on one side of it: on that which a walk along
/// the boundary of the layout comes by first, from where it leaves a vertex that has but one
/// place.
pub fn places(mesh: &TriangleMesh, uvs: &UvMap) -> Vec<Option<[f32; 2]>> {
    let mut copies: Vec<Vec<u32>> = vec![Vec::new(); mesh.positions().len()];
    let mut vertices = vec![0; uvs.uvs().len()];
    for (corners, open) in mesh.triangles().iter().zip(uvs.triangles()) {
        for (&v, &q) in corners.iter().zip(open) {
            vertices[q as usize] = v;
            if !copies[v as usize].contains(&q) {
                copies[v as usize].push(q);
            }
        }
    }
    let mut chosen: Vec<Option<u32>> = vec![None; copies.len()];
    for mut walk in boundary_walks(uvs) {
        let has_one = |&q: &u32| copies[vertices[q as usize] as usize].len() == 1;
        let start = walk.iter().position(has_one).unwrap_or(0);
        walk.rotate_left(start);
        for q in walk {
            chosen[vertices[q as usize] as usize].get_or_insert(q);
        }
    }
    let place = |q: u32| uvs.uvs()[q as usize];
    let first = |copies: &Vec<u32>| copies.first().copied();
    let known = chosen.into_iter().zip(&copies);
    known
        .map(|(chosen, copies)| chosen.or(first(copies)).map(place))
        .collect()
}

/// The UVs along the boundary of the charts, loop by loop.
fn boundary_walks(uvs: &UvMap) -> Vec<Vec<u32>> {
    let place = |&[u, v]: &[f32; 2]| [u.into(), v.into(), 0.0];
    let positions = uvs.uvs().iter().map(place).collect();
    let Ok(layout) = TriangleMesh::new(positions, uvs.triangles().to_vec()) else {
        return Vec::new();
    };
    let Opened { topology, source } = Topology::oriented(&layout);
    let vertex = |h: u32| source[topology.origin(h) as usize];
    let loops = topology.boundary_loops().into_iter();
    loops
        .map(|edges| edges.into_iter().map(vertex).collect())
        .collect()
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::*;
    use crate::{LayoutConfig, MeshInput, lay_out};
    use fam_surface::metrics::seam_edges;
    use fam_surface::{Components, shapes};

    /// On one side of a straight seam there are two triangles along each of its edges; where seams
    /// meet there may be a few more.
    #[test]
    fn triangles_are_torn_on_one_side_of_a_seam() {
        let mut rng = Pcg64::seed_from_u64(14);
        for mesh in [
            shapes::open_cylinder(1.0, 2.0, 24, 9),
            shapes::torus(1.0, 0.4, 24, 12),
            shapes::bust(0.2),
        ] {
            // The order of the triangles is of no help.
            let mut triangles = mesh.triangles().to_vec();
            triangles.sort_by_cached_key(|_| rng.random_range(0..u64::MAX));
            let mesh = TriangleMesh::new(mesh.positions().to_vec(), triangles).unwrap();
            let components = Components::of(&mesh, &[]).unwrap();
            let component = &components.list[0].mesh;
            let going = &mut |_| ControlFlow::Continue(());
            let unfinished = MeshInput::of(&components);
            let atlas = lay_out(&LayoutConfig::default(), &unfinished, going).unwrap();
            let uvs = &atlas.components[0].uvs;
            let places = places(component, uvs);
            let is_torn = |t: &usize| {
                let corners = component.triangles()[*t].map(|v| places[v as usize]);
                corners != uvs.corners(*t).map(Some)
            };
            let torn = (0..component.triangles().len()).filter(is_torn).count();
            let seams = seam_edges(component, uvs).unwrap().len();
            assert!(10 * torn <= 21 * seams, "{torn} torn at {seams} edges");
        }
    }

    #[test]
    fn a_vertex_of_no_triangle_has_no_place() {
        let positions = vec![[0.0; 3], [1.0, 0.0, 0.0], [7.0; 3], [0.0, 1.0, 0.0]];
        let mesh = TriangleMesh::new(positions, vec![[0, 1, 3]]).unwrap();
        let own = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        let uvs = UvMap::new(own.to_vec(), vec![[0, 1, 2]]).unwrap();
        let expected = [Some(own[0]), Some(own[1]), None, Some(own[2])];
        assert_eq!(places(&mesh, &uvs), expected);
    }
}
