//! The seeds of the fuzzers, what the fuzzers have found, and a short run of random damage.

#[path = "common/check.rs"]
mod check;
#[path = "common/random.rs"]
mod random;

use std::fs;
use std::path::Path;

use check::check;
use fam_io::Format;
use random::Random;

/// What is put into files: numbers at the limits of types, and what separates words.
const TOKENS: [&[u8]; 14] = [
    b"-1",
    b"0",
    b"4294967296",
    b"-9223372036854775808",
    b"18446744073709551615",
    b"nan",
    b"1e999",
    b"/",
    b"\\\n",
    b"\r",
    b"#",
    b" ",
    b"\xff",
    b"list uint double",
];

/// The files of a folder, in the order of their names.
fn files(folder: impl AsRef<Path>) -> Vec<(Format, Vec<u8>)> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let entries = fs::read_dir(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let mut paths: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let with_format = paths
        .iter()
        .filter_map(|path| Some((Format::of_path(path)?, path)));
    with_format
        .map(|(format, path)| (format, fs::read(path).unwrap()))
        .collect()
}

fn seeds() -> Vec<(Format, Vec<u8>)> {
    let folders = Format::ALL.map(|format| format!("../fuzz/corpus/{}", format.extension()));
    folders.iter().flat_map(files).collect()
}

#[test]
fn what_the_fuzzers_found_is_mended() {
    let found = files("tests/regressions");
    assert!(!found.is_empty());
    for (format, bytes) in found {
        check(format, &bytes);
    }
}

#[test]
fn seeds_are_read() {
    let seeds = seeds();
    for format in Format::ALL {
        let of_format = seeds.iter().filter(|(of, _)| *of == format);
        let read = of_format.filter(|(_, bytes)| check(format, bytes)).count();
        assert!(read >= 3, "only {read} seeds of {format} are read");
    }
}

#[test]
fn damaged_seeds_never_panic() {
    let mut random = Random::new(2);
    let mut read = 0;
    for (format, seed) in seeds() {
        for _ in 0..400 {
            let mut bytes = seed.clone();
            for _ in 0..=random.below(3) {
                damage(&mut bytes, &mut random);
            }
            read += usize::from(check(format, &bytes));
        }
    }
    assert!(read > 4000, "only {read} damaged seeds were still readable");
}

fn damage(bytes: &mut Vec<u8>, random: &mut Random) {
    let at = random.below(bytes.len() + 1);
    let token = TOKENS[random.below(TOKENS.len())].iter().copied();
    match random.below(5) {
        0 => drop(bytes.splice(at..at, token)),
        1 => {
            let end = (at + random.below(9)).min(bytes.len());
            bytes.splice(at..end, token);
        }
        2 => bytes.truncate(at),
        change => {
            if let Some(byte) = bytes.get_mut(at) {
                *byte = match change {
                    3 => random.below(256) as u8,
                    _ => *byte ^ 1 << random.below(8),
                };
            }
        }
    }
}
