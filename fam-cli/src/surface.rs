//! What of a document belongs together when it is flattened.

use std::collections::BTreeMap;

use fam_io::Labels;

/// The labels of triangles and the UV squares of labels, as `fam_core::atlas::Division` has
/// them.
pub struct Parting {
    pub labels: Vec<u32>,
    pub squares: Vec<u32>,
}

impl Parting {
    /// Objects are apart; materials too, each with a square of its own, if `per_material`.
    pub fn of(labels: &Labels, per_material: bool) -> Self {
        if !per_material || labels.materials.is_empty() {
            return Self {
                labels: labels.objects.clone(),
                squares: Vec::new(),
            };
        }
        let object = |t: usize| labels.objects.get(t).copied().unwrap_or(0);
        let mut pairs: BTreeMap<(Option<u32>, u32), u32> = BTreeMap::new();
        for (t, &material) in labels.materials.iter().enumerate() {
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
            labels: labels.materials.iter().enumerate().map(label).collect(),
            squares,
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
        let labels = Labels {
            objects: vec![0, 1, 1, 0],
            materials: vec![Some(5), Some(5), None, Some(2)],
            material_names: Vec::new(),
        };
        let parting = Parting::of(&labels, true);
        let square = |t: usize| parting.squares[parting.labels[t] as usize];
        assert_eq!([0, 1, 2, 3].map(square), [2, 2, 0, 1]);
        assert_ne!(parting.labels[0], parting.labels[1]);
        assert_eq!(Parting::of(&labels, false).labels, labels.objects);
        assert!(Parting::of(&Labels::default(), true).labels.is_empty());
    }
}
