//! What a document no longer uses makes room for what was added.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::ops::Range;

use ::gltf::json::accessor::FLOAT;
use serde_json::{Value, json};

use super::package::ALIGNMENT;
use super::package::Package;
use super::usage::{used_accessors, used_views};

/// What a document used and had before anything was added.
pub(super) struct Before {
    accessors: BTreeSet<usize>,
    accessor_count: usize,
    views: BTreeSet<usize>,
    view_count: usize,
}

impl Before {
    pub fn of(package: &Package) -> Self {
        Self {
            accessors: used_accessors(package),
            accessor_count: package.count("accessors"),
            views: used_views(package),
            view_count: package.count("bufferViews"),
        }
    }

    /// Moves added accessors and views to the places of those that have gone out of use, and
    /// leaves out the bytes that belong to no view any more. What is still in use keeps its
    /// index. `replaced` says which accessors the added ones were made from.
    pub fn compact(self, package: &mut Package, replaced: &BTreeMap<usize, usize>) {
        let replaced_views = replaced_views(package, replaced);
        let used = used_accessors(package);
        let vacant = self.accessors.difference(&used).copied().collect();
        // A place that cannot be taken or left out stays valid: an accessor of one zero.
        let filler = json!({"componentType": FLOAT, "count": 1, "type": "SCALAR"});
        let moved = fill(
            package,
            "accessors",
            self.accessor_count,
            vacant,
            replaced,
            &filler,
        );
        renumber_accessors(package, &moved);

        let used = used_views(package);
        let vacant: BTreeSet<_> = self.views.difference(&used).copied().collect();
        let views = package.entries("bufferViews");
        let dead = vacant.iter().map(|&view| span(&views[view])).collect();
        let filler = json!({"buffer": 0, "byteLength": 1});
        let moved = fill(
            package,
            "bufferViews",
            self.view_count,
            vacant,
            &replaced_views,
            &filler,
        );
        renumber_views(package, &moved);
        leave_out(package, dead);
    }
}

/// For the views of added accessors, those of the accessors whose place they take.
fn replaced_views(package: &Package, replaced: &BTreeMap<usize, usize>) -> BTreeMap<usize, usize> {
    let accessors = package.entries("accessors");
    let view = |accessor: usize| Some(accessors[accessor]["bufferView"].as_u64()? as usize);
    let pairs = replaced.iter();
    pairs
        .filter_map(|(&added, &old)| view(added).zip(view(old)))
        .collect()
}

/// Puts the entries of a list that were added into vacant places, preferred ones first, and
/// returns where they are then. Vacant places that are left are cut off at the end of the list.
fn fill(
    package: &mut Package,
    list: &str,
    count: usize,
    mut vacant: BTreeSet<usize>,
    preferred: &BTreeMap<usize, usize>,
    filler: &Value,
) -> HashMap<usize, usize> {
    let mut moved = HashMap::new();
    let Some(list) = package.json.get_mut(list).and_then(Value::as_array_mut) else {
        return moved;
    };
    let added = count..list.len();
    for (&entry, &place) in preferred {
        if vacant.remove(&place) {
            moved.insert(entry, place);
        }
    }
    let mut end = count;
    for entry in added.clone() {
        moved.entry(entry).or_insert_with(|| {
            vacant.pop_first().unwrap_or_else(|| {
                end += 1;
                end - 1
            })
        });
    }
    for entry in added {
        list.swap(entry, moved[&entry]);
    }
    list.truncate(end);
    for &place in &vacant {
        list[place] = filler.clone();
    }
    while list
        .len()
        .checked_sub(1)
        .is_some_and(|last| vacant.contains(&last))
    {
        list.pop();
    }
    moved
}

fn renumber(index: Option<&mut Value>, moved: &HashMap<usize, usize>) {
    if let Some(index) = index
        && let Some(place) = index.as_u64().and_then(|old| moved.get(&(old as usize)))
    {
        *index = (*place).into();
    }
}

/// Brings the references to accessors that were added up to date.
fn renumber_accessors(package: &mut Package, moved: &HashMap<usize, usize>) {
    for mesh in entries(package, "meshes") {
        let primitives = mesh.get_mut("primitives").and_then(Value::as_array_mut);
        for primitive in primitives.into_iter().flatten() {
            renumber(primitive.get_mut("indices"), moved);
            renumber_all(primitive.get_mut("attributes"), moved);
            let targets = primitive.get_mut("targets").and_then(Value::as_array_mut);
            for target in targets.into_iter().flatten() {
                renumber_all(Some(target), moved);
            }
        }
    }
}

fn renumber_all(attributes: Option<&mut Value>, moved: &HashMap<usize, usize>) {
    let attributes = attributes.and_then(Value::as_object_mut);
    for (_, index) in attributes.into_iter().flatten() {
        renumber(Some(index), moved);
    }
}

/// Brings the references to views that were added up to date.
fn renumber_views(package: &mut Package, moved: &HashMap<usize, usize>) {
    for user in ["accessors", "images"] {
        for entry in entries(package, user) {
            renumber(entry.get_mut("bufferView"), moved);
        }
    }
}

fn entries<'a>(package: &'a mut Package, list: &str) -> impl Iterator<Item = &'a mut Value> {
    let list = package.json.get_mut(list).and_then(Value::as_array_mut);
    list.into_iter().flatten()
}

/// Which bytes of the buffer a view has.
fn span(view: &Value) -> Range<usize> {
    let number = |key: &str| view[key].as_u64().unwrap_or(0) as usize;
    let start = number("byteOffset");
    start..start + number("byteLength")
}

/// Takes ranges of the buffer out, as far as no view has them. What remains is moved by
/// multiples of the alignment.
fn leave_out(package: &mut Package, dead: Vec<Range<usize>>) {
    let length = package.bin.len();
    let live = merge(package.entries("bufferViews").iter().map(span).collect());
    let dead = merge(dead);
    let mut cuts: Vec<Range<usize>> = Vec::new();
    let mut gap_start = 0;
    for live in live.into_iter().chain(std::iter::once(length..length)) {
        let gap = gap_start..live.start;
        gap_start = live.end;
        let first = dead.partition_point(|dead| dead.end <= gap.start);
        let inside = dead[first..].iter().take_while(|dead| dead.start < gap.end);
        for dead in inside {
            let start = dead.start.max(gap.start).next_multiple_of(ALIGNMENT);
            let end = dead.end.next_multiple_of(ALIGNMENT);
            let end = match gap.end {
                _ if end <= gap.end => end,
                gap_end if gap_end == length => length,
                gap_end => gap_end / ALIGNMENT * ALIGNMENT,
            };
            if start < end {
                cuts.push(start..end);
            }
        }
    }
    let mut kept = Vec::with_capacity(length);
    let mut at = 0;
    for cut in &cuts {
        kept.extend_from_slice(&package.bin[at..cut.start]);
        at = cut.end;
    }
    kept.extend_from_slice(&package.bin[at..]);
    // The length does not depend on which view is last.
    kept.resize(kept.len().next_multiple_of(ALIGNMENT), 0);
    package.bin = kept;
    let mut removed = vec![0];
    for cut in &cuts {
        removed.push(removed[removed.len() - 1] + cut.len());
    }
    for view in entries(package, "bufferViews") {
        let start = span(view).start;
        let before = cuts.partition_point(|cut| cut.end <= start);
        if before > 0 {
            view["byteOffset"] = (start - removed[before]).into();
        }
    }
}

/// Ranges in order, those that touch as one; empty ones are dropped.
fn merge(mut ranges: Vec<Range<usize>>) -> Vec<Range<usize>> {
    ranges.retain(|range| !range.is_empty());
    ranges.sort_by_key(|range| range.start);
    let mut merged: Vec<Range<usize>> = Vec::new();
    for range in ranges {
        match merged.last_mut() {
            Some(last) if range.start <= last.end => last.end = last.end.max(range.end),
            _ => merged.push(range),
        }
    }
    merged
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_of_no_view_are_left_out() {
        let view = |start: usize, length: usize| json!({"buffer": 0, "byteOffset": start, "byteLength": length});
        let mut package = Package {
            json: json!({"bufferViews": [view(20, 12), view(64, 4), {"byteLength": 4}]}),
            bin: (0..72).collect(),
        };
        // One range overlaps a view that stays, one reaches to the end but for a view.
        leave_out(&mut package, vec![8..24, 36..63, 60..72]);
        let views: Vec<_> = package.json["bufferViews"]
            .as_array()
            .unwrap()
            .iter()
            .map(span)
            .collect();
        assert_eq!(views, [12..24, 32..36, 0..4]);
        let expected: Vec<u8> = (0..8).chain(16..40).chain(64..72).collect();
        assert_eq!(package.bin, expected);
    }

    #[test]
    fn places_are_filled_and_the_rest_is_cut_off() {
        let list = |names: &str| {
            names
                .chars()
                .map(|c| json!(c.to_string()))
                .collect::<Value>()
        };
        let run = |count: usize, vacant: &[usize], preferred: &[(usize, usize)]| {
            let mut package = Package {
                json: json!({"x": list("abcdefgh")}),
                bin: Vec::new(),
            };
            let vacant = vacant.iter().copied().collect();
            let preferred = preferred.iter().copied().collect();
            let moved = fill(&mut package, "x", count, vacant, &preferred, &json!("-"));
            let moved: BTreeMap<_, _> = moved.into_iter().collect();
            (package.json["x"].clone(), moved)
        };
        let (after, moved) = run(5, &[1, 3], &[(6, 3)]);
        assert_eq!(after, list("afcgeh"));
        assert_eq!(moved, BTreeMap::from([(5, 1), (6, 3), (7, 5)]));
        let (after, moved) = run(7, &[1, 2, 4, 5, 6], &[(7, 2)]);
        assert_eq!(after, list("a-hd"));
        assert_eq!(moved, BTreeMap::from([(7, 2)]));
    }
}
