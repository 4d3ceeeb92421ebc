use super::charts::Charts;
use super::layout::Layout;

/// How many triangles are oriented in UV space against the majority of their chart.
///
/// The majority is that of their number, counter-clockwise if the two are equal: by UV area,
/// a few triangles that a map smears across the plane would outvote all others. Windings are
/// made coherent across the edges that join a chart, so that a mesh of mixed winding, such
/// as a Möbius strip, has a layout without flipped triangles. A triangle that repeats another
/// (`first_alike`) does not count.
pub(super) fn flipped_triangles(layout: &Layout, charts: &Charts, first_alike: &[u32]) -> usize {
    let oriented: Vec<(usize, f64)> = (0..layout.len())
        .map(|t| {
            let (chart, opposed) = charts.find(t as u32);
            let area = layout.uv_double_area(t);
            (chart, if opposed { -area } else { area })
        })
        .collect();
    let sign = |area: f64| i64::from(area > 0.0) - i64::from(area < 0.0);
    let mut balance = vec![0; layout.len()];
    for &(chart, area) in &oriented {
        balance[chart] += sign(area);
    }
    oriented
        .iter()
        .enumerate()
        .filter(|&(t, _)| first_alike[t] == t as u32)
        .filter(|&(_, &(chart, area))| {
            let majority = if balance[chart] < 0 { -1 } else { 1 };
            sign(area) == -majority
        })
        .count()
}
