//! Which component of a mesh is the mirror image of which.

use std::collections::HashMap;

use super::Symmetry;
use super::nearly::FEW;
use fam_surface::orientation::{NONE, across};
use fam_surface::sets::Sets;
use fam_surface::symmetry::{
    CLOSE, Match, MirrorPlane, Pairing, coordinate_plane, find, judged, paired,
};
use fam_surface::vector::{length, sub};
use fam_surface::{Component, Components, TriangleMesh};

/// What a component is with regard to the mirror plane.
pub enum Role {
    /// Its mirror image is not there.
    Alone,
    /// It is its own mirror image at a plane, vertex by vertex.
    Own(Box<Own>),
    /// It is nearly its own mirror image at the plane, but its vertices do not correspond.
    Nearly(Box<MirrorPlane>),
    /// It is the mirror image of the component of a lower number.
    ImageOf(usize, Box<Pairing>),
}

/// How a component is its own mirror image.
pub struct Own {
    pub pairing: Pairing,
    pub plane: MirrorPlane,
    /// Whether the faces across the plane would be charts of their own, for a symmetry that is not exact.
    pub is_fragmented: bool,
}

/// The roles of all components. `square` tells the UV square of each: mirror images have the same.
pub fn roles(
    symmetry: Symmetry,
    components: &Components,
    square: impl Fn(usize) -> u32,
) -> Vec<Role> {
    let list = &components.list;
    let mut roles: Vec<Role> = list.iter().map(|_| Role::Alone).collect();
    let Some(plane) = plane(symmetry, components) else {
        return roles;
    };
    let boxes: Vec<Bounds> = list.iter().map(|c| Bounds::of(&c.mesh)).collect();
    let mut alike: HashMap<[usize; 2], Vec<usize>> = HashMap::new();
    for (i, component) in list.iter().enumerate() {
        let size = [
            component.mesh.triangles().len(),
            component.mesh.positions().len(),
        ];
        alike.entry(size).or_default().push(i);
    }
    let mut classes: Vec<Vec<usize>> = alike.into_values().collect();
    classes.sort_unstable();
    for members in classes {
        let mut is_taken = vec![false; members.len()];
        for (n, &i) in members.iter().enumerate() {
            if is_taken[n] {
                continue;
            }
            let image = boxes[i].reflected(&plane);
            if image.is_near(&boxes[i], &plane)
                && let Some(own) = paired(&list[i].mesh, &list[i].mesh, &plane)
                && is_involution(&own)
            {
                roles[i] = Role::Own(Box::new(Own {
                    is_fragmented: is_fragmented(&list[i].mesh, &own),
                    pairing: own,
                    plane,
                }));
                continue;
            }
            let twin = (n + 1..members.len()).find_map(|m| {
                let j = members[m];
                let may_be =
                    !is_taken[m] && square(i) == square(j) && image.is_near(&boxes[j], &plane);
                let pairing = may_be.then(|| paired(&list[i].mesh, &list[j].mesh, &plane));
                Some((m, pairing.flatten()?))
            });
            if let Some((m, pairing)) = twin {
                roles[members[m]] = Role::ImageOf(i, Box::new(pairing));
                is_taken[m] = true;
            } else if image.is_near(&boxes[i], &plane) && is_nearly_symmetric(&list[i].mesh, &plane)
            {
                roles[i] = Role::Nearly(Box::new(plane));
            }
        }
    }
    roles
}

/// Whether a mesh has several groups of faces across the plane, and vertices that are not exactly mirror
/// images.
fn is_fragmented(mesh: &TriangleMesh, own: &Pairing) -> bool {
    if own.exactness == Match::Exact {
        return false;
    }
    let is_across =
        |(t, corners): &(usize, &[u32; 3])| corners.iter().any(|c| *c as usize / 3 == *t);
    let faces = own.corners.iter().enumerate().filter(is_across);
    let triangles: Vec<[u32; 3]> = faces.map(|(t, _)| mesh.triangles()[t]).collect();
    let mut groups = Sets::new(triangles.len());
    for (h, &twin) in (0..).zip(&across(&triangles)) {
        if twin != NONE {
            groups.join(h / 3, twin / 3);
        }
    }
    groups.settle();
    (0..triangles.len() as u32).any(|t| groups.find(t) != groups.find(0))
}

/// Whether the mirror image of a mesh of many triangles lies on it.
fn is_nearly_symmetric(mesh: &TriangleMesh, plane: &MirrorPlane) -> bool {
    mesh.triangles().len() >= FEW
        && judged(mesh, plane).is_some_and(|judgement| judgement.is_symmetric())
}

/// Whether the image of every image is the vertex itself.
fn is_involution(own: &Pairing) -> bool {
    (0..)
        .zip(&own.images)
        .all(|(v, image)| image.is_none_or(|image| own.images[image as usize] == Some(v)))
}

fn plane(symmetry: Symmetry, components: &Components) -> Option<MirrorPlane> {
    let whole = || whole(&components.list);
    let across = |axis: usize| Some(coordinate_plane(&whole()?, axis));
    match symmetry {
        Symmetry::Off => None,
        Symmetry::Auto => find(&whole()?),
        Symmetry::X => across(0),
        Symmetry::Y => across(1),
        Symmetry::Z => across(2),
        Symmetry::Plane { normal, offset } => MirrorPlane::new(normal, offset),
    }
}

/// All components in one mesh.
fn whole(list: &[Component]) -> Option<TriangleMesh> {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for component in list {
        let first = positions.len() as u32;
        positions.extend(component.mesh.positions());
        let own = component.mesh.triangles().iter();
        triangles.extend(own.map(|t| t.map(|v| first + v)));
    }
    TriangleMesh::new(positions, triangles).ok()
}

/// Of halves of the coordinates, so that no difference overflows.
struct Bounds {
    low: [f64; 3],
    high: [f64; 3],
}

impl Bounds {
    fn of(mesh: &TriangleMesh) -> Self {
        Self::around(mesh.positions().iter().copied())
    }

    fn around(points: impl Iterator<Item = [f64; 3]>) -> Self {
        let start = Self {
            low: [f64::INFINITY; 3],
            high: [f64::NEG_INFINITY; 3],
        };
        points.fold(start, |own, p| Self {
            low: [0, 1, 2].map(|k| own.low[k].min(0.5 * p[k])),
            high: [0, 1, 2].map(|k| own.high[k].max(0.5 * p[k])),
        })
    }

    /// The middle of the mirror image and, as no more can be told of a box, the size of this one.
    fn reflected(&self, plane: &MirrorPlane) -> Self {
        let middle = [0, 1, 2].map(|k| self.low[k] + self.high[k]);
        let image = plane.reflected(middle);
        let move_by = |p: [f64; 3]| [0, 1, 2].map(|k| p[k] + 0.5 * (image[k] - middle[k]));
        Self {
            low: move_by(self.low),
            high: move_by(self.high),
        }
    }

    fn diagonal(&self) -> f64 {
        length(sub(self.high, self.low))
    }

    /// Whether this may be the box of a mirror image at the plane: its middle is where it should be. At
    /// a plane that is not across an axis that is only roughly so.
    fn is_near(&self, other: &Self, plane: &MirrorPlane) -> bool {
        let middle = |b: &Self| [0, 1, 2].map(|k| 0.5 * (b.low[k] + b.high[k]));
        let away = length(sub(middle(self), middle(other)));
        let most = self.diagonal().max(other.diagonal());
        let share = if plane.axis().is_some() {
            2.0 * CLOSE
        } else {
            0.5
        };
        away <= share * most || !away.is_finite()
    }
}
