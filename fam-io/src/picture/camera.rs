//! An orthographic camera, and the choice of where it stands.

/// Turn to the right around the vertical axis and height above the horizon, in degrees, of the
/// views that are tried. The surface is taken to stand upright along y and to face z.
const VIEWS: [[f32; 2]; 12] = [
    [30.0, 20.0],
    [-30.0, 20.0],
    [60.0, 20.0],
    [-60.0, 20.0],
    [120.0, 20.0],
    [-120.0, 20.0],
    [150.0, 20.0],
    [-150.0, 20.0],
    [30.0, 55.0],
    [-30.0, 55.0],
    [150.0, 55.0],
    [-150.0, 55.0],
];

/// A view this much worse than the best still ties with it.
const TIE: f32 = 0.93;

/// Share of the picture left empty on each side of a fitted surface.
const MARGIN: f32 = 0.05;

/// Maps points of the unit ball to a square picture.
#[derive(Debug, Clone, Copy)]
pub(super) struct Camera {
    /// The picture's right, its top, and the direction to the viewer.
    axes: [[f32; 3]; 3],
    /// The point, in the directions right and up, at the middle of the picture.
    middle: [f32; 2],
    /// Pixels per unit length.
    pub scale: f32,
    pub side: usize,
}

impl Camera {
    fn new([turn, height]: [f32; 2], side: usize) -> Self {
        let ((ts, tc), (hs, hc)) = (turn.to_radians().sin_cos(), height.to_radians().sin_cos());
        Self {
            axes: [
                [tc, 0.0, -ts],
                [-ts * hs, hc, -tc * hs],
                [ts * hc, hs, tc * hc],
            ],
            middle: [0.0; 2],
            scale: 0.5 * side as f32,
            side,
        }
    }

    /// The first view whose score is not clearly below the best. Each sees the unit ball fill
    /// a picture of `side` pixels.
    pub fn best(side: usize, score: impl Fn(&Camera) -> f32) -> Self {
        let views = VIEWS.map(|view| Self::new(view, side));
        let scores = views.map(|view| score(&view));
        let best = scores.into_iter().fold(0.0, f32::max);
        let chosen = scores.iter().position(|&s| s >= TIE * best);
        views[chosen.unwrap_or_default()]
    }

    /// The same view, moved and scaled so that the points fill a picture of `side` pixels.
    pub fn fitted(self, side: usize, points: impl Iterator<Item = [f32; 3]>) -> Self {
        let (mut low, mut high) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
        for p in points {
            let [x, y, _] = self.turned(p);
            low = [low[0].min(x), low[1].min(y)];
            high = [high[0].max(x), high[1].max(y)];
        }
        let extent = (high[0] - low[0]).max(high[1] - low[1]);
        if extent <= 1e-6 || !extent.is_finite() {
            return Self { side, ..self };
        }
        Self {
            middle: [0, 1].map(|axis| 0.5 * (low[axis] + high[axis])),
            scale: (1.0 - 2.0 * MARGIN) * side as f32 / extent,
            side,
            ..self
        }
    }

    /// A direction in the camera's axes: right, up, towards the viewer.
    pub fn turned(&self, v: [f32; 3]) -> [f32; 3] {
        self.axes
            .map(|axis| axis[0] * v[0] + axis[1] * v[1] + axis[2] * v[2])
    }

    /// The pixel coordinates and the depth of a point, all in pixels.
    pub fn project(&self, p: [f32; 3]) -> [f32; 3] {
        let [x, y, z] = self.turned(p);
        let half = 0.5 * self.side as f32;
        [
            half + (x - self.middle[0]) * self.scale,
            half - (y - self.middle[1]) * self.scale,
            -z * self.scale,
        ]
    }
}
