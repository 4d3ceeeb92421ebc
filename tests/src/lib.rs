//! End-to-end tests of the `fam` binary; see the `tests` folder.
