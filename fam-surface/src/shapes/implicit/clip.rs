//! The part of a net on one side of a second surface, with a smooth boundary.

use std::collections::BTreeMap;

use super::nets::halves;
use super::{Net, onto_both};
use crate::shapes::fields::Point;
use crate::vector::{add, scale, sub};

/// A vertex this near to the boundary, in parts of an edge that crosses it, moves onto the
/// boundary: no sliver is left between them.
const NEAR: f64 = 0.35;

/// The part of a net over a body where `outside` is below zero.
pub(super) fn clip(
    net: &Net,
    body: &dyn Fn(Point) -> f64,
    outside: &dyn Fn(Point) -> f64,
    spacing: f64,
) -> Net {
    let mut positions = net.positions.clone();
    let mut values: Vec<f64> = positions.iter().map(|&p| outside(p)).collect();
    let near: Vec<u32> = near_boundary(&net.triangles, &values);
    for v in near {
        let place = &mut positions[v as usize];
        *place = onto_both([body, outside], *place, spacing);
        values[v as usize] = 0.0;
    }
    let mut crossings = BTreeMap::new();
    let mut triangles = Vec::new();
    for corners in &net.triangles {
        let value = |v: u32| values[v as usize];
        if corners.iter().all(|&v| value(v) >= 0.0) {
            continue;
        }
        let mut kept = Vec::with_capacity(4);
        for (a, b) in (0..3).map(|c| (corners[c], corners[(c + 1) % 3])) {
            if value(a) <= 0.0 {
                kept.push(a);
            }
            if value(a) * value(b) < 0.0 {
                let [a, b] = [a.min(b), a.max(b)];
                kept.push(*crossings.entry([a, b]).or_insert_with(|| {
                    let [p, q] = [a, b].map(|v| positions[v as usize]);
                    let share = value(a) / (value(a) - value(b));
                    let between = add(p, scale(sub(q, p), share));
                    positions.push(onto_both([body, outside], between, spacing));
                    positions.len() as u32 - 1
                }));
            }
        }
        match kept[..] {
            [a, b, c] => triangles.push([a, b, c]),
            [a, b, c, d] => triangles.extend(halves(&positions, [a, b, c, d])),
            _ => {}
        }
    }
    used(&positions, triangles)
}

/// The vertices that are near to the boundary along some edge.
fn near_boundary(triangles: &[[u32; 3]], values: &[f64]) -> Vec<u32> {
    let mut near = Vec::new();
    for (a, b) in triangles
        .iter()
        .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
    {
        let (f, g) = (values[a as usize], values[b as usize]);
        if f * g < 0.0 {
            let share = f / (f - g);
            near.extend((share < NEAR).then_some(a));
            near.extend((share > 1.0 - NEAR).then_some(b));
        }
    }
    near.sort_unstable();
    near.dedup();
    near
}

/// The net without vertices that no triangle has.
fn used(positions: &[Point], triangles: Vec<[u32; 3]>) -> Net {
    let mut number = BTreeMap::new();
    let mut kept = Vec::new();
    let triangles = triangles
        .into_iter()
        .map(|t| {
            t.map(|v| {
                *number.entry(v).or_insert_with(|| {
                    kept.push(positions[v as usize]);
                    kept.len() as u32 - 1
                })
            })
        })
        .collect();
    Net {
        positions: kept,
        triangles,
    }
}
