use fam_surface::Surface;

use crate::error::NameError;

/// What the triangles of a mesh belong to.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Labels {
    /// The object (OBJ) or mesh (glTF) of every triangle; empty where all are of one. Vertices
    /// of different objects are never one, even if they coincide.
    pub objects: Vec<u32>,
    /// The material of every triangle, as index into `material_names`; empty where no triangle
    /// has one.
    pub materials: Vec<Option<u32>>,
    /// The names of the materials; empty for one without a name.
    pub material_names: Vec<String>,
    /// The object of every triangle as the file has it, as index into `object_names`; empty where all are
    /// of the first one.
    pub named_objects: Vec<u32>,
    /// The names of the objects; empty for one without a name.
    pub object_names: Vec<String>,
}

impl Labels {
    /// The triangles of the materials and objects of a name, of so many in all, ascending.
    ///
    /// # Errors
    /// There is no triangle of such a one.
    pub fn named(&self, name: &str, triangles: usize) -> Result<Vec<u32>, NameError> {
        let is_named = |names: &[String], index: Option<u32>| {
            let found = index.and_then(|index| names.get(index as usize));
            found.is_some_and(|found| found == name)
        };
        let found: Vec<u32> = (0..triangles)
            .filter(|&t| {
                let material = self.materials.get(t).copied().flatten();
                let object = self.named_objects.get(t).copied().unwrap_or(0);
                is_named(&self.material_names, material)
                    || is_named(&self.object_names, Some(object))
            })
            .map(|t| t as u32)
            .collect();
        match found.is_empty() || name.is_empty() {
            true => {
                let mut known = [&self.material_names[..], &self.object_names].concat();
                known.retain(|name| !name.is_empty());
                let name = name.to_owned();
                Err(NameError { name, known })
            }
            false => Ok(found),
        }
    }

    /// The same with objects that share a vertex as one: they hang together whatever their
    /// names, and vertices that belong to no single object could not be told apart.
    pub(crate) fn with_objects_apart(mut self, surface: &Surface) -> Self {
        let (Surface::Mesh(mesh), Some(&last)) = (surface, self.objects.iter().max()) else {
            return self;
        };
        let mut parents: Vec<u32> = (0..=last).collect();
        // Every step to the root halves the way for those to come.
        let root = |parents: &mut [u32], mut of: u32| {
            while parents[of as usize] != of {
                parents[of as usize] = parents[parents[of as usize] as usize];
                of = parents[of as usize];
            }
            of
        };
        let mut owners: Vec<Option<u32>> = vec![None; mesh.positions().len()];
        for (triangle, &object) in mesh.triangles().iter().zip(&self.objects) {
            for &vertex in triangle {
                let owner = *owners[vertex as usize].get_or_insert(object);
                if owner != object {
                    let (a, b) = (root(&mut parents, owner), root(&mut parents, object));
                    parents[a.max(b) as usize] = a.min(b);
                }
            }
        }
        for object in &mut self.objects {
            *object = root(&mut parents, *object);
        }
        let first = self.objects.first().copied();
        if self.objects.iter().all(|&object| Some(object) == first) {
            self.objects.clear();
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_are_found_by_the_name_of_their_material_or_object() {
        let names = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect();
        let mut labels = Labels {
            materials: vec![Some(0), None, Some(1), Some(1)],
            material_names: names(&["skin", "eye"]),
            named_objects: vec![0, 0, 1, 2],
            object_names: names(&["", "head", "eye"]),
            ..Labels::default()
        };
        let of = |labels: &Labels, name: &str| labels.named(name, 4).ok();
        assert_eq!(of(&labels, "skin"), Some(vec![0]));
        assert_eq!(of(&labels, "head"), Some(vec![2]));
        assert_eq!(of(&labels, "eye"), Some(vec![2, 3]));
        assert_eq!(of(&labels, ""), None);
        let error = labels.named("tail", 4).unwrap_err().to_string();
        let expected = "there is no material or object `tail`; there are skin, eye, head, eye";
        assert_eq!(error, expected);
        labels.named_objects.clear();
        labels.object_names = names(&["all"]);
        assert_eq!(of(&labels, "all"), Some(vec![0, 1, 2, 3]));
    }
}
