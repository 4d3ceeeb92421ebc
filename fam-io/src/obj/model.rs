//! What is read of an OBJ file.

use crate::content::Content;
use crate::error::ReadFault;
use crate::kept::Kept;
use crate::labels::Labels;

use super::faces::Faces;
use super::names::Names;
use super::numbers::{NumberReader, Numbers};
use super::shading;
use super::statements::{Fingerprint, Statement, Statements, decode, open};

/// The numbers and faces of a file, and what is named in it. Of a cloud, only the points with
/// finite coordinates.
pub(super) struct Model {
    pub numbers: Numbers,
    /// Which `v` the surface has; all in a mesh.
    pub kept: Kept,
    pub faces: Faces,
    pub objects: Names,
    pub materials: Names,
    /// The smoothing groups of the faces.
    pub groups: Names,
    /// Whether there are `s` statements.
    pub has_groups: bool,
    /// What the `mtllib` statements name.
    pub libraries: Vec<String>,
    pub fingerprint: Fingerprint,
}

impl Model {
    /// Reads a file and shows `each` of its statements.
    pub fn read(content: &Content, mut each: impl FnMut(&Statement)) -> Result<Self, ReadFault> {
        let mut statements = Statements::new(open(content)?);
        let mut numbers = NumberReader::default();
        let mut faces = Faces::default();
        let mut objects = Names::starting_with(Some(Vec::new()));
        let mut materials = Names::starting_with(None);
        let mut groups = Names::starting_with(None);
        let mut has_groups = false;
        let mut libraries = Vec::new();
        while let Some(statement) = statements.next()? {
            each(&statement);
            match statement.keyword() {
                b"v" | b"vt" | b"vn" => numbers.push(&statement)?,
                b"f" | b"fo" => {
                    let number = faces.vertices.len();
                    faces.push(&statement, numbers.seen())?;
                    if faces.vertices.len() > number {
                        objects.hold_for(number);
                        materials.hold_for(number);
                        groups.hold_for(number);
                    }
                }
                b"o" => objects.set(Some(statement.name())),
                b"usemtl" => materials.set(Some(statement.name()).filter(|n| !n.is_empty())),
                b"s" => {
                    has_groups = true;
                    groups.set(shading::group(&statement));
                }
                b"mtllib" => libraries.push(decode(&statement.name())),
                _ => {}
            }
        }
        let mut numbers = numbers.finish()?;
        let mut kept = Kept::default();
        if !numbers.positions.is_empty() {
            faces.check(numbers.positions.len())?;
        }
        if faces.vertices.is_empty() {
            kept = Kept::of(&numbers.positions);
            let total = numbers.positions.len();
            numbers.uvs = of_kept_points(&kept, total, numbers.uvs);
            numbers.normals = of_kept_points(&kept, total, numbers.normals);
            numbers.positions = kept.only(numbers.positions);
        } else if !numbers.positions.is_empty() {
            numbers.check_finite()?;
            faces.vertices.divide(&numbers.positions);
        }
        Ok(Self {
            numbers,
            kept,
            faces,
            objects,
            materials,
            groups,
            has_groups,
            libraries,
            fingerprint: statements.fingerprint(),
        })
    }

    /// The normals of a cloud, if there is one for every point.
    pub fn point_normals(&self) -> Option<&[[f64; 3]]> {
        let one_each = self.numbers.normals.len() == self.numbers.positions.len();
        one_each.then_some(&self.numbers.normals)
    }

    pub fn material_names(&self) -> Vec<String> {
        self.materials.used().iter().map(|n| decode(n)).collect()
    }

    /// The objects and materials of the triangles.
    pub fn labels(&self) -> Labels {
        let polygons = &self.faces.vertices;
        let mut labels = Labels {
            object_names: self.objects.used().iter().map(|n| decode(n)).collect(),
            ..Labels::default()
        };
        if self.objects.used().len() > 1 {
            let objects = self.objects.of_triangles(polygons);
            labels.objects = objects.into_iter().flatten().collect();
            labels.named_objects = labels.objects.clone();
        }
        if !self.materials.used().is_empty() {
            labels.materials = self.materials.of_triangles(polygons);
            labels.material_names = self.material_names();
        }
        labels
    }
}

/// What the kept points of a cloud have, if there is one entry for each of all points; else none.
fn of_kept_points<T>(kept: &Kept, total: usize, of_all: Vec<T>) -> Vec<T> {
    match of_all.len() == total {
        true => kept.only(of_all),
        false => Vec::new(),
    }
}
