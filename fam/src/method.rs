//! How UVs are made.

use fam_surface::Surface;
use serde::{Deserialize, Serialize};

/// How UVs are to be made.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// [`Direct`](Self::Direct) for meshes, [`Neural`](Self::Neural) for point clouds and for raw
    /// maps.
    #[default]
    Auto,
    /// The mesh is cut, flattened and packed as it is, without a network.
    Direct,
    /// The networks of the paper are trained; the layout follows their map.
    Neural,
}

/// How UVs were made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Used {
    /// From the geometry of the mesh.
    Direct,
    /// By trained networks.
    Neural,
}

/// What becomes of the map that training ends with.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FinishMode {
    /// A layout is made of it.
    #[default]
    Full,
    /// It is left as it is: the raw map.
    None,
}

impl Method {
    /// The method that this one stands for on a surface.
    pub fn on(self, surface: &Surface, finish: FinishMode) -> Used {
        match (self, surface, finish) {
            (Self::Direct, ..) | (Self::Auto, Surface::Mesh(_), FinishMode::Full) => Used::Direct,
            (Self::Neural, ..) | (Self::Auto, ..) => Used::Neural,
        }
    }
}

#[cfg(test)]
mod tests {
    use fam_surface::{PointCloud, shapes};

    use super::*;

    #[test]
    fn auto_takes_the_networks_only_where_they_are_needed() {
        let mesh = Surface::Mesh(shapes::rectangle(1.0, 1.0, 2, 2));
        let cloud = Surface::PointCloud(PointCloud::new(vec![[0.0; 3], [1.0; 3]], None).unwrap());
        let auto = |surface: &Surface, finish| Method::Auto.on(surface, finish);
        assert_eq!(auto(&mesh, FinishMode::Full), Used::Direct);
        assert_eq!(auto(&mesh, FinishMode::None), Used::Neural);
        assert_eq!(auto(&cloud, FinishMode::Full), Used::Neural);
        assert_eq!(Method::Neural.on(&mesh, FinishMode::Full), Used::Neural);
        assert_eq!(Method::Direct.on(&cloud, FinishMode::Full), Used::Direct);
    }
}
