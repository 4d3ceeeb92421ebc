//! Figures over several seeds or surfaces.

use std::fmt;

/// Mean and range of a figure. Displayed with as many digits as the precision of the format has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    pub mean: f64,
    pub low: f64,
    pub high: f64,
    count: usize,
}

impl Spread {
    /// None without figures.
    pub fn of(figures: impl IntoIterator<Item = f64>) -> Option<Self> {
        let figures: Vec<f64> = figures.into_iter().collect();
        (!figures.is_empty()).then(|| Self {
            mean: figures.iter().sum::<f64>() / figures.len() as f64,
            low: figures.iter().copied().fold(f64::INFINITY, f64::min),
            high: figures.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            count: figures.len(),
        })
    }
}

impl fmt::Display for Spread {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let digits = f.precision().unwrap_or(3);
        if !self.mean.is_finite() {
            return f.write_str("∞");
        }
        write!(f, "{:.digits$}", self.mean)?;
        match self.count {
            1 => Ok(()),
            _ => write!(f, " ({:.digits$}–{:.digits$})", self.low, self.high),
        }
    }
}

/// The middle figure; of an even number, the mean of the two in the middle. None without figures.
pub fn median(figures: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut figures: Vec<f64> = figures.into_iter().collect();
    figures.sort_by(f64::total_cmp);
    let upper = *figures.get(figures.len() / 2)?;
    Some(match figures.len() % 2 {
        0 => 0.5 * (figures[figures.len() / 2 - 1] + upper),
        _ => upper,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_figure_has_no_range() {
        let shown = |figures: &[f64]| format!("{:.2}", Spread::of(figures.to_vec()).unwrap());
        assert_eq!(shown(&[0.5]), "0.50");
        assert_eq!(shown(&[3.0, 1.0, 2.0]), "2.00 (1.00–3.00)");
        assert_eq!(shown(&[1.0, f64::INFINITY]), "∞");
        assert_eq!(Spread::of([]), None);
    }

    #[test]
    fn the_median_is_in_the_middle() {
        assert_eq!(median([3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median([4.0, 1.0, 2.0, 3.0]), Some(2.5));
        assert_eq!(median([]), None);
    }
}
