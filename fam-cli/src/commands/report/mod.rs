mod text;

use std::collections::BTreeMap;
use std::io::{self, Write};

use crate::args;
use crate::failure::{Failure, SUCCESS};
use crate::manifest::{self, Entry, State};
use crate::terminal::print_line;

/// Merges manifests and shows what came of all files.
pub fn report(arguments: &args::Report) -> Result<u8, Failure> {
    let mut paths = Vec::new();
    for path in &arguments.manifests {
        if !path.is_dir() {
            paths.push(path.clone());
            continue;
        }
        let found = manifest::in_folder(path)?;
        if found.is_empty() {
            let reason = format!("there is no {}", manifest::NAME);
            return Err(Failure::input(format!("{}: {reason}", path.display())));
        }
        paths.extend(found);
    }
    let mut latest: BTreeMap<String, Entry> = BTreeMap::new();
    for path in paths {
        let (entries, fault) = manifest::read(&path)?;
        if let Some(fault) = fault {
            print_line(&format!("warning: {fault}"));
        }
        for entry in entries {
            if latest
                .get(&entry.input)
                .is_none_or(|before| counts_more(&entry, before))
            {
                latest.insert(entry.input.clone(), entry);
            }
        }
    }
    let entries: Vec<Entry> = latest.into_values().collect();
    let mut text = String::new();
    match arguments.json {
        true => {
            for entry in &entries {
                text.push_str(&serde_json::to_string(entry).map_err(Failure::work)?);
                text.push('\n');
            }
        }
        false => text = text::Text(&entries).to_string(),
    }
    match io::stdout().write_all(text.as_bytes()) {
        // Whoever reads it has read enough.
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(SUCCESS),
        written => written.map(|()| SUCCESS).map_err(Failure::work),
    }
}

/// Whether an entry of a file replaces another one: the later does, unless it says of the same
/// result only that it was there.
fn counts_more(entry: &Entry, before: &Entry) -> bool {
    let was_there = entry.seconds.is_none()
        && before.seconds.is_some()
        && before.state == State::Done
        && before.hash == entry.hash;
    entry.finished >= before.finished && !was_there
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_latest_entry_counts_unless_it_only_says_that_the_result_was_there() {
        let entry = |state, seconds, hash: &str, finished| Entry {
            input: String::from("a.obj"),
            folder: String::from("a.fam"),
            hash: Some(hash.to_owned()),
            state,
            seconds,
            message: String::new(),
            metrics: None,
            finished,
        };
        let done = entry(State::Done, Some(2.0), "1", 5.0);
        assert!(!counts_more(&entry(State::Done, None, "1", 6.0), &done));
        assert!(counts_more(&entry(State::Done, None, "2", 6.0), &done));
        assert!(counts_more(
            &entry(State::Failed, Some(1.0), "1", 6.0),
            &done
        ));
        assert!(!counts_more(
            &entry(State::Failed, Some(1.0), "1", 4.0),
            &done
        ));
        let failed = entry(State::Failed, Some(1.0), "1", 5.0);
        assert!(counts_more(&entry(State::Done, None, "1", 6.0), &failed));
    }
}
