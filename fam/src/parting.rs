//! Which triangles belong together.

use std::collections::BTreeMap;

use fam_core::atlas::Division;
use fam_surface::Duplicates;

/// Which triangles belong together, and which share a UV square.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Parting {
    /// For every triangle a label; triangles of different labels are never in one chart. Empty if
    /// all are alike.
    pub labels: Vec<u32>,
    /// For every label the UV square that its charts are in. Empty if all share one.
    pub squares: Vec<u32>,
    /// For every label how many times as large as others its charts are. Empty if all are alike.
    pub weights: Vec<f64>,
    /// What becomes of triangles that repeat others.
    pub duplicates: Duplicates,
}

impl Parting {
    /// Objects are apart: `objects` has one for every triangle, or none if there is one object.
    pub fn by_object(objects: &[u32]) -> Self {
        Self {
            labels: objects.to_vec(),
            ..Self::default()
        }
    }

    /// The same with a square for every label.
    pub fn with_square_per_label(mut self) -> Self {
        let mut labels = self.labels.clone();
        labels.sort_unstable();
        labels.dedup();
        self.squares = vec![0; labels.last().map_or(0, |&last| last as usize + 1)];
        for (square, label) in (0..).zip(labels) {
            self.squares[label as usize] = square;
        }
        self
    }

    /// Objects and materials are apart, each material with a square of its own. `materials` has one
    /// for every triangle.
    pub fn by_material(objects: &[u32], materials: &[Option<u32>]) -> Self {
        let object = |t: usize| objects.get(t).copied().unwrap_or(0);
        let mut pairs: BTreeMap<(Option<u32>, u32), u32> = BTreeMap::new();
        for (t, &material) in materials.iter().enumerate() {
            pairs.insert((material, object(t)), 0);
        }
        let mut squares = Vec::with_capacity(pairs.len());
        let mut last = None;
        for (number, (&(material, _), label)) in pairs.iter_mut().enumerate() {
            *label = number as u32;
            let square = match (last, squares.last()) {
                (Some(last), Some(&square)) if last == material => square,
                (_, Some(&square)) => square + 1,
                _ => 0,
            };
            squares.push(square);
            last = Some(material);
        }
        let label = |(t, &material): (usize, &Option<u32>)| pairs[&(material, object(t))];
        Self {
            labels: materials.iter().enumerate().map(label).collect(),
            squares,
            ..Self::default()
        }
    }

    /// How the networks' training is told of it.
    pub fn division(&self) -> Division<'_> {
        Division {
            labels: &self.labels,
            squares: &self.squares,
            duplicates: self.duplicates,
        }
    }

    /// How many UV squares there are.
    pub fn uv_squares(&self) -> usize {
        let last = self.squares.iter().max();
        last.map_or(1, |&last| last as usize + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn materials_get_squares_and_objects_stay_apart_in_them() {
        let objects = [0, 1, 1, 0];
        let materials = [Some(5), Some(5), None, Some(2)];
        let parting = Parting::by_material(&objects, &materials);
        let square = |t: usize| parting.squares[parting.labels[t] as usize];
        assert_eq!([0, 1, 2, 3].map(square), [2, 2, 0, 1]);
        assert_ne!(parting.labels[0], parting.labels[1]);
        assert_eq!(Parting::by_object(&objects).labels, objects);
        let own = Parting::by_object(&[4, 0, 4, 2]).with_square_per_label();
        assert_eq!([4, 0, 2].map(|label: usize| own.squares[label]), [2, 0, 1]);
        assert_eq!(own.uv_squares(), 3);
        assert_eq!(Parting::default().with_square_per_label().uv_squares(), 1);
    }
}
