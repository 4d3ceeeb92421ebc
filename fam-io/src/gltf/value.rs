//! Parts of a document's JSON, checked as they are read.

use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use crate::error::ReadFault;
use crate::text::excerpt;

pub(super) fn malformed(problem: impl Into<String>) -> ReadFault {
    ReadFault::Malformed(problem.into())
}

/// The list of objects called `key`; empty if there is none.
pub(super) fn list<'a>(owner: &'a Value, key: &str) -> Result<&'a [Value], ReadFault> {
    match &owner[key] {
        Value::Null if owner.get(key).is_none() => Ok(&[]),
        Value::Array(list) if list.iter().all(Value::is_object) => Ok(list),
        _ => Err(malformed(format!("`{key}` is not a list of objects"))),
    }
}

/// The list of objects called `key`, each as a `T`, a type of the crate `gltf`.
pub(super) fn typed<T: DeserializeOwned>(owner: &Value, key: &str) -> Result<Vec<T>, ReadFault> {
    let objects = list(owner, key)?.iter().enumerate();
    objects
        .map(|(index, object)| {
            if let Some(narrow) = too_large(object) {
                return Err(malformed(format!(
                    "{key}[{index}]: `{narrow}` is too large"
                )));
            }
            T::deserialize(object).map_err(|error| {
                let problem = excerpt(error.to_string().as_bytes());
                malformed(format!("{key}[{index}]: {problem}"))
            })
        })
        .collect()
}

/// The first of the numbers in an accessor or a view that does not fit into 32 bits although it
/// has to; `gltf` would cut it.
fn too_large(object: &Value) -> Option<&str> {
    const NARROW: [&str; 3] = ["buffer", "bufferView", "componentType"];
    let is_too_large = |value: &Value| value.as_u64().is_some_and(|n| u32::try_from(n).is_err());
    object
        .as_object()?
        .iter()
        .find_map(|(key, value)| match key.as_str() {
            "sparse" | "indices" | "values" => too_large(value),
            key if NARROW.contains(&key) && is_too_large(value) => Some(key),
            _ => None,
        })
}

/// The index called `key`, less than `count`.
pub(super) fn index(owner: &Value, key: &str, count: usize) -> Result<Option<usize>, ReadFault> {
    owner
        .get(key)
        .map(|value| index_of(value, key, count))
        .transpose()
}

/// The list of indices called `key`, each less than `count`.
pub(super) fn indices(owner: &Value, key: &str, count: usize) -> Result<Vec<usize>, ReadFault> {
    match owner.get(key) {
        None => Ok(Vec::new()),
        Some(Value::Array(list)) => list
            .iter()
            .map(|value| index_of(value, key, count))
            .collect(),
        Some(_) => Err(malformed(format!("`{key}` is not a list"))),
    }
}

/// The named indices of an object such as `attributes`, in the order of their names.
pub(super) fn named_indices(
    names: &Map<String, Value>,
    count: usize,
) -> Result<Vec<(String, usize)>, ReadFault> {
    let mut pairs = names
        .iter()
        .map(|(name, value)| Ok((name.clone(), index_of(value, name, count)?)))
        .collect::<Result<Vec<_>, ReadFault>>()?;
    pairs.sort();
    Ok(pairs)
}

fn index_of(value: &Value, key: &str, count: usize) -> Result<usize, ReadFault> {
    let key = excerpt(key.as_bytes());
    match value.as_u64() {
        Some(index) if index < count as u64 => Ok(index as usize),
        Some(index) => Err(malformed(format!(
            "`{key}` refers to entry {index}, but there are only {count}"
        ))),
        None => Err(malformed(format!("`{key}` is not an index"))),
    }
}

/// The list of `N` numbers called `key`.
pub(super) fn numbers<const N: usize>(
    owner: &Value,
    key: &str,
) -> Result<Option<[f64; N]>, ReadFault> {
    let Some(value) = owner.get(key) else {
        return Ok(None);
    };
    let list: Option<Vec<f64>> = value
        .as_array()
        .and_then(|list| list.iter().map(Value::as_f64).collect());
    let list = list.and_then(|list| list.try_into().ok());
    list.map(Some)
        .ok_or_else(|| malformed(format!("`{key}` is not a list of {N} numbers")))
}
