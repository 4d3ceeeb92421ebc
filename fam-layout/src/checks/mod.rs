//! Finishing as a whole: on surfaces whose answer is known, marked ones, hidden ones, symmetric ones,
//! unusual ones, hard ones, random ones and scanned ones, with every option.

mod costs;
mod hard;
mod hidden;
mod known;
mod marked;
mod nearly_symmetric;
mod options;
mod placed;
mod random;
mod scans;
mod shaped;
mod stacked;
mod symmetric;
mod unusual;

use std::collections::BTreeSet;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};

use robust::{Coord, orient2d};

use crate::patch::topology::Topology;
use crate::{ComponentLayout, LayoutConfig, Marks, MeshInput, MeshLayout, Progress, lay_out};
use fam_surface::metrics::{Metrics, for_each_overlapping_pair, seam_edges};
use fam_surface::vector::{length, sub};
use fam_surface::{Component, Components, Edges, TriangleMesh, UvMap};

/// A mesh, finished.
struct Outcome {
    mesh: TriangleMesh,
    components: Components,
    atlas: MeshLayout,
    uv: UvMap,
    marks: Marks,
}

/// What a mesh is laid out with; the map, if any, is `map(position)` at every vertex.
struct Task<'a> {
    config: LayoutConfig,
    map: Option<&'a (dyn Fn([f64; 3]) -> [f32; 2] + Sync)>,
    labels: &'a [u32],
    squares: &'a [u32],
    wanted: &'a [[u32; 2]],
    forbidden: &'a [[u32; 2]],
    diagonals: &'a [[u32; 2]],
    hard: &'a [[u32; 2]],
    /// At every vertex `paint(position)`.
    paint: Option<&'a (dyn Fn([f64; 3]) -> f64 + Sync)>,
    observe: &'a (dyn Fn(Progress) -> ControlFlow<()> + Sync),
}

impl Default for Task<'_> {
    fn default() -> Self {
        Self {
            config: LayoutConfig::default(),
            map: None,
            labels: &[],
            squares: &[],
            wanted: &[],
            forbidden: &[],
            diagonals: &[],
            hard: &[],
            paint: None,
            observe: &|_| ControlFlow::Continue(()),
        }
    }
}

impl Task<'_> {
    /// With another distortion bound.
    fn within(bound: f64) -> Self {
        Self {
            config: LayoutConfig {
                distortion_bound: bound,
                ..LayoutConfig::default()
            },
            ..Self::default()
        }
    }

    /// Finishes a mesh; panics if the result is not valid.
    fn run(&self, mesh: &TriangleMesh) -> Outcome {
        let outcome = self.run_unchecked(mesh);
        outcome.check(self.squares.is_empty());
        outcome
    }

    fn run_unchecked(&self, mesh: &TriangleMesh) -> Outcome {
        let components = Components::of(mesh, self.labels).unwrap();
        let map: Option<Vec<Vec<[f32; 2]>>> = self.map.map(|map| {
            let of_vertex = |&v: &u32| map(mesh.positions()[v as usize]);
            let of_component = |c: &Component| c.vertices.iter().map(of_vertex).collect();
            components.list.iter().map(of_component).collect()
        });
        let observe = &mut |progress| (self.observe)(progress);
        let edges = Edges::of(mesh);
        let mut marks = Marks::new(&edges, self.wanted, self.forbidden)
            .with_diagonals(&edges, self.diagonals)
            .with_hard_edges(&edges, self.hard);
        if let Some(paint) = self.paint {
            marks = marks.with_paint(mesh.positions().iter().map(|&p| paint(p)).collect());
        }
        let unfinished = MeshInput {
            map: map.as_deref(),
            squares: self.squares,
            marks: &marks,
            ..MeshInput::of(&components)
        };
        let atlas = lay_out(&self.config, &unfinished, observe).unwrap();
        let maps: Vec<UvMap> = atlas.components.iter().map(|f| f.uvs.clone()).collect();
        let uv = components.uv_map(&maps).unwrap();
        Outcome {
            mesh: mesh.clone(),
            components,
            atlas,
            uv,
            marks,
        }
    }
}

/// Breaks off after so many calls; `seen` counts them.
fn breaking_off(
    rounds: usize,
    seen: &AtomicUsize,
) -> impl Fn(Progress) -> ControlFlow<()> + Sync + '_ {
    move |_| match seen.fetch_add(1, Ordering::Relaxed) >= rounds {
        true => ControlFlow::Break(()),
        false => ControlFlow::Continue(()),
    }
}

impl Outcome {
    fn metrics(&self) -> Metrics {
        Metrics::measure(&self.mesh, &self.uv).unwrap()
    }

    /// The energy of the only component.
    fn energy(&self) -> f64 {
        assert_eq!(self.atlas.components.len(), 1);
        self.atlas.components[0].distortion.energy
    }

    /// The length of the seams of the only component.
    fn seam_length(&self) -> f64 {
        assert_eq!(self.atlas.components.len(), 1);
        self.atlas.components[0].seam_length
    }

    fn charts(&self) -> usize {
        self.atlas.components.iter().map(|f| f.charts).sum()
    }

    /// The two ends of every seam edge.
    fn seams(&self) -> Vec<[[f64; 3]; 2]> {
        seam_edges(&self.mesh, &self.uv)
            .unwrap()
            .iter()
            .map(|edge| edge.map(|v| self.mesh.positions()[v as usize]))
            .collect()
    }

    /// The seam edges by their vertices.
    fn seam_edges(&self) -> Vec<[u32; 2]> {
        seam_edges(&self.mesh, &self.uv).unwrap()
    }

    /// How many forbidden edges are cut.
    fn forbidden_cut(&self) -> usize {
        self.marks.forbidden_among(&self.seam_edges())
    }

    /// All that holds of every result, whatever the mesh.
    fn check(&self, one_square: bool) {
        assert_eq!(self.atlas.components.len(), self.components.list.len());
        let inside = |q: &[f32; 2]| q.iter().all(|c| (0.0..=1.0).contains(c));
        for (component, finished) in self.components.list.iter().zip(&self.atlas.components) {
            let mesh = &component.mesh;
            assert_eq!(finished.uvs.triangles().len(), mesh.triangles().len());
            assert!(finished.uvs.uvs().iter().all(inside));
            for t in 0..mesh.triangles().len() {
                let corners = finished.uvs.corners(t);
                assert!(doubled_area(corners) != 0.0, "triangle {t} at {corners:?}");
            }
            assert_eq!(overlaps(&finished.uvs), 0);
            check_charts(&finished.uvs, finished.charts);
            check_wanted(component, finished, &self.marks);
            if let Ok(metrics) = Metrics::measure(mesh, &finished.uvs) {
                assert_eq!(metrics.flipped_triangles, 0);
                assert_eq!(metrics.collapsed_triangles, 0);
            }
            if Components::of(mesh, &[]).is_ok_and(|of| of.conditioning.welded_vertices == 0) {
                check_seams(mesh, finished);
            }
        }
        if one_square {
            assert_eq!(self.overlaps_of_all(), 0);
            assert_eq!(self.atlas.squares.len(), 1);
        }
        let squares = &self.atlas.squares;
        let covered: f64 = squares.iter().map(|one| one.coverage).sum();
        let areas = self.atlas.components.iter().flat_map(|f| {
            let area = |t: usize| 0.5 * doubled_area(f.uvs.corners(t)).abs();
            (0..f.uvs.triangles().len()).map(area)
        });
        let sum = areas.sum::<f64>();
        assert!((covered - sum).abs() < 1e-3, "{covered} against {sum}");
        assert!(squares.iter().all(|s| (0.0..=1.0).contains(&s.coverage)));
    }

    /// Pairs of triangles of all components that overlap.
    fn overlaps_of_all(&self) -> usize {
        let (mut uvs, mut triangles) = (Vec::new(), Vec::new());
        for finished in &self.atlas.components {
            let first = uvs.len() as u32;
            uvs.extend(finished.uvs.uvs());
            let own = finished.uvs.triangles().iter();
            triangles.extend(own.map(|t| t.map(|v| first + v)));
        }
        overlaps(&UvMap::new(uvs, triangles).unwrap())
    }

    /// What is reported is what is there; of meshes without slivers.
    fn check_energy(&self) {
        for (component, finished) in self.components.list.iter().zip(&self.atlas.components) {
            let metrics = Metrics::measure(&component.mesh, &finished.uvs).unwrap();
            let (found, told) = (metrics.symmetric_dirichlet, finished.distortion.energy);
            assert!((found / told - 1.0).abs() < 2e-4, "{found}, not {told}");
            assert_eq!(metrics.charts, finished.charts);
            let (found, told) = (metrics.conformality, finished.distortion.conformality);
            assert!((found - told).abs() < 1e-3, "{found}, not {told}");
            if finished.charts == 1 {
                let (found, told) = (metrics.area_distortion, finished.distortion.area);
                assert!((found / told - 1.0).abs() < 1e-3, "{found}, not {told}");
            }
        }
    }
}

/// The length of the seams is what it is told to be. A mesh with several vertices at one position
/// is left out: its open sides may touch there, which the metric takes for a seam.
fn check_seams(mesh: &TriangleMesh, finished: &ComponentLayout) {
    let places: BTreeSet<_> = mesh
        .positions()
        .iter()
        .map(|p| p.map(f64::to_bits))
        .collect();
    if places.len() < mesh.positions().len() {
        return;
    }
    let sides = seam_edges(mesh, &finished.uvs).unwrap();
    let along = |edge: &[u32; 2]| {
        let [a, b] = edge.map(|v| mesh.positions()[v as usize]);
        length(sub(a, b))
    };
    let seams: f64 = sides.iter().map(along).sum();
    let difference = (seams - finished.seam_length).abs();
    assert!(difference <= 1e-9 * seams, "{difference} of {seams}");
}

/// Every wanted edge inside of a component is cut.
fn check_wanted(component: &Component, finished: &ComponentLayout, marks: &Marks) {
    let mesh = &component.mesh;
    let seams = seam_edges(mesh, &finished.uvs).unwrap();
    let place = |edge: &[u32; 2]| {
        let mut ends = edge.map(|v| mesh.positions()[v as usize]);
        ends.sort_by(|a, b| a.partial_cmp(b).unwrap());
        ends
    };
    let cut: Vec<[[f64; 3]; 2]> = seams.iter().map(place).collect();
    let is_inside = |[a, b]: &&[u32; 2]| {
        let triangles = mesh.triangles().iter();
        triangles.filter(|t| t.contains(a) && t.contains(b)).count() > 1
    };
    let wanted = marks.of_component(component).wanted;
    for edge in wanted.iter().filter(is_inside) {
        assert!(cut.contains(&place(edge)), "{edge:?} is closed");
    }
}

/// Every chart is a disk, maybe with holes, that touches itself nowhere and no other.
fn check_charts(uv: &UvMap, charts: usize) {
    let place = |&[u, v]: &[f32; 2]| [u.into(), v.into(), 0.0];
    let positions = uv.uvs().iter().map(place).collect();
    let plane = TriangleMesh::new(positions, uv.triangles().to_vec()).unwrap();
    let topology = Topology::oriented(&plane).topology;
    assert_eq!(topology.pieces().1, charts);
    let loops = topology.boundary_loops().len() as i64;
    assert_eq!(topology.euler_characteristic(), 2 * charts as i64 - loops);
}

fn overlaps(uv: &UvMap) -> usize {
    let mut count = 0;
    for_each_overlapping_pair(uv, |_| count += 1);
    count
}

/// Twice the area, positive where counter-clockwise; its sign is exact.
fn doubled_area(corners: [[f32; 2]; 3]) -> f64 {
    let [a, b, c] = corners.map(|[x, y]| Coord {
        x: f64::from(x),
        y: f64::from(y),
    });
    orient2d(a, b, c)
}

/// Every triangle divided in four at the middles of its edges.
fn subdivided(mesh: &TriangleMesh) -> TriangleMesh {
    let mut positions = mesh.positions().to_vec();
    let mut middles = std::collections::HashMap::new();
    let mut triangles = Vec::new();
    for &[a, b, c] in mesh.triangles() {
        let [p, q, r] = [[a, b], [b, c], [c, a]].map(|[a, b]| {
            *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                let (one, other) = (positions[a as usize], positions[b as usize]);
                positions.push([0, 1, 2].map(|k| 0.5 * (one[k] + other[k])));
                positions.len() as u32 - 1
            })
        });
        triangles.extend([[a, p, r], [p, b, q], [r, q, c], [p, q, r]]);
    }
    TriangleMesh::new(positions, triangles).unwrap()
}

/// Every vertex moved to the mean of its neighbours, so many times.
fn smoothed(mesh: &TriangleMesh, rounds: usize) -> TriangleMesh {
    let mut positions = mesh.positions().to_vec();
    for _ in 0..rounds {
        let mut sums = vec![[0.0; 4]; positions.len()];
        for &[a, b, c] in mesh.triangles() {
            for (v, w) in [(a, b), (b, c), (c, a), (b, a), (c, b), (a, c)] {
                let (sum, p) = (&mut sums[v as usize], positions[w as usize]);
                *sum = [sum[0] + p[0], sum[1] + p[1], sum[2] + p[2], sum[3] + 1.0];
            }
        }
        positions = sums
            .iter()
            .map(|s| [0, 1, 2].map(|k| s[k] / s[3]))
            .collect();
    }
    TriangleMesh::new(positions, mesh.triangles().to_vec()).unwrap()
}

/// A mesh with its vertices elsewhere.
fn moved(mesh: &TriangleMesh, place: impl FnMut(&[f64; 3]) -> [f64; 3]) -> TriangleMesh {
    let positions = mesh.positions().iter().map(place).collect();
    TriangleMesh::new(positions, mesh.triangles().to_vec()).unwrap()
}

/// Meshes side by side in one.
fn together(meshes: &[TriangleMesh]) -> TriangleMesh {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for mesh in meshes {
        let first = positions.len() as u32;
        positions.extend(mesh.positions());
        triangles.extend(mesh.triangles().iter().map(|t| t.map(|v| first + v)));
    }
    TriangleMesh::new(positions, triangles).unwrap()
}

/// The triangles of a mesh for whose centre `keep` holds.
fn part(mesh: &TriangleMesh, keep: impl Fn([f64; 3]) -> bool) -> TriangleMesh {
    let triangles = (0..mesh.triangles().len())
        .filter(|&t| {
            let [a, b, c] = mesh.corners(t);
            keep([0, 1, 2].map(|k| (a[k] + b[k] + c[k]) / 3.0))
        })
        .map(|t| mesh.triangles()[t])
        .collect();
    TriangleMesh::new(mesh.positions().to_vec(), triangles).unwrap()
}
