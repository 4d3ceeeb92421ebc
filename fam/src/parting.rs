//! Which triangles belong together.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use fam_core::atlas::Division;
use fam_surface::Duplicates;

/// How many times as large as others charts may be: beyond this range some are no texel wide.
pub const WEIGHTS: RangeInclusive<f64> = 0.001..=1000.0;

/// Which triangles belong together, and which share a UV square.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Parting {
    /// For every triangle a label; triangles of different labels are never in one chart. Empty if
    /// all are alike.
    pub labels: Vec<u32>,
    /// For every label the UV square that its charts are in. Empty if all share one.
    pub squares: Vec<u32>,
    /// For every label how many times as large as others its charts are, within [`WEIGHTS`]. Empty if
    /// all are alike.
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

    /// The same with `weights`, one for every triangle: triangles of different ones are apart, too.
    pub fn with_weights(self, weights: &[f64]) -> Self {
        let pair = |(t, weight): (usize, &f64)| {
            let label = self.labels.get(t).copied().unwrap_or(0);
            // Bits compare exactly; any order will do.
            (label, weight.to_bits())
        };
        let pairs: Vec<(u32, u64)> = weights.iter().enumerate().map(pair).collect();
        let mut apart = pairs.clone();
        apart.sort_unstable();
        apart.dedup();
        let square = |&(label, _): &(u32, u64)| self.squares.get(label as usize).copied();
        let number = |pair: &(u32, u64)| apart.partition_point(|other| other < pair) as u32;
        Self {
            labels: pairs.iter().map(number).collect(),
            squares: apart.iter().filter_map(square).collect(),
            weights: apart.iter().map(|pair| f64::from_bits(pair.1)).collect(),
            duplicates: self.duplicates,
        }
    }

    /// What keeps surfaces from being unwrapped so, if anything.
    pub(crate) fn problem(&self) -> Option<&'static str> {
        let is_fine = self.weights.iter().all(|weight| WEIGHTS.contains(weight));
        (!is_fine).then_some("weight must lie in 0.001..=1000")
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

    #[test]
    fn triangles_of_other_weights_are_apart_and_stay_in_their_squares() {
        let weights = [2.0, 0.5, 2.0, 1.0, 1.0];
        let own = Parting::by_object(&[4, 4, 0, 0, 0]).with_square_per_label();
        let weighted = own.clone().with_weights(&weights);
        for (t, weight) in weights.into_iter().enumerate() {
            let label = weighted.labels[t] as usize;
            assert_eq!(weighted.weights[label], weight);
            assert_eq!(weighted.squares[label], own.squares[own.labels[t] as usize]);
        }
        assert_eq!(weighted.labels, [3, 2, 1, 0, 0]);
        assert_eq!(weighted.problem(), None);
        let all = Parting::default().with_weights(&weights);
        assert_eq!((all.labels, all.squares), (vec![2, 0, 2, 1, 1], vec![]));
        for weight in [0.0, -1.0, 1e4, f64::NAN] {
            let bad = Parting::default().with_weights(&[1.0, weight]);
            assert!(bad.problem().is_some(), "{weight}");
        }
    }
}
