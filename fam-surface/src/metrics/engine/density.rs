use super::super::layout::Layout;

/// The share of the surface that is left out at either end: a few bad triangles are no spread.
const LEFT_OUT: f64 = 0.05;

/// How much texel densities differ.
pub(super) struct Spread {
    /// The high density over the low one.
    pub ratio: f64,
    /// Triangles far from the median.
    pub count: u64,
    /// One of the low density and one of the high.
    pub triangles: [u32; 2],
}

/// The spread of the texel densities of triangles, if it is above a limit.
pub(super) fn spread(layout: &Layout, first_alike: &[u32], limit: f64) -> Option<Spread> {
    // Without a unit: only quotients count.
    let density = |t: usize| (layout.uv_double_area(t).abs() / layout.double_area(t)).sqrt();
    let mut by_density: Vec<(f64, u32)> = layout
        .measured()
        .filter(|&t| first_alike[t] as usize == t)
        .map(|t| (density(t), t as u32))
        .collect();
    by_density.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let area = |t: u32| layout.double_area(t as usize);
    let all: f64 = by_density.iter().map(|&(_, t)| area(t)).sum();
    // The first triangle up to which so much of the surface has a lower density or the same.
    let at = |share: f64| {
        let mut below = 0.0;
        let is_reached = |&&(_, t): &&(f64, u32)| {
            below += area(t);
            below >= share * all
        };
        by_density
            .iter()
            .find(is_reached)
            .or(by_density.last())
            .copied()
    };
    let (low, middle, high) = (at(LEFT_OUT)?, at(0.5)?, at(1.0 - LEFT_OUT)?);
    let ratio = match high.0 > 0.0 {
        true => high.0 / low.0,
        false => 1.0,
    };
    let root = limit.sqrt();
    let is_far =
        |&&(density, _): &&(f64, u32)| density * root < middle.0 || density > middle.0 * root;
    (ratio > limit).then(|| Spread {
        ratio,
        count: by_density.iter().filter(is_far).count() as u64,
        triangles: [low.1, high.1],
    })
}
