//! Surfaces so rough that one chart would be cut between most of their regions.

use super::facets::{Facets, MOST_BENT};
use crate::patch::Patch;
use fam_surface::vector::{add, cross, dot, scale, sub};

/// A patch of at least `MANY` regions, with fewer than `FEW` triangles in each, is rough. A bunny of
/// 69,000 triangles has 11 regions, a dragon with thin spikes 133 triangles in each of 60; a scanned
/// terrain that is not smooth has 41 in each of 2,344.
const MANY: usize = 250;
const FEW: usize = 100;

/// Whether a patch is so rough that it is best divided by its shape at once: the search for cuts
/// in one chart would take long and end with cuts between most of its regions.
pub fn is_rough(patch: &Patch) -> bool {
    let triangles = patch.areas.len();
    // Regions take 50 times as long to find as clumps, and are seldom smaller where these are flat.
    if triangles < MANY || bend_of_clumps(patch) <= MOST_BENT {
        return false;
    }
    let regions = Facets::of(patch).roots.len();
    regions >= MANY && triangles < FEW * regions
}

/// The mean of 1 - cos θ over the patch, where θ is the angle of a triangle to the mean normal of
/// its clump. A clump is a triangle and those around it, [`FEW`] at most.
fn bend_of_clumps(patch: &Patch) -> f64 {
    let topology = &patch.topology;
    let mut is_taken = vec![false; patch.areas.len()];
    let mut bend = 0.0;
    for first in 0..patch.areas.len() as u32 {
        if std::mem::replace(&mut is_taken[first as usize], true) {
            continue;
        }
        let mut clump = vec![first];
        let mut next = 0;
        while let Some(&t) = clump.get(next).filter(|_| clump.len() < FEW) {
            next += 1;
            for twin in (3 * t..3 * t + 3).filter_map(|h| topology.twin(h)) {
                if clump.len() < FEW && !is_taken[twin as usize / 3] {
                    is_taken[twin as usize / 3] = true;
                    clump.push(twin / 3);
                }
            }
        }
        let (mut normal, mut area) = ([0.0; 3], 0.0);
        for &t in &clump {
            let [a, b, c] = topology.triangles()[t as usize].map(|v| patch.positions[v as usize]);
            normal = add(normal, scale(cross(sub(b, a), sub(c, a)), 0.5));
            area += patch.areas[t as usize];
        }
        bend += (area - dot(normal, normal).sqrt()).max(0.0);
    }
    bend / patch.areas.iter().sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::super::tests::noise;
    use super::*;
    use fam_surface::shapes;

    #[test]
    fn noise_is_rough_and_what_is_smooth_is_not() {
        assert!(is_rough(&Patch::of(&noise(120, 0.03))));
        assert!(!is_rough(&Patch::of(&noise(20, 0.3))), "too few regions");
        assert!(!is_rough(&Patch::of(&shapes::torus(1.0, 0.4, 200, 50))));
        assert!(!is_rough(&Patch::of(&shapes::cube(1))));
    }

    /// Two sides of a right angle have normals at 45 degrees to their mean.
    #[test]
    fn the_bend_of_a_fold_is_known() {
        let flat = shapes::rectangle(1.0, 1.0, 1, 1);
        assert!(bend_of_clumps(&Patch::of(&flat)) < 1e-12);
        let sheet = shapes::rectangle(2.0, 1.0, 2, 1);
        let fold = |p: &[f64; 3]| [p[0].min(0.0), p[1], p[0].max(0.0)];
        let positions = sheet.positions().iter().map(fold).collect();
        let folded = fam_surface::TriangleMesh::new(positions, sheet.triangles().to_vec());
        let bend = bend_of_clumps(&Patch::of(&folded.unwrap()));
        assert!((bend - (1.0 - 0.5_f64.sqrt())).abs() < 1e-12, "{bend}");
    }
}
