use super::super::layout::Layout;

/// The last row of UDIM tiles, whose numbers end at 9999, and the last of the ten columns.
const LAST_TILE: [f64; 2] = [9.0, 899.0];

/// A chart as it lies in the plane. Triangles that repeat another one do not count.
#[derive(Clone)]
pub(super) struct Island {
    /// Its first triangle.
    pub first: u32,
    /// Its bounding box.
    pub low: [f64; 2],
    pub high: [f64; 2],
    /// The sum of the areas of its triangles.
    pub area: f64,
    /// How many more of its triangles are counter-clockwise than clockwise.
    pub balance: i64,
}

/// All charts, by their numbers.
pub(super) fn islands(layout: &Layout, charts: &[u32], first_alike: &[u32]) -> Vec<Island> {
    let mut islands: Vec<Island> = Vec::new();
    for (t, &chart) in charts.iter().enumerate() {
        if chart as usize == islands.len() {
            islands.push(Island {
                first: t as u32,
                low: [f64::INFINITY; 2],
                high: [f64::NEG_INFINITY; 2],
                area: 0.0,
                balance: 0,
            });
        }
        if first_alike[t] as usize != t {
            continue;
        }
        let island = &mut islands[chart as usize];
        let area = 0.5 * layout.uv_double_area(t);
        island.area += area.abs();
        island.balance += i64::from(area > 0.0) - i64::from(area < 0.0);
        for q in layout.uv_corners(t) {
            island.low = [0, 1].map(|k| island.low[k].min(q[k]));
            island.high = [0, 1].map(|k| island.high[k].max(q[k]));
        }
    }
    islands
}

impl Island {
    /// The middle of its bounding box.
    pub(super) fn middle(&self) -> [f64; 2] {
        [0, 1].map(|k| 0.5 * (self.low[k] + self.high[k]))
    }

    /// Its mean width: that of a strip of its area which is as long as its bounding box.
    pub(super) fn width(&self) -> f64 {
        let [width, height] = [0, 1].map(|k| self.high[k] - self.low[k]);
        self.area / width.max(height)
    }

    /// The UDIM tile in which its middle lies, or else the nearest: its lower left and upper right
    /// corner.
    pub(super) fn tile(&self) -> [[f64; 2]; 2] {
        let middle = self.middle();
        let low = [0, 1].map(|k| middle[k].floor().clamp(0.0, LAST_TILE[k]));
        [low, low.map(|c| c + 1.0)]
    }

    /// How far it reaches out of a box.
    pub(super) fn excess(&self, [low, high]: [[f64; 2]; 2]) -> f64 {
        let along = |k: usize| (low[k] - self.low[k]).max(self.high[k] - high[k]);
        along(0).max(along(1))
    }

    /// The middle of the side of its bounding box that is farthest out of a box.
    pub(super) fn farthest(&self, [low, high]: [[f64; 2]; 2]) -> [f64; 2] {
        let sides = [0, 1].map(|k| (low[k] - self.low[k], self.high[k] - high[k]));
        let axis = usize::from(sides[1].0.max(sides[1].1) > sides[0].0.max(sides[0].1));
        let mut at = self.middle();
        let (below, above) = sides[axis];
        at[axis] = if above >= below {
            self.high[axis]
        } else {
            self.low[axis]
        };
        at
    }
}
