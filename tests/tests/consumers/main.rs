//! Other programs read what is written: the Khronos glTF validator, three.js in headless
//! Chromium, trimesh and meshio.
//!
//! `tests/consumers/install` installs them into `target/consumers`, or into the folder that
//! `FAM_CONSUMERS` names. Where one is missing, the tests that need it are skipped, or fail if
//! `FAM_REQUIRE_CONSUMERS` is set.

#[path = "../common/mod.rs"]
mod common;
mod end_to_end;
mod gltf;
mod installed;
mod meshes;
mod pictures;
mod surfaces;
mod validity;
