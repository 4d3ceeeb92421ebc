//! What the documents say of the program: their command lines and configurations.

use std::path::{Path, PathBuf};

use clap::Parser;

use crate::args::{Arguments, Unwrap};
use crate::config;

/// A fenced block of a page.
struct Block {
    /// The page and the line where it begins, for messages.
    place: String,
    text: String,
}

/// All blocks in a language, of the pages in docs/ and of those that stand by themselves.
fn blocks(language: &str) -> Vec<Block> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let docs = std::fs::read_dir(root.join("docs")).unwrap();
    let mut pages: Vec<PathBuf> = docs.map(|entry| entry.unwrap().path()).collect();
    pages.retain(|path| path.extension().is_some_and(|end| end == "md"));
    assert!(pages.len() > 10, "the pages are elsewhere");
    pages
        .extend(["README.md", "fam-py/README.md", "blender/README.md"].map(|name| root.join(name)));
    pages.sort();
    pages
        .iter()
        .flat_map(|page| blocks_of(page, language))
        .collect()
}

fn blocks_of(page: &Path, language: &str) -> Vec<Block> {
    let content = std::fs::read_to_string(page).unwrap();
    let mut blocks = Vec::new();
    let mut lines = content.lines().enumerate();
    while let Some((number, line)) = lines.next() {
        let Some(info) = line.strip_prefix("```") else {
            continue;
        };
        let inside = lines.by_ref().map(|(_, line)| line);
        let text: Vec<&str> = inside.take_while(|line| *line != "```").collect();
        if info == language {
            blocks.push(Block {
                place: format!("{}:{}", page.display(), number + 1),
                text: text.join("\n"),
            });
        }
    }
    blocks
}

/// The words of a line as a shell takes them apart, without its comment.
fn words(line: &str) -> Vec<String> {
    let mut words = Vec::new();
    let mut word: Option<String> = None;
    let mut quote = None;
    for character in line.chars() {
        match (quote, character) {
            (Some(open), close) if open == close => quote = None,
            (None, '\'' | '"') => {
                quote = Some(character);
                word.get_or_insert_default();
            }
            (None, '#') if word.is_none() => break,
            (None, ' ') => words.extend(word.take()),
            _ => word.get_or_insert_default().push(character),
        }
    }
    words.extend(word);
    words
}

/// The arguments of `fam`, if a line calls it by any of its names.
fn arguments(words: &[String]) -> Option<&[String]> {
    let begins =
        |with: &[&str]| words.len() >= with.len() && words.iter().zip(with).all(|(a, b)| a == b);
    if begins(&["fam"]) {
        Some(&words[1..])
    } else if begins(&["python", "-m", "flatten_anything"]) {
        Some(&words[3..])
    } else if begins(&["cargo", "run"]) && words.iter().any(|word| word == "fam-cli") {
        let end = words.iter().position(|word| word == "--");
        Some(end.map_or(&[], |end| &words[end + 1..]))
    } else {
        None
    }
}

#[test]
fn every_command_line_is_one_that_the_program_takes() {
    let mut count = 0;
    for block in blocks("sh") {
        for line in block.text.replace("\\\n", " ").lines() {
            let words = words(line);
            let Some(arguments) = arguments(&words) else {
                continue;
            };
            // What `slurm` stands for comes from the environment of its tasks.
            let arguments = arguments.iter().map(|word| match word.as_str() {
                "slurm" => "1/50",
                word => word,
            });
            let result = Arguments::try_parse_from(["fam"].into_iter().chain(arguments));
            assert!(
                result.is_ok(),
                "{}: {line}\n{}",
                block.place,
                result.unwrap_err()
            );
            count += 1;
        }
    }
    assert!(count > 20, "only {count} command lines were found");
}

#[test]
fn every_configuration_is_one_that_the_program_reads() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("config.toml");
    let mut count = 0;
    for block in blocks("toml") {
        if block.text.starts_with("# Cargo.toml\n") {
            continue;
        }
        std::fs::write(&path, &block.text).unwrap();
        let unwrap = Unwrap {
            config: Some(path.clone()),
            ..Unwrap::default()
        };
        let result = config::resolve(&unwrap);
        assert!(result.is_ok(), "{}: {}", block.place, result.unwrap_err());
        count += 1;
    }
    assert!(count > 0, "no configuration was found");
}

/// Dependencies that pages name are those of this program, or others could not be combined with it.
#[test]
fn every_manifest_asks_for_versions_of_the_workspace() {
    let manifest = |text: &str| toml::from_str::<toml::Table>(text).unwrap();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../Cargo.toml");
    let workspace = manifest(&std::fs::read_to_string(path).unwrap());
    let known = workspace["workspace"]["dependencies"].as_table().unwrap();
    let version = |value: &toml::Value| {
        let text = value.as_str().or_else(|| value.get("version")?.as_str());
        text.unwrap().trim_start_matches('=').to_owned()
    };
    let mut count = 0;
    for block in blocks("toml") {
        let Some(asked) = manifest(&block.text).remove("dependencies") else {
            continue;
        };
        for (name, value) in asked.as_table().unwrap() {
            let expected = known.get(name).map(version);
            let asked = version(value);
            assert!(
                expected
                    .as_ref()
                    .is_some_and(|expected| expected.starts_with(&asked)),
                "{}: {name} {asked} instead of {expected:?}",
                block.place
            );
            count += 1;
        }
    }
    assert!(count > 0, "no dependency was found");
}
