//! End-to-end tests of the `fam` binary, in the `tests` folder, and the Rust code of the documents as
//! tests.

#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
struct Readme;

#[cfg(doctest)]
#[doc = include_str!("../../docs/embedding.md")]
struct Embedding;

/// A page that is not included above would not be tested.
#[test]
fn every_page_with_rust_code_is_tested() {
    let docs = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs");
    for entry in std::fs::read_dir(docs).unwrap() {
        let path = entry.unwrap().path();
        let Some(name) = path.file_name().and_then(|name| name.to_str()) else {
            continue;
        };
        if name.ends_with(".md")
            && std::fs::read_to_string(&path)
                .unwrap()
                .contains("\n```rust")
        {
            let included = format!("include_str!(\"../../docs/{name}\")");
            assert!(include_str!("lib.rs").contains(&included), "{name}");
        }
    }
}
