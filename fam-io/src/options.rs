/// How a file is written, beside its UVs.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct WriteOptions {
    /// glTF: the set `TEXCOORD_n` that takes the UVs; other sets are kept.
    pub uv_set: u32,
    /// glTF: every mesh gets a material with a checker texture.
    pub checker: bool,
    /// glTF: edges, as pairs of vertices of the surface, to be added as a line primitive.
    pub seam_lines: Vec<[u32; 2]>,
}
