use std::ops::ControlFlow;

use super::{
    FinishConfig, FinishProgress, Finished, FinishedAtlas, FinishedCloud, Guidance, Stage,
};
use crate::metrics::Metrics;
use crate::surface::{Components, UvMap};

/// Finishes the raw map of a mesh: `raw` has one UV for each vertex of every component,
/// `squares` the UV square of every label (empty if all share one). After `observe` breaks off,
/// nothing is refined any more; the result is valid all the same.
///
/// # Panics
/// If `raw` does not fit the components.
pub fn finish(
    _config: &FinishConfig,
    components: &Components,
    raw: &[Vec<[f32; 2]>],
    _guidance: Guidance,
    squares: &[u32],
    observe: &mut dyn FnMut(FinishProgress) -> ControlFlow<()>,
) -> FinishedAtlas {
    let count = components.list.len();
    let mut finished = Vec::with_capacity(count);
    for (i, (component, raw)) in components.list.iter().zip(raw).enumerate() {
        let triangles = component.mesh.triangles().to_vec();
        let uvs = UvMap::new(raw.clone(), triangles).expect("a UV for every vertex");
        let measured = Metrics::measure(&component.mesh, &uvs);
        let energy = measured.map_or(f64::INFINITY, |metrics| metrics.symmetric_dirichlet);
        let _ = observe(FinishProgress {
            component: i,
            components: count,
            stage: Stage::Flatten,
            energy,
            seam_length: 0.0,
        });
        finished.push(Finished {
            uvs,
            charts: 1,
            energy,
            seam_length: 0.0,
        });
    }
    let squares = squares.iter().max().map_or(1, |&last| last as usize + 1);
    FinishedAtlas {
        components: finished,
        coverage: vec![0.0; squares],
    }
}

/// Finishes the raw map of a point cloud, one UV for each point, as [`finish`] does a mesh's.
pub fn finish_cloud(
    _config: &FinishConfig,
    _points: &[[f64; 3]],
    raw: &[[f32; 2]],
    _observe: &mut dyn FnMut(FinishProgress) -> ControlFlow<()>,
) -> FinishedCloud {
    FinishedCloud {
        uvs: raw.to_vec(),
        unreached: 0,
    }
}
