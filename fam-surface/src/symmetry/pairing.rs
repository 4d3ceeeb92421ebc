//! Which vertices and triangles of meshes are mirror images of each other.

use std::collections::HashMap;

use super::MirrorPlane;
use super::find::bits;
use super::samples::Frame;
use crate::TriangleMesh;
use crate::neighbors::nearest;
use crate::orientation::{NONE, across, ends};
use crate::vector::{length, sub};
use crate::weld::weld;

/// How far from its mirror image a vertex may lie, as a share of the diagonal of the bounding box. Which
/// vertices correspond is told by the triangles; so this may be more than noise.
pub const CLOSE: f64 = 0.01;

/// How exactly vertices are mirror images of each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Match {
    /// To the last bit.
    Exact,
    /// To within [`CLOSE`].
    Close,
}

/// What of a mesh is the mirror image of what of another, or of itself.
#[derive(Debug, Clone, PartialEq)]
pub struct Pairing {
    /// How exact it is.
    pub exactness: Match,
    /// For every vertex of the first mesh the one of the other that is its mirror image; `None` for
    /// those in no triangle.
    pub images: Vec<Option<u32>>,
    /// For every triangle of the other mesh the corners of the first one (`3 t + c` for corner `c` of
    /// triangle `t`) whose mirror images its own are: those of one triangle, or of the two triangles of
    /// a quad that is divided along its other diagonal.
    pub corners: Vec<[u32; 3]>,
}

/// What of the mesh `one` is mirrored to what of the mesh `other` at a plane, if all of it is. All
/// vertices correspond, and all triangles; of two that make up a quad, the quads do.
pub fn paired(one: &TriangleMesh, other: &TriangleMesh, plane: &MirrorPlane) -> Option<Pairing> {
    if one.triangles().len() != other.triangles().len() {
        return None;
    }
    let (places, exactness) = Places::of(one, other, plane)?;
    let corners = corners(one, other, &places)?;
    let images = images(one, other, &corners)?;
    is_turned(&corners).then_some(Pairing {
        exactness,
        images,
        corners,
    })
}

/// Positions of two meshes, numbered so that those that are mirror images have one number.
struct Places {
    /// Of every vertex of the first mesh; [`NONE`] for those in no triangle.
    one: Vec<u32>,
    other: Vec<u32>,
}

impl Places {
    /// `None` if there is a position without an image, or two have one image.
    fn of(one: &TriangleMesh, other: &TriangleMesh, plane: &MirrorPlane) -> Option<(Self, Match)> {
        let used = |mesh: &TriangleMesh| {
            let mut of_vertex = vec![NONE; mesh.positions().len()];
            let welded = weld(mesh.positions());
            let (mut number, mut places) = (HashMap::new(), Vec::new());
            for v in mesh.used_vertices() {
                let next = places.len() as u32;
                let own = *number.entry(welded[v as usize]).or_insert(next);
                if own == next {
                    places.push(mesh.positions()[v as usize]);
                }
                of_vertex[v as usize] = own;
            }
            (of_vertex, places)
        };
        let (own, places) = used(one);
        let (theirs, targets) = used(other);
        if places.len() != targets.len() {
            return None;
        }
        let by_bits: HashMap<[u64; 3], u32> = targets
            .iter()
            .zip(0..)
            .map(|(&p, i)| (bits(p), i))
            .collect();
        let images: Vec<[f64; 3]> = places.iter().map(|&p| plane.reflected(p)).collect();
        let mut found: Vec<Option<u32>> = images
            .iter()
            .map(|&p| by_bits.get(&bits(p)).copied())
            .collect();
        let rest: Vec<usize> = (0..found.len()).filter(|&i| found[i].is_none()).collect();
        let exactness = if rest.is_empty() {
            Match::Exact
        } else {
            Match::Close
        };
        if !rest.is_empty() {
            let frame = Frame::of(other);
            let place = |p: [f64; 3]| frame.place(p);
            let single = |p: [f64; 3]| place(p).map(|c| c as f32);
            let points: Vec<[f32; 3]> = targets.iter().map(|&p| single(p)).collect();
            let queries: Vec<[f32; 3]> = rest.iter().map(|&i| single(images[i])).collect();
            for (&i, near) in rest.iter().zip(nearest(&points, &queries)) {
                let away = length(sub(place(images[i]), place(targets[near as usize])));
                if away > CLOSE * frame.diagonal {
                    return None;
                }
                found[i] = Some(near);
            }
        }
        let image: Vec<u32> = found.into_iter().collect::<Option<_>>()?;
        let mut taken = vec![false; targets.len()];
        for &i in &image {
            if std::mem::replace(&mut taken[i as usize], true) {
                return None;
            }
        }
        let to = |v: u32| if v == NONE { NONE } else { image[v as usize] };
        let places = Self {
            one: own.into_iter().map(to).collect(),
            other: theirs,
        };
        Some((places, exactness))
    }
}

/// For every triangle of `other` the corners of `one` at its own places.
fn corners(one: &TriangleMesh, other: &TriangleMesh, places: &Places) -> Option<Vec<[u32; 3]>> {
    let at = |mesh: &TriangleMesh, places: &[u32], t: usize| {
        mesh.triangles()[t].map(|v| places[v as usize])
    };
    let own = |t: u32| at(one, &places.one, t as usize);
    let theirs = |t: u32| at(other, &places.other, t as usize);
    let count = one.triangles().len() as u32;
    // Several triangles at the same places cannot be told apart.
    let mut at_places: HashMap<[u32; 3], u32> = HashMap::with_capacity(count as usize);
    for t in 0..count {
        if at_places.insert(sorted(own(t)), t).is_some() {
            return None;
        }
    }
    let corner = |t: u32, place: u32| {
        let c = own(t).iter().position(|&own| own == place)?;
        Some(3 * t + c as u32)
    };
    let mut found: Vec<Option<[u32; 3]>> = vec![None; count as usize];
    let mut rest = Vec::new();
    for u in 0..count {
        match at_places.remove(&sorted(theirs(u))) {
            Some(t) => {
                let [a, b, c] = theirs(u).map(|place| corner(t, place));
                found[u as usize] = Some([a?, b?, c?]);
            }
            None => rest.push(u),
        }
    }
    let mut left: Vec<u32> = at_places.into_values().collect();
    left.sort_unstable();
    let quads = quads(one, &left, own);
    let mut by_places: HashMap<[u32; 4], [u32; 2]> = HashMap::new();
    for quad in quads {
        by_places.insert(quad.0, quad.1);
    }
    let mut used = vec![false; count as usize];
    for (key, [u, v]) in self::quads(other, &rest, theirs) {
        let is_free = |t: &u32| found[*t as usize].is_none();
        let Some(pair) = by_places
            .get(&key)
            .filter(|pair| pair.iter().all(|&t| !used[t as usize]))
        else {
            continue;
        };
        if !is_free(&u) || !is_free(&v) {
            continue;
        }
        for t in *pair {
            used[t as usize] = true;
        }
        for u in [u, v] {
            let of = |place: u32| corner(pair[0], place).or_else(|| corner(pair[1], place));
            let [a, b, c] = theirs(u).map(of);
            found[u as usize] = Some([a?, b?, c?]);
        }
    }
    found.into_iter().collect()
}

/// The pairs of neighbours among some triangles that make up a quad, with the places of its corners,
/// ascending.
fn quads(
    mesh: &TriangleMesh,
    chosen: &[u32],
    places: impl Fn(u32) -> [u32; 3],
) -> Vec<([u32; 4], [u32; 2])> {
    if chosen.is_empty() {
        return Vec::new();
    }
    let triangles: Vec<[u32; 3]> = chosen
        .iter()
        .map(|&t| mesh.triangles()[t as usize])
        .collect();
    let across = across(&triangles);
    let mut found = Vec::new();
    for h in 0..across.len() as u32 {
        let twin = across[h as usize];
        if twin == NONE || twin < h {
            continue;
        }
        let [t, u] = [h, twin].map(|h| chosen[h as usize / 3]);
        let ends = ends(&triangles, twin);
        let apex = triangles[twin as usize / 3]
            .iter()
            .position(|v| !ends.contains(v));
        let Some(apex) = apex else { continue };
        let [a, b, c] = places(t);
        let mut key = [a, b, c, places(u)[apex]];
        key.sort_unstable();
        if key.windows(2).all(|pair| pair[0] != pair[1]) {
            found.push((key, [t, u]));
        }
    }
    found
}

fn sorted(mut places: [u32; 3]) -> [u32; 3] {
    places.sort_unstable();
    places
}

/// The image of every vertex; `None` if one has several, or several have one.
fn images(
    one: &TriangleMesh,
    other: &TriangleMesh,
    corners: &[[u32; 3]],
) -> Option<Vec<Option<u32>>> {
    let mut images = vec![None; one.positions().len()];
    let mut sources = vec![None; other.positions().len()];
    for (theirs, own) in other.triangles().iter().zip(corners) {
        for (&image, &corner) in theirs.iter().zip(own) {
            let v = one.triangles()[corner as usize / 3][corner as usize % 3];
            let known = *images[v as usize].get_or_insert(image);
            let source = *sources[image as usize].get_or_insert(v);
            if known != image || source != v {
                return None;
            }
        }
    }
    Some(images)
}

/// Whether most triangles run the other way round in the mirror image, as those of one winding do.
fn is_turned(corners: &[[u32; 3]]) -> bool {
    let whole = |own: &&[u32; 3]| own.iter().all(|c| c / 3 == own[0] / 3);
    let (mut turned, mut all) = (0, 0);
    for [a, b, _] in corners.iter().filter(whole) {
        all += 1;
        turned += usize::from((a % 3 + 2) % 3 == b % 3);
    }
    2 * turned > all || all == 0
}
