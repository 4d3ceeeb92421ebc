//! Names that hold for the faces after them: those of objects and of materials.

use std::collections::HashMap;
use std::iter::repeat_n;

use fam_surface::polygons::Polygons;

use super::statements::decode;

/// The names in use, and where each of them holds.
pub(super) struct Names {
    /// The name of the faces to come, if it is not that of the last run.
    next: Option<Option<Vec<u8>>>,
    indices: HashMap<Vec<u8>, u32>,
    used: Vec<Vec<u8>>,
    /// The first face and what holds from there on.
    runs: Vec<(usize, Option<u32>)>,
}

impl Names {
    /// The faces before the first name have this one, or none.
    pub fn starting_with(name: Option<Vec<u8>>) -> Self {
        Self {
            next: Some(name),
            indices: HashMap::new(),
            used: Vec::new(),
            runs: Vec::new(),
        }
    }

    /// The faces from here on have this name, or none.
    pub fn set(&mut self, name: Option<Vec<u8>>) {
        self.next = Some(name);
    }

    /// There is a face, the one of this number.
    pub fn hold_for(&mut self, face: usize) {
        let Some(name) = self.next.take() else {
            return;
        };
        let index = name.map(|name| {
            *self.indices.entry(name).or_insert_with_key(|name| {
                self.used.push(name.clone());
                (self.used.len() - 1) as u32
            })
        });
        if self.runs.last().is_none_or(|(_, last)| *last != index) {
            self.runs.push((face, index));
        }
    }

    /// The names that faces have, in the order of their first use.
    pub fn used(&self) -> &[Vec<u8>] {
        &self.used
    }

    /// The index of the name of every face; empty if none has one.
    pub fn of_faces(&self, faces: &Polygons) -> Vec<Option<u32>> {
        if self.used.is_empty() {
            return Vec::new();
        }
        self.runs(faces.len())
            .flat_map(|(faces, name)| repeat_n(name, faces))
            .collect()
    }

    /// The index of the name of every triangle of the faces; empty if none has one.
    pub fn of_triangles(&self, faces: &Polygons) -> Vec<Option<u32>> {
        if self.used.is_empty() {
            return Vec::new();
        }
        let mut names = Vec::with_capacity(faces.corners().len() - 2 * faces.len());
        let mut rest = faces.iter();
        for (count, name) in self.runs(faces.len()) {
            let triangles = rest.by_ref().take(count).map(|face| face.len() - 2).sum();
            names.extend(repeat_n(name, triangles));
        }
        names
    }

    /// The first face of every run of faces of one name, and the name; empty if all have the
    /// same.
    pub fn starts(&self) -> Vec<(usize, String)> {
        let name =
            |index: Option<u32>| index.map_or(String::new(), |at| decode(&self.used[at as usize]));
        match self.runs.as_slice() {
            [_] => Vec::new(),
            runs => runs
                .iter()
                .map(|&(start, index)| (start, name(index)))
                .collect(),
        }
    }

    /// How many faces follow each other with one name, and its index.
    fn runs(&self, faces: usize) -> impl Iterator<Item = (usize, Option<u32>)> {
        let ends = self.runs.iter().skip(1).map(|(start, _)| *start);
        let runs = self.runs.iter().zip(ends.chain([faces]));
        runs.map(|(&(start, name), end)| (end - start, name))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_count_from_their_first_use() {
        let name = |text: &str| Some(text.as_bytes().to_vec());
        let mut names = Names::starting_with(None);
        let mut faces = Polygons::default();
        let mut add = |names: &mut Names, corners: u32| {
            names.hold_for(faces.len());
            faces.push(0..corners);
        };
        add(&mut names, 3);
        for text in ["b", "a", "b"] {
            names.set(name("unused"));
            names.set(name(text));
            add(&mut names, 3);
            add(&mut names, 4);
        }
        for _ in 0..2 {
            names.set(None);
            add(&mut names, 3);
            names.set(name("unused"));
        }
        assert_eq!(names.used(), [b"b", b"a"]);
        let (a, b) = (Some(1), Some(0));
        assert_eq!(names.of_faces(&faces), [None, b, b, a, a, b, b, None, None]);
        let triangles = [None, b, b, b, a, a, a, b, b, b, None, None];
        assert_eq!(names.of_triangles(&faces), triangles);

        let starts = [(0, ""), (1, "b"), (3, "a"), (5, "b"), (7, "")];
        assert_eq!(
            names.starts(),
            starts.map(|(at, name)| (at, name.to_owned()))
        );

        let none = Names::starting_with(None);
        assert!(none.of_faces(&faces).is_empty() && none.of_triangles(&faces).is_empty());
        assert!(none.starts().is_empty());
    }
}
