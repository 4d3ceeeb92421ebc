use fam_surface::Surface;

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
}

impl Labels {
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
