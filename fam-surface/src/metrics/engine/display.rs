use std::fmt;

use super::{Finding, Kind};

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let is_one = self.count == 1 && self.complete;
        let choose = |one: &'static str, several: &'static str| if is_one { one } else { several };
        let charts = choose("chart", "charts");
        let triangles = choose("triangle", "triangles");
        let pairs = choose("pair", "pairs");
        if !self.complete {
            write!(f, "at least ")?;
        }
        write!(f, "{} ", self.count)?;
        let worst = short(self.worst);
        let limit = short(self.limit);
        let resolution = self.resolution;
        match self.kind {
            Kind::Overlapping => write!(
                f,
                "{pairs} of triangles {} each other: by at most {worst} texels at {resolution}",
                choose("overlaps", "overlap"),
            )?,
            Kind::Stacked => write!(
                f,
                "{charts} {} exactly on another: at most {worst} on one place",
                choose("lies", "lie"),
            )?,
            Kind::Repeated => write!(
                f,
                "{triangles} {} another and {} its texels: the first",
                choose("repeats", "repeat"),
                choose("shares", "share"),
            )?,
            Kind::Near => write!(
                f,
                "{pairs} of charts {} nearer than {limit} texels at {resolution}: the nearest \
                 {worst} texels",
                choose("is", "are"),
            )?,
            Kind::Outside => write!(
                f,
                "{charts} {} out of the unit square: farthest by {worst}",
                choose("reaches", "reach"),
            )?,
            Kind::AcrossTiles => write!(
                f,
                "{charts} {} not lie in one UDIM tile: out of it farthest by {worst}",
                choose("does", "do"),
            )?,
            Kind::Narrow => write!(
                f,
                "{charts} {} narrower than {limit} texels at {resolution}: the narrowest {worst} \
                 texels",
                choose("is", "are"),
            )?,
            Kind::Collapsed => write!(
                f,
                "{triangles} {} no area in the plane: the largest is {} % of the surface",
                choose("has", "have"),
                short(100.0 * self.worst),
            )?,
            Kind::DensitySpread => write!(
                f,
                "{triangles} {} a texel density far from the median: it varies by a factor of \
                 {worst}, more than {limit}",
                choose("has", "have"),
            )?,
            Kind::Mirrored => write!(
                f,
                "{charts} {} mirrored, {} % of all: the first",
                choose("is", "are"),
                short(100.0 * self.worst),
            )?,
        }
        write!(f, " at ({:.4}, {:.4})", self.at[0], self.at[1])
    }
}

/// A number with two decimals at most, or the first two digits of a small one.
fn short(value: f64) -> String {
    if value != 0.0 && value.abs() < 0.01 || value.abs() >= 1e9 && value.is_finite() {
        return format!("{value:.1e}");
    }
    let text = format!("{value:.2}");
    let text = match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.'),
        false => &text,
    };
    text.to_string()
}
