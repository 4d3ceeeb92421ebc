//! The charts of all components.

use crate::component::{FlatChart, Task, flat_charts};
use crate::costs::creases::sharp_edges;
use crate::parallel::largest_first;
use crate::symmetry::{
    Mirror, Role, Symmetric, charts_of_both_halves, image_of, nearly_symmetric_charts,
};
use crate::unit::{scaled, scaled_plane};
use crate::watch::Watch;
use crate::{LayoutConfig, MeshInput, Stack};
use fam_surface::Component;

/// Components that are to be cut and flattened.
pub struct Flattening<'a, 'w> {
    pub config: &'a LayoutConfig,
    /// How far a component of so many triangles is cut: see [`Task::share`].
    pub share: &'a (dyn Fn(usize) -> f64 + Sync),
    pub input: &'a MeshInput<'a>,
    /// Half of the unit of layouts, in units of the input.
    pub unit: f64,
    /// What seams cost at every vertex of every component for each unit of length.
    pub rates: Option<&'a [Vec<f64>]>,
    pub watch: &'a Watch<'w>,
}

/// Charts of a component, and which of them are mirror images.
type Charts = (Vec<FlatChart>, Vec<Mirror>);

impl Flattening<'_, '_> {
    /// The charts of all components, and which of them are mirror images. Those for which `is_copy` holds
    /// have none.
    pub fn charts(
        &self,
        roles: &[Role],
        is_copy: impl Fn(usize) -> bool + Sync,
    ) -> (Vec<Vec<FlatChart>>, Vec<Vec<Mirror>>) {
        let list = &self.input.components.list;
        let sizes: Vec<usize> = list.iter().map(|c| c.mesh.triangles().len()).collect();
        let mut found = largest_first(&sizes, |i| match &roles[i] {
            _ if is_copy(i) => {
                self.watch.of(i).finishes();
                (Vec::new(), Vec::new())
            }
            Role::ImageOf(of, _) if !is_copy(*of) => (Vec::new(), Vec::new()),
            role => self.of_component(i, role),
        });
        let images = largest_first(&sizes, |i| match &roles[i] {
            Role::ImageOf(of, pairing) if !is_copy(i) && !is_copy(*of) => {
                let mesh = scaled(&list[i].mesh, self.unit);
                Some(match image_of(&mesh, &found[*of].0, *of, pairing) {
                    Some(images) => {
                        self.watch.of(i).finishes();
                        images
                    }
                    None => self.of_component(i, &Role::Alone),
                })
            }
            Role::Alone | Role::Own(_) | Role::Nearly(_) | Role::ImageOf(..) => None,
        });
        for (found, image) in found.iter_mut().zip(images) {
            if let Some(image) = image {
                *found = image;
            }
        }
        found.into_iter().unzip()
    }

    /// The charts of a component by itself, or by its own symmetry.
    fn of_component(&self, i: usize, role: &Role) -> Charts {
        let component = &self.input.components.list[i];
        let watch = self.watch.of(i);
        let mesh = scaled(&component.mesh, self.unit);
        let mut marks = self.input.marks.of_component(component);
        if let Some(angle) = self.config.hard_angle {
            marks.want(sharp_edges(&mesh, angle.to_radians()));
        }
        let task = Task {
            config: self.config,
            share: (self.share)(mesh.triangles().len()),
            mesh: &mesh,
            map: self.input.map.map(|map| map[i].as_slice()),
            marks: &marks,
            rates: self.rates.map(|rates| rates[i].as_slice()),
            watch: &watch,
        };
        let charts = self.symmetric(i, component, &task, role);
        let charts = charts.unwrap_or_else(|| {
            let charts = flat_charts(&task);
            let mirrors = vec![Mirror::None; charts.len()];
            (charts, mirrors)
        });
        watch.finishes();
        charts
    }

    /// The charts of a component that is its own mirror image, as mirror images, if that is possible.
    fn symmetric(&self, i: usize, own: &Component, task: &Task, role: &Role) -> Option<Charts> {
        let nearly =
            |plane| nearly_symmetric_charts(task, &scaled_plane(plane, &own.mesh, self.unit)?);
        match role {
            Role::Own(role) => {
                let symmetric = Symmetric {
                    task: *task,
                    placed: &own.mesh,
                    pairing: &role.pairing,
                    plane: &role.plane,
                };
                let exactly = || charts_of_both_halves(&symmetric, i);
                let nearly = || nearly(&role.plane);
                // Only halves whose vertices correspond can share their place.
                match role.is_fragmented && self.config.stack != Stack::Mirrored {
                    true => nearly().or_else(exactly),
                    false => exactly().or_else(nearly),
                }
            }
            Role::Nearly(plane) => nearly(plane),
            Role::Alone | Role::ImageOf(..) => None,
        }
    }
}
