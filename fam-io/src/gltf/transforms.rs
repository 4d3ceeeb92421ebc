//! Where the nodes of a document put its meshes.

use fam_surface::vector::{cross, dot, length, normalize};
use serde_json::Value;

use super::value::{index, indices, list, numbers};
use crate::error::ReadFault;
use crate::scene::{IDENTITY, Node};

type Matrix = [[f64; 4]; 4];

/// The nodes that use a mesh, in the order of the scenes: the default one, the others, and
/// then the nodes that no scene has.
///
/// A skinned node ignores its transform. A transform that is not finite or has no inverse
/// counts as identity.
pub(super) fn placed_meshes(json: &Value) -> Result<Vec<Node>, ReadFault> {
    let meshes = list(json, "meshes")?.len();
    let nodes = list(json, "nodes")?;
    let mut children = Vec::with_capacity(nodes.len());
    for node in nodes {
        children.push(indices(node, "children", nodes.len())?);
    }
    let mut placed = Vec::new();
    let mut visited = vec![false; nodes.len()];
    for root in roots(json, &children)? {
        let mut pending = vec![(root, IDENTITY)];
        while let Some((node, parent)) = pending.pop() {
            if std::mem::replace(&mut visited[node], true) {
                continue;
            }
            let transform = product(&parent, &local(&nodes[node])?);
            if let Some(mesh) = index(&nodes[node], "mesh", meshes)? {
                let usable = nodes[node].get("skin").is_none() && is_invertible(&transform);
                let transform = if usable { transform } else { IDENTITY };
                placed.push(Node { mesh, transform });
            }
            pending.extend(children[node].iter().rev().map(|&child| (child, transform)));
        }
    }
    Ok(placed)
}

/// Nodes to start from, so that all are reached; those reached before are to be skipped.
fn roots(json: &Value, children: &[Vec<usize>]) -> Result<Vec<usize>, ReadFault> {
    let scenes = list(json, "scenes")?;
    let default = index(json, "scene", scenes.len())?.unwrap_or(0);
    let mut roots = Vec::new();
    for scene in scenes.get(default).into_iter().chain(scenes) {
        roots.extend(indices(scene, "nodes", children.len())?);
    }
    let mut is_child = vec![false; children.len()];
    children
        .iter()
        .flatten()
        .for_each(|&child| is_child[child] = true);
    roots.extend((0..children.len()).filter(|&node| !is_child[node]));
    roots.extend(0..children.len());
    Ok(roots)
}

/// The transform of a node relative to its parent.
fn local(node: &Value) -> Result<Matrix, ReadFault> {
    if let Some(matrix) = numbers::<16>(node, "matrix")? {
        return Ok(std::array::from_fn(|c| {
            std::array::from_fn(|r| matrix[4 * c + r])
        }));
    }
    let [tx, ty, tz] = numbers(node, "translation")?.unwrap_or([0.0; 3]);
    let scale = numbers::<3>(node, "scale")?.unwrap_or([1.0; 3]);
    let rotation = numbers::<4>(node, "rotation")?.unwrap_or([0.0, 0.0, 0.0, 1.0]);
    let axes = axes(rotation);
    let axis = |c: usize| {
        let [x, y, z] = axes[c].map(|r| r * scale[c]);
        [x, y, z, 0.0]
    };
    Ok([axis(0), axis(1), axis(2), [tx, ty, tz, 1.0]])
}

/// The axes that a quaternion turns the unit axes into; it need not quite be of unit length.
fn axes(quaternion: [f64; 4]) -> [[f64; 3]; 3] {
    let norm = quaternion.iter().map(|c| c * c).sum::<f64>().sqrt();
    let [x, y, z, w] = if norm > 0.0 {
        quaternion.map(|c| c / norm)
    } else {
        [0.0, 0.0, 0.0, 1.0]
    };
    [
        [
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y + w * z),
            2.0 * (x * z - w * y),
        ],
        [
            2.0 * (x * y - w * z),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z + w * x),
        ],
        [
            2.0 * (x * z + w * y),
            2.0 * (y * z - w * x),
            1.0 - 2.0 * (x * x + y * y),
        ],
    ]
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    b.map(|column| std::array::from_fn(|r| (0..4).map(|k| a[k][r] * column[k]).sum()))
}

/// Whether the linear part of a finite transform is far enough from flattening space.
fn is_invertible(transform: &Matrix) -> bool {
    const LEAST: f64 = 1e-12;
    let columns = [0, 1, 2].map(|c| linear(transform, c));
    let lengths: f64 = columns.map(length).iter().product();
    let determinant = dot(columns[0], cross(columns[1], columns[2]));
    transform.iter().flatten().all(|c| c.is_finite())
        && determinant.is_finite()
        && determinant.abs() > LEAST * lengths
}

/// A point in the coordinates that a transform leads to.
pub(super) fn transform_point(transform: &Matrix, p: [f64; 3]) -> [f64; 3] {
    let of = |r: usize| {
        transform[0][r] * p[0] + transform[1][r] * p[1] + transform[2][r] * p[2] + transform[3][r]
    };
    [of(0), of(1), of(2)]
}

/// A normal in those coordinates, of unit length unless it is zero: the inverse transpose of
/// the linear part, up to a positive factor, has the cross products of the columns as its own.
pub(super) fn transform_normal(transform: &Matrix, n: [f64; 3]) -> [f64; 3] {
    let [a, b, c] = [0, 1, 2].map(|c| linear(transform, c));
    let cofactors = [cross(b, c), cross(c, a), cross(a, b)];
    let sign = dot(a, cofactors[0]).signum();
    normalize(std::array::from_fn(|r| {
        sign * (0..3).map(|c| cofactors[c][r] * n[c]).sum::<f64>()
    }))
}

fn linear(transform: &Matrix, column: usize) -> [f64; 3] {
    let [x, y, z, _] = transform[column];
    [x, y, z]
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn placed(json: Value) -> Vec<(usize, [f64; 3])> {
        let nodes = placed_meshes(&json).unwrap().into_iter();
        let place = |node: Node| (node.mesh, transform_point(&node.transform, [1.0, 2.0, 3.0]));
        nodes.map(place).collect()
    }

    #[test]
    fn transforms_accumulate_and_the_default_scene_comes_first() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let nodes = json!([
            {"mesh": 0, "translation": [100, 0, 0]},
            {"children": [2], "scale": [2, 3, 4], "rotation": [0, 0, half, half], "translation": [1, 0, 0]},
            {"mesh": 1, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 10, 0, 0, 1]},
            {"children": [4]},
            {"mesh": 2},
        ]);
        let json = json!({
            "scene": 1, "scenes": [{"nodes": [0]}, {"nodes": [1]}], "meshes": [{}, {}, {}], "nodes": nodes,
        });
        let [(1, turned), (0, moved), (2, orphan)] = placed(json)[..] else {
            panic!("the order is that of the scenes");
        };
        // (11, 2, 3) scaled by (2, 3, 4), turned from X to Y, and moved by 1 along X.
        let expected = [-5.0, 22.0, 12.0];
        assert!(
            turned
                .iter()
                .zip(expected)
                .all(|(a, b)| (a - b).abs() < 1e-12),
            "{turned:?}"
        );
        assert_eq!(moved, [101.0, 2.0, 3.0]);
        assert_eq!(orphan, [1.0, 2.0, 3.0]);
    }

    #[test]
    fn useless_transforms_count_as_identity() {
        let nodes = json!([
            {"mesh": 0, "scale": [1, 1, 0]},
            {"mesh": 0, "scale": [1e300, 1e300, 1e300], "children": [2]},
            {"mesh": 0, "scale": [1e300, 1e300, 1e300]},
            {"mesh": 0, "translation": [5, 5, 5], "skin": 0},
            {"mesh": 0, "matrix": [1, 2, 3, 0, 2, 4, 6, 0, 0.1, 0.7, 0.3, 0, 0, 0, 0, 1]},
        ]);
        let placed = placed(json!({"meshes": [{}], "nodes": nodes}));
        assert_eq!(placed, [(0, [1.0, 2.0, 3.0]); 5]);
    }

    #[test]
    fn cycles_and_long_chains_come_to_an_end() {
        let cycle = json!([{"mesh": 0, "children": [1]}, {"mesh": 0, "children": [0, 1]}]);
        assert_eq!(placed(json!({"meshes": [{}], "nodes": cycle})).len(), 2);
        let chain = (1..=100_000).map(|child| json!({"children": [child]}));
        let chain: Vec<_> = chain.chain([json!({"mesh": 0})]).collect();
        assert_eq!(placed(json!({"meshes": [{}], "nodes": chain})).len(), 1);
    }

    #[test]
    fn what_nodes_refer_to_is_there() {
        for node in [
            json!({"mesh": 1}),
            json!({"mesh": -1}),
            json!({"children": [1]}),
            json!({"children": 0}),
            json!({"matrix": [1, 2]}),
            json!({"scale": [1, 2, "3"]}),
        ] {
            assert!(placed_meshes(&json!({"meshes": [{}], "nodes": [node]})).is_err());
        }
        assert!(placed_meshes(&json!({"scenes": [{"nodes": [0]}]})).is_err());
        assert!(placed_meshes(&json!({"scene": 0})).is_err());
    }

    #[test]
    fn normals_stay_perpendicular() {
        let mirrored = [
            [2.0, 0.0, 0.0, 0.0],
            [1.0, -3.0, 0.0, 0.0],
            [0.0, 0.0, 4.0, 0.0],
            [9.0; 4],
        ];
        let normal = [0.6, 0.0, 0.8];
        let turned = transform_normal(&mirrored, normal);
        for tangent in [[0.0, 1.0, 0.0], [0.8, 0.0, -0.6]] {
            let end = transform_point(&mirrored, tangent);
            let tangent = std::array::from_fn(|c| end[c] - mirrored[3][c]);
            assert!(dot(turned, tangent).abs() < 1e-12);
        }
        assert!((length(turned) - 1.0).abs() < 1e-12);
        assert!(dot(turned, transform_point(&mirrored, normal)) > 0.0);
        assert_eq!(transform_normal(&mirrored, [0.0; 3]), [0.0; 3]);
    }
}
