//! The facets of a file.

use std::collections::HashMap;

use fam_surface::polygons::Polygons;

/// Facets with their equal corners made one.
#[derive(Default)]
pub(super) struct Facets {
    pub positions: Vec<[f64; 3]>,
    pub polygons: Polygons,
    /// The solid of every facet, counting those that have some.
    pub solids: Vec<u32>,
    solid: u32,
    vertices: HashMap<[u64; 3], u32>,
}

impl Facets {
    pub fn push(&mut self, corners: [[f64; 3]; 3]) {
        let vertices = corners.map(|corner| {
            // Adding zero makes −0 and 0 one.
            let key = corner.map(|c| (c + 0.0).to_bits());
            *self.vertices.entry(key).or_insert_with(|| {
                self.positions.push(corner);
                (self.positions.len() - 1) as u32
            })
        });
        self.polygons.push(vertices);
        self.solids.push(self.solid);
    }

    pub fn end_solid(&mut self) {
        if !self.vertices.is_empty() {
            self.vertices.clear();
            self.solid += 1;
        }
    }
}
