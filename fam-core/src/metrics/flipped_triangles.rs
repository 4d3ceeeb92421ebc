use super::charts::Charts;
use super::layout::Layout;

/// How many triangles are oriented in UV space against the majority of their chart.
///
/// The majority is that of UV area, counter-clockwise if the two are equal. Windings are
/// made coherent across the edges that join a chart, so that a mesh of mixed winding, such
/// as a Möbius strip, has a layout without flipped triangles.
pub(super) fn flipped_triangles(layout: &Layout, charts: &Charts) -> usize {
    let oriented: Vec<(usize, f64)> = (0..layout.len())
        .map(|t| {
            let (chart, opposed) = charts.find(t as u32);
            let area = layout.uv_double_area(t);
            (chart, if opposed { -area } else { area })
        })
        .collect();
    let mut chart_areas = vec![0.0; layout.len()];
    for &(chart, area) in &oriented {
        chart_areas[chart] += area;
    }
    oriented
        .iter()
        .filter(|&&(chart, area)| {
            if chart_areas[chart] < 0.0 {
                area > 0.0
            } else {
                area < 0.0
            }
        })
        .count()
}
