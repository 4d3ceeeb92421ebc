//! Names in OBJ and MTL files, where a name is one word.

use std::collections::{HashMap, HashSet};

/// The name with `_` in the place of blanks, of `#`, which starts a comment, and of `\`, which
/// joins lines.
pub(super) fn word(name: &str) -> String {
    let bad = |c: char| c.is_whitespace() || c.is_control() || matches!(c, '#' | '\\');
    name.chars().map(|c| if bad(c) { '_' } else { c }).collect()
}

/// The names as words, each different: repeated ones get a number, empty ones a name.
pub(super) fn distinct<'a>(names: impl Iterator<Item = &'a str>, unnamed: &str) -> Vec<String> {
    let mut used = HashSet::new();
    let mut repeated: HashMap<String, u64> = HashMap::new();
    let distinct = names.map(|name| {
        let name = if name.is_empty() { unnamed } else { name };
        let name = word(name);
        let count = repeated.entry(name.clone()).or_insert(0);
        loop {
            *count += 1;
            let candidate = match count {
                1 => name.clone(),
                _ => format!("{name}-{count}"),
            };
            if used.insert(candidate.clone()) {
                return candidate;
            }
        }
    });
    distinct.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_distinct_words() {
        let names = ["a b", "a-2", "a", "a", "", "a\\", "", "#\n"];
        assert_eq!(
            distinct(names.into_iter(), "mesh"),
            ["a_b", "a-2", "a", "a-3", "mesh", "a_", "mesh-2", "__"]
        );
    }
}
