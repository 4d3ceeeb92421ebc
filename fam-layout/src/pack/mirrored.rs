//! Points of packed charts that are mirror images, to the last bit.

/// Of which points the points of a chart are mirror images, at a vertical line.
#[derive(Debug, Clone, Copy)]
pub enum Reflection<'a> {
    /// Of none that are known.
    None,
    /// Of points of the chart itself, which is symmetric at u = 0: the number of every point's image.
    Own(&'a [u32]),
    /// Of those of the chart of this number, point by point.
    Of(usize),
}

/// Which points are the images of others. Their coordinates are multiples of a step of the grid of `f32`
/// where that is coarsest, so that a sum of two is exact.
pub struct Mirrors {
    step: f64,
    /// Of every point its image, or itself.
    images: Vec<u32>,
    reflected: Vec<Reflected>,
}

/// A point at (shift − u, v + rise) of another at (u, v).
struct Reflected {
    point: u32,
    of: u32,
    shift: f64,
    rise: f64,
}

impl Mirrors {
    /// Of charts of so many points each, placed.
    pub fn of(
        reflections: &[Reflection],
        counts: &[usize],
        places: &[[f64; 2]],
        step: f64,
    ) -> Self {
        let mut firsts = vec![0];
        for count in counts {
            firsts.push(firsts[firsts.len() - 1] + count);
        }
        let mut images: Vec<u32> = (0..places.len() as u32).collect();
        let mut reflected = Vec::new();
        for (chart, reflection) in reflections.iter().enumerate() {
            let first = firsts[chart] as u32;
            let pairs: Vec<[u32; 2]> = match *reflection {
                Reflection::None => continue,
                Reflection::Own(own) => {
                    let pairs = (0..).zip(own.iter().copied());
                    let pairs = pairs.filter(|(point, image)| point <= image);
                    pairs
                        .map(|(point, image)| [first + point, first + image])
                        .collect()
                }
                Reflection::Of(other) => {
                    let other = firsts[other] as u32;
                    (0..counts[chart] as u32)
                        .map(|i| [other + i, first + i])
                        .collect()
                }
            };
            let Some(&[p, q]) = pairs.first() else {
                continue;
            };
            let [p, q] = [p, q].map(|v| places[v as usize]);
            let is_own = matches!(reflection, Reflection::Own(_));
            // An even number of steps, so that the axis lies on one.
            let shift = 2.0 * snapped(0.5 * (p[0] + q[0]), step);
            let rise = if is_own {
                0.0
            } else {
                snapped(q[1] - p[1], step)
            };
            for [of, point] in pairs {
                (images[of as usize], images[point as usize]) = (point, of);
                reflected.push(Reflected {
                    point,
                    of,
                    shift,
                    rise,
                });
            }
        }
        Self {
            step,
            images,
            reflected,
        }
    }

    /// The image of a point; itself if it has none.
    pub fn image(&self, v: u32) -> u32 {
        self.images[v as usize]
    }

    /// How a point and its image move where the point is moved.
    pub fn moves(&self, v: u32, by: [f64; 2]) -> Vec<(u32, [f64; 2])> {
        let image = self.image(v);
        match image == v {
            true => vec![(v, by)],
            false => vec![(v, by), (image, [-by[0], by[1]])],
        }
    }

    /// Puts rounded points and their images where they are mirror images.
    pub fn apply(&self, places: &[[f64; 2]], rounded: &mut [[f32; 2]]) {
        for one in &self.reflected {
            let mut own = places[one.of as usize].map(|c| snapped(c, self.step));
            if one.of == one.point {
                own[0] = 0.5 * one.shift;
            }
            rounded[one.of as usize] = own.map(|c| c as f32);
            rounded[one.point as usize] = [one.shift - own[0], own[1] + one.rise].map(|c| c as f32);
        }
    }
}

/// The nearest multiple of a step.
fn snapped(c: f64, step: f64) -> f64 {
    (c / step).round() * step
}
