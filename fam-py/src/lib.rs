//! The native part of the Python package `flatten_anything`.
//!
//! Users see the Python modules in `python/flatten_anything`: these check arrays, make them contiguous
//! and call this module. Long computations are jobs: each runs on a thread of its own, on a pool of
//! threads of its process, while Python goes on.

mod arrays;
mod asked;
mod backend;
mod failure;
mod files;
mod job;
mod map;
mod measure;
mod mesh;
mod pack;
mod points;
mod pool;
mod program;
mod settings;
mod unwrapped;

use pyo3::prelude::*;

/// Large temporaries come and go in every training step; this allocator keeps their pages.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

#[pymodule]
mod _native {
    #[pymodule_export]
    use super::files::{File, IndexedUvs, read};
    #[pymodule_export]
    use super::job::Job;
    #[pymodule_export]
    use super::map::{Map, load, train};
    #[pymodule_export]
    use super::measure::measure;
    #[pymodule_export]
    use super::mesh::{unwrap, unwrap_file};
    #[pymodule_export]
    use super::pack::pack;
    #[pymodule_export]
    use super::points::unwrap_points;
    #[pymodule_export]
    use super::program::run_program;

    use pyo3::prelude::*;

    /// The version of the package.
    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
