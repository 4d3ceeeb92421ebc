use std::fmt;
use std::path::Path;

/// The file formats that are read and written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Binary glTF 2.0.
    Glb,
    /// glTF 2.0 as JSON.
    Gltf,
    /// Wavefront OBJ.
    Obj,
    /// Object File Format.
    Off,
    /// Polygon File Format.
    Ply,
    /// Stereolithography, ASCII or binary. Read only: it has no place for UVs.
    Stl,
    /// Columns of numbers.
    Xyz,
}

impl Format {
    /// All formats.
    pub const ALL: [Self; 7] = [
        Self::Glb,
        Self::Gltf,
        Self::Obj,
        Self::Off,
        Self::Ply,
        Self::Stl,
        Self::Xyz,
    ];

    /// The usual extension of its files, in lower case, without a dot.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Glb => "glb",
            Self::Gltf => "gltf",
            Self::Obj => "obj",
            Self::Off => "off",
            Self::Ply => "ply",
            Self::Stl => "stl",
            Self::Xyz => "xyz",
        }
    }

    /// The format that the extension of `path` stands for, in upper or lower case.
    pub fn of_path(path: impl AsRef<Path>) -> Option<Self> {
        let extension = path.as_ref().extension()?.to_str()?.to_ascii_lowercase();
        Self::ALL
            .into_iter()
            .find(|format| format.extension() == extension)
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Glb => "GLB",
            Self::Gltf => "glTF",
            Self::Obj => "OBJ",
            Self::Off => "OFF",
            Self::Ply => "PLY",
            Self::Stl => "STL",
            Self::Xyz => "XYZ",
        })
    }
}
