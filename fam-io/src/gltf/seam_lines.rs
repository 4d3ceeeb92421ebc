//! Seams as lines.

use ::gltf::json::mesh::LINES;
use serde_json::{Value, json};

use super::Package;

const NAME: &str = "seams";

impl Package {
    /// Adds line segments in the coordinates of the scene, as a mesh of a node of the default
    /// scene, both named `seams`. They replace those of an earlier call; none add nothing.
    pub fn add_seam_lines(&mut self, segments: &[[[f64; 3]; 2]]) {
        if segments.is_empty() {
            return;
        }
        let ends: Vec<_> = segments
            .iter()
            .flatten()
            .map(|end| end.map(|c| c as f32))
            .collect();
        let positions = self.add_vectors(&ends, true);
        let material = json!({
            "name": NAME,
            "pbrMetallicRoughness": {
                "baseColorFactor": [0.0, 0.0, 0.0, 1.0],
                "metallicFactor": 0.0,
                "roughnessFactor": 1.0,
            },
            "emissiveFactor": [0.8, 0.0, 0.0],
        });
        let material = self.find_or_push("materials", material);
        if let Some(mesh) = self.seam_mesh(material) {
            self.json["meshes"][mesh]["primitives"][0]["attributes"]["POSITION"] = positions.into();
            return;
        }
        let mesh = self.push("meshes", mesh_of(positions, material));
        let node = self.push("nodes", node_of(mesh));
        self.add_to_default_scene(node);
    }

    /// The mesh of an earlier call, if it is still as it was.
    fn seam_mesh(&self, material: usize) -> Option<usize> {
        let nodes = self.entries("nodes");
        let meshes = self.entries("meshes");
        meshes.iter().enumerate().position(|(index, mesh)| {
            let positions = &mesh["primitives"][0]["attributes"]["POSITION"];
            positions
                .as_u64()
                .is_some_and(|p| *mesh == mesh_of(p as usize, material))
                && nodes.contains(&node_of(index))
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

fn node_of(mesh: usize) -> Value {
    json!({"mesh": mesh, "name": NAME})
}
