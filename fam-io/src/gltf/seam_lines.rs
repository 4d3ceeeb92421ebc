//! Seams as lines.

use ::gltf::json::mesh::LINES;
use fam_surface::vector::sub;
use serde_json::{Value, json};

use super::center::center;
use super::package::Package;

const NAME: &str = "seams";

impl Package {
    /// Adds line segments in the coordinates of the scene, as a mesh of a node of the default
    /// scene, both named `seams`; the node moves what is far from the origin. They replace those
    /// of an earlier call; none add nothing.
    pub fn add_seam_lines(&mut self, segments: &[[[f64; 3]; 2]]) {
        if segments.is_empty() {
            return;
        }
        let ends = segments.as_flattened();
        let center = center(ends);
        let ends: Vec<_> = ends
            .iter()
            .map(|&end| sub(end, center).map(|c| c as f32))
            .collect();
        let positions = self.add_vectors(&ends, true);
        let material = json!({
            "name": NAME,
            "pbrMetallicRoughness": {
                "baseColorFactor": [0.8, 0.0, 0.0, 1.0],
                "metallicFactor": 0.0,
                "roughnessFactor": 1.0,
            },
            "emissiveFactor": [0.8, 0.0, 0.0],
        });
        let material = self.find_or_push("materials", material);
        if let Some((node, mesh)) = self.seam_node(material) {
            self.json["meshes"][mesh]["primitives"][0]["attributes"]["POSITION"] = positions.into();
            self.json["nodes"][node] = node_of(mesh, center);
            return;
        }
        let mesh = self.push("meshes", mesh_of(positions, material));
        let node = self.push("nodes", node_of(mesh, center));
        self.add_to_default_scene(node);
    }

    /// The node and the mesh of an earlier call, if they are still as they were.
    fn seam_node(&self, material: usize) -> Option<(usize, usize)> {
        let meshes = self.entries("meshes");
        let mut nodes = self.entries("nodes").iter().enumerate();
        nodes.find_map(|(at, node)| {
            let mesh = usize::try_from(node["mesh"].as_u64()?).ok()?;
            let translation = [0, 1, 2].map(|c| node["translation"][c].as_f64().unwrap_or(0.0));
            let positions = &meshes.get(mesh)?["primitives"][0]["attributes"]["POSITION"];
            let is_same = *node == node_of(mesh, translation)
                && meshes[mesh] == mesh_of(positions.as_u64()? as usize, material);
            is_same.then_some((at, mesh))
        })
    }

    fn add_to_default_scene(&mut self, node: usize) {
        let scene = self.json["scene"].as_u64().unwrap_or(0) as usize;
        if self
            .entries("scenes")
            .get(scene)
            .is_none_or(|scene| !scene.is_object())
        {
            self.json["scene"] = self.push("scenes", json!({"nodes": [node]})).into();
            return;
        }
        match &mut self.json["scenes"][scene]["nodes"] {
            Value::Array(nodes) => nodes.push(node.into()),
            missing => *missing = json!([node]),
        }
    }
}

fn mesh_of(positions: usize, material: usize) -> Value {
    let attributes = json!({"POSITION": positions});
    let primitive = json!({"attributes": attributes, "material": material, "mode": LINES});
    json!({"name": NAME, "primitives": [primitive]})
}

fn node_of(mesh: usize, translation: [f64; 3]) -> Value {
    let mut node = json!({"mesh": mesh, "name": NAME});
    if translation != [0.0; 3] {
        node["translation"] = json!(translation);
    }
    node
}
