//! The primitives that make up the surface of a document.

use std::collections::{BTreeSet, HashMap};
use std::ops::Range;

use ::gltf::json::accessor::{ComponentType, Type};
use ::gltf::json::mesh::{POINTS, TRIANGLE_FAN, TRIANGLE_STRIP, TRIANGLES};
use fam_surface::SurfaceError;
use serde_json::Value;

use super::elements::{Accessors, Elements};
use super::package::Package;
use super::value::{index, list, malformed, named_indices};
use crate::error::ReadFault;
use crate::text::excerpt;

/// Pools of vertices and the primitives that use them: all of triangles, or all of points.
#[derive(Debug, Clone, Default)]
pub(super) struct Geometry {
    /// Of one mesh after the other.
    pub pools: Vec<Pool>,
    /// In the order of the document.
    pub primitives: Vec<Primitive>,
}

/// The vertices of primitives of one mesh that have the same accessors as their attributes.
#[derive(Debug, Clone)]
pub(super) struct Pool {
    pub mesh: usize,
    pub attributes: Vec<Attribute>,
    /// The attributes of each morph target.
    pub targets: Vec<Vec<Attribute>>,
    /// Which vertices of the surface they are.
    pub vertices: Range<usize>,
}

/// A vertex attribute, such as `NORMAL`.
#[derive(Debug, Clone)]
pub(super) struct Attribute {
    pub name: String,
    pub accessor: usize,
    pub elements: Elements,
}

#[derive(Debug, Clone)]
pub(super) struct Primitive {
    pub mesh: usize,
    /// Which one of the mesh it is.
    pub index: usize,
    pub pool: usize,
    pub material: Option<usize>,
    pub is_indexed: bool,
    /// Over the vertices of the pool.
    pub triangles: Vec<[u32; 3]>,
}

impl Pool {
    /// An attribute; `None` if the pool has none of the name.
    pub fn attribute(&self, name: &str) -> Option<&Attribute> {
        self.attributes
            .iter()
            .find(|attribute| attribute.name == name)
    }
}

impl Geometry {
    /// The primitives of triangles, or those of points if there are no triangles.
    pub fn of(package: &Package, size: usize) -> Result<Self, ReadFault> {
        let triangles = Reader::new(package, size)?.read(is_of_triangles)?;
        if !triangles.primitives.is_empty() {
            return Ok(triangles);
        }
        let points = Reader::new(package, size)?.read(|mode| mode == POINTS)?;
        if points.pools.iter().all(|pool| pool.vertices.is_empty()) {
            return Err(SurfaceError::NoVertices.into());
        }
        Ok(points)
    }

    /// The pools of a mesh.
    pub fn pools_of(&self, mesh: usize) -> &[Pool] {
        let start = self.pools.partition_point(|pool| pool.mesh < mesh);
        let end = self.pools.partition_point(|pool| pool.mesh <= mesh);
        &self.pools[start..end]
    }

    /// The primitives of a mesh.
    pub fn primitives_of(&self, mesh: usize) -> &[Primitive] {
        let start = self
            .primitives
            .partition_point(|primitive| primitive.mesh < mesh);
        let end = self
            .primitives
            .partition_point(|primitive| primitive.mesh <= mesh);
        &self.primitives[start..end]
    }
}

fn is_of_triangles(mode: u32) -> bool {
    [TRIANGLES, TRIANGLE_STRIP, TRIANGLE_FAN].contains(&mode)
}

/// The accessors of attributes and of those of each morph target, by name.
type PoolKey = (Vec<(String, usize)>, Vec<Vec<(String, usize)>>);

struct Reader<'a> {
    package: &'a Package,
    accessors: Accessors<'a>,
    /// How many more elements may be read.
    budget: u64,
    geometry: Geometry,
}

impl<'a> Reader<'a> {
    /// For a document of so many bytes. Accessors without data, and those that many primitives
    /// share, make a small document announce more elements than can be read.
    fn new(package: &'a Package, size: usize) -> Result<Self, ReadFault> {
        Ok(Self {
            package,
            accessors: Accessors::of(package)?,
            budget: 16 * size as u64 + (1 << 20),
            geometry: Geometry::default(),
        })
    }

    fn read(mut self, is_wanted: impl Fn(u32) -> bool) -> Result<Geometry, ReadFault> {
        for (mesh, entry) in list(&self.package.json, "meshes")?.iter().enumerate() {
            let mut pools = HashMap::new();
            for (index, primitive) in list(entry, "primitives")?.iter().enumerate() {
                let mode = mode(primitive)?;
                if is_wanted(mode) {
                    self.primitive(mesh, index, primitive, mode, &mut pools)
                        .map_err(|fault| match fault {
                            ReadFault::Malformed(problem) => {
                                malformed(format!("mesh {mesh}, primitive {index}: {problem}"))
                            }
                            other => other,
                        })?;
                }
            }
        }
        Ok(self.geometry)
    }

    fn primitive(
        &mut self,
        mesh: usize,
        index_in_mesh: usize,
        primitive: &Value,
        mode: u32,
        pools: &mut HashMap<PoolKey, usize>,
    ) -> Result<(), ReadFault> {
        let key = self.pool_key(primitive)?;
        if key.0.iter().all(|(name, _)| name != "POSITION") {
            return Ok(());
        }
        let (pool, added) = match pools.get(&key) {
            Some(&pool) => (pool, None),
            None => (self.geometry.pools.len(), Some(self.pool(mesh, &key)?)),
        };
        let mut triangles = Vec::new();
        if mode != POINTS {
            let pool = added.as_ref().unwrap_or_else(|| &self.geometry.pools[pool]);
            let vertices = pool.vertices.len();
            triangles = triangles_of(mode, &self.indices(primitive, vertices)?);
            if triangles.is_empty() {
                return Ok(());
            }
        }
        if let Some(added) = added {
            self.geometry.pools.push(added);
            pools.insert(key, pool);
        }
        let materials = self.package.count("materials");
        self.geometry.primitives.push(Primitive {
            mesh,
            index: index_in_mesh,
            pool,
            material: index(primitive, "material", materials)?,
            is_indexed: primitive.get("indices").is_some(),
            triangles,
        });
        Ok(())
    }

    fn pool_key(&self, primitive: &Value) -> Result<PoolKey, ReadFault> {
        let names = |owner: &Value| {
            let names = owner
                .as_object()
                .ok_or_else(|| malformed("its attributes are no object"))?;
            named_indices(names, self.accessors.count())
        };
        let targets = list(primitive, "targets")?.iter().map(names);
        Ok((
            names(&primitive["attributes"])?,
            targets.collect::<Result<_, _>>()?,
        ))
    }

    fn pool(&mut self, mesh: usize, (attributes, targets): &PoolKey) -> Result<Pool, ReadFault> {
        let all = attributes.iter().chain(targets.iter().flatten());
        let distinct: BTreeSet<_> = all.map(|&(_, accessor)| accessor).collect();
        for accessor in distinct {
            self.spend(accessor)?;
        }
        let attributes = self.attributes(attributes)?;
        let targets = targets.iter().map(|target| self.attributes(target));
        let targets = targets.collect::<Result<Vec<_>, _>>()?;
        let positions = attributes
            .iter()
            .find(|attribute| attribute.name == "POSITION");
        let count = positions.map_or(0, |positions| positions.elements.count);
        let mut all = attributes.iter().chain(targets.iter().flatten());
        if let Some(other) = all.find(|attribute| attribute.elements.count != count) {
            return Err(malformed(format!(
                "{} has {} elements, but POSITION has {count}",
                excerpt(other.name.as_bytes()),
                other.elements.count
            )));
        }
        let start = self
            .geometry
            .pools
            .last()
            .map_or(0, |pool| pool.vertices.end);
        let end = start
            .checked_add(count)
            .filter(|&end| u32::try_from(end).is_ok());
        let end = end.ok_or_else(|| malformed("there are more than 4294967295 vertices"))?;
        Ok(Pool {
            mesh,
            attributes,
            targets,
            vertices: start..end,
        })
    }

    fn attributes(&mut self, pairs: &[(String, usize)]) -> Result<Vec<Attribute>, ReadFault> {
        pairs
            .iter()
            .map(|(name, accessor)| {
                let attribute = Attribute {
                    name: name.clone(),
                    accessor: *accessor,
                    elements: self.accessors.elements(*accessor)?,
                };
                check_kind(&attribute)?;
                Ok(attribute)
            })
            .collect()
    }

    /// The indices of a primitive, explicit or not.
    fn indices(&mut self, primitive: &Value, vertices: usize) -> Result<Vec<u32>, ReadFault> {
        let Some(accessor) = index(primitive, "indices", self.accessors.count())? else {
            self.take(vertices as u64)?;
            return Ok((0..vertices as u32).collect());
        };
        self.spend(accessor)?;
        let elements = self.accessors.elements(accessor)?;
        let restart = match (elements.kind, elements.component) {
            (Type::Scalar, ComponentType::U8) => u8::MAX.into(),
            (Type::Scalar, ComponentType::U16) => u16::MAX.into(),
            (Type::Scalar, ComponentType::U32) => u32::MAX,
            _ => return Err(malformed("its indices are not unsigned integers")),
        };
        let indices = elements.indices(&self.package.bin);
        if indices.contains(&restart) {
            return Err(malformed(format!(
                "it has the index {restart}, which would restart the primitive"
            )));
        }
        match indices.iter().find(|&&index| index as usize >= vertices) {
            Some(index) => Err(malformed(format!(
                "it has the index {index}, but there are only {vertices} vertices"
            ))),
            None => Ok(indices),
        }
    }

    /// Takes the elements of an accessor off the budget.
    fn spend(&mut self, accessor: usize) -> Result<(), ReadFault> {
        self.take(self.accessors.announced(accessor))
    }

    fn take(&mut self, elements: u64) -> Result<(), ReadFault> {
        self.budget = self
            .budget
            .checked_sub(elements)
            .ok_or_else(|| malformed("its elements are out of proportion to the file"))?;
        Ok(())
    }
}

fn mode(primitive: &Value) -> Result<u32, ReadFault> {
    let mode = index(primitive, "mode", TRIANGLE_FAN as usize + 1)?;
    Ok(mode.map_or(TRIANGLES, |mode| mode as u32))
}

/// Refuses attributes of known meaning but of a type that has none.
fn check_kind(attribute: &Attribute) -> Result<(), ReadFault> {
    let Elements {
        kind, component, ..
    } = attribute.elements;
    let name = attribute.name.as_str();
    let fits = match name {
        "POSITION" | "NORMAL" => kind == Type::Vec3,
        "COLOR_0" => [Type::Vec3, Type::Vec4].contains(&kind),
        _ if name.starts_with("TEXCOORD_") => kind == Type::Vec2,
        _ => return Ok(()),
    };
    if fits && component != ComponentType::U32 {
        Ok(())
    } else {
        let name = excerpt(name.as_bytes());
        Err(malformed(format!(
            "{name} is of a type that it cannot have"
        )))
    }
}

/// The triangles of a list, a strip or a fan. What joins the parts of a strip or a fan,
/// triangles that have a vertex twice, is left out.
fn triangles_of(mode: u32, indices: &[u32]) -> Vec<[u32; 3]> {
    if mode == TRIANGLES {
        let (triangles, _) = indices.as_chunks();
        return triangles.to_vec();
    }
    let count = indices.len().saturating_sub(2);
    let triangle = |i: usize| match mode {
        TRIANGLE_STRIP => [indices[i], indices[i + 1 + i % 2], indices[i + 2 - i % 2]],
        _ => [indices[i + 1], indices[i + 2], indices[0]],
    };
    (0..count)
        .map(triangle)
        .filter(|[a, b, c]| a != b && b != c && c != a)
        .collect()
}
