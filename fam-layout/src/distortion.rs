//! How far a layout is from an isometry, and how far it may be.

use std::fmt;

/// The most area distortion and conformality that a good layout has whose mean energy is
/// [`ORDINARY_EXCESS`] above that of an isometry.
const ORDINARY_AREA: f64 = 1.12;
const ORDINARY_ANGLE: f64 = 0.1;
const ORDINARY_EXCESS: f64 = 0.1;

/// The conformality that is aimed at with such an energy, once areas are as distorted as they may
/// be: as far as the maps of others go that distort areas as they like.
const AIMED_ANGLE: f64 = 0.067;

/// By how much the conformality falls where the logarithm of the area distortion rises by 1, on the
/// way from the least energy to a conformal map. Near its beginning this hardly differs from
/// surface to surface.
const ANGLES_FOR_AREAS: f64 = 0.6;

/// What bounds of areas and angles never go below: rounding.
const ROUNDING: f64 = 1e-3;

/// The distortion of a layout.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distortion {
    /// Mean symmetric Dirichlet energy at the best scale.
    pub energy: f64,
    /// `exp` of the mean absolute logarithm of the areas' ratio.
    pub area: f64,
    /// Mean absolute difference between angles on the surface and in the plane.
    pub conformality: f64,
}

/// What is measured of a distortion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// The energy.
    Energy,
    /// The distortion of areas.
    Area,
    /// The distortion of angles.
    Conformality,
}

impl Measure {
    /// All of them, the one that the bound is of first.
    pub const ALL: [Self; 3] = [Self::Energy, Self::Area, Self::Conformality];
}

impl fmt::Display for Measure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Energy => "energy",
            Self::Area => "area distortion",
            Self::Conformality => "conformality",
        })
    }
}

impl Distortion {
    /// That of an isometry.
    pub const NONE: Self = Self {
        energy: 4.0,
        area: 1.0,
        conformality: 0.0,
    };

    /// The most of each measure that a bound on the energy allows: for small distortions the
    /// energy grows as the squares of the others.
    pub fn allowed(bound: f64) -> Self {
        let factor = ((bound - 4.0) / ORDINARY_EXCESS).max(0.0).sqrt();
        Self {
            energy: bound,
            area: (factor * ORDINARY_AREA.ln()).max(ROUNDING).exp(),
            conformality: (factor * ORDINARY_ANGLE).max(ROUNDING),
        }
    }

    /// The lowest bound to which it is good enough, without what is owed to rounding: where the
    /// angles are not, but areas leave room, [better ones](crate::refine::with_better_angles) are
    /// still to come.
    pub(super) fn least_bound(&self) -> f64 {
        let areas = self.area.ln();
        let both = self.conformality + ANGLES_FOR_AREAS * areas;
        let aimed = AIMED_ANGLE + ANGLES_FOR_AREAS * ORDINARY_AREA.ln();
        let share = (areas / ORDINARY_AREA.ln()).max(both / aimed);
        (4.0 + ORDINARY_EXCESS * share * share).max(self.energy)
    }

    /// Whether it is good enough to a bound.
    pub(super) fn suits(&self, bound: f64) -> bool {
        let rounding = self.area.ln() <= ROUNDING && self.conformality <= ROUNDING;
        self.energy <= bound && (rounding || self.least_bound() <= bound)
    }

    /// One of its measures.
    pub fn of(&self, measure: Measure) -> f64 {
        match measure {
            Measure::Energy => self.energy,
            Measure::Area => self.area,
            Measure::Conformality => self.conformality,
        }
    }

    /// That of several layouts together, each with its area and its number of triangles.
    pub(super) fn together(all: &[(Self, f64, usize)]) -> Self {
        let area: f64 = all.iter().map(|(_, area, _)| area).sum();
        let triangles: usize = all.iter().map(|(_, _, triangles)| triangles).sum();
        let over_area = |value: fn(&Self) -> f64| {
            let sum = all
                .iter()
                .map(|(one, area, _)| area * value(one))
                .sum::<f64>();
            if area > 0.0 {
                sum / area
            } else {
                f64::INFINITY
            }
        };
        let angles = all.iter().map(|(one, _, n)| *n as f64 * one.conformality);
        Self {
            energy: over_area(|one| one.energy),
            area: over_area(|one| one.area.ln()).exp(),
            conformality: angles.sum::<f64>() / triangles.max(1) as f64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_of_areas_and_angles_go_with_the_bound() {
        let near = |a: f64, b: f64| (a - b).abs() < 1e-9;
        let usual = Distortion::allowed(4.1);
        assert!(near(usual.area, 1.12) && near(usual.conformality, 0.1));
        let tight = Distortion::allowed(4.025);
        assert!(near(tight.area, 1.12_f64.sqrt()) && near(tight.conformality, 0.05));
        let least = Distortion::allowed(4.0);
        for measure in Measure::ALL {
            assert!(Distortion::NONE.of(measure) <= least.of(measure));
            assert!(tight.of(measure) < usual.of(measure), "{measure}");
        }
    }

    #[test]
    fn room_for_areas_is_room_for_better_angles() {
        let at = |energy: f64, area: f64, conformality: f64| Distortion {
            energy,
            area,
            conformality,
        };
        let aimed = at(4.1, ORDINARY_AREA, AIMED_ANGLE);
        assert!((aimed.least_bound() - 4.1).abs() < 1e-9);
        // Areas a little better: so may angles be worse.
        assert!(at(4.1, 1.1, 0.077).suits(4.1));
        assert!(!at(4.1, 1.1, 0.080).suits(4.1));
        assert!(!at(4.1, 1.13, 0.0).suits(4.1));
        assert!(!at(4.11, 1.0, 0.0).suits(4.1));
        // In proportion to a lower bound.
        assert!(at(4.0, 1.12_f64.powf(0.5), 0.033).suits(4.025));
        assert!(!at(4.0, 1.12_f64.powf(0.5), 0.034).suits(4.025));
        assert!(Distortion::NONE.suits(4.0));
    }

    #[test]
    fn several_layouts_count_by_their_size() {
        let bad = Distortion {
            energy: 8.0,
            area: 2.0,
            conformality: 1.0,
        };
        let both = Distortion::together(&[(Distortion::NONE, 3.0, 1), (bad, 1.0, 3)]);
        assert_eq!((both.energy, both.conformality), (5.0, 0.75));
        assert!((both.area - 2.0_f64.powf(0.25)).abs() < 1e-12);
        // A flat speck is told from a good layout.
        assert_eq!(Distortion::together(&[(bad, 0.0, 1)]).energy, f64::INFINITY);
    }
}
