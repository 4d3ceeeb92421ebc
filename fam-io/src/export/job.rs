use crate::options::WriteOptions;
use crate::scene::Scene;
use crate::uvs::Uvs;

/// What is written, and how.
pub(crate) struct Export<'a> {
    pub scene: Scene,
    /// One triangle for each of the fans of the polygons in order, or one UV for each point.
    pub uvs: &'a Uvs,
    pub options: &'a WriteOptions,
    /// The seam lines of the options, in the coordinates of the scene.
    pub seam_lines: Vec<[[f64; 3]; 2]>,
    /// The name of the output without its extension; `None` if it goes to no file, which then
    /// refers to no other.
    pub stem: Option<String>,
}
