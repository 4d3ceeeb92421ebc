//! The threads that jobs share.

use std::sync::{Arc, Mutex, PoisonError};

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::failure::Failure;

/// The pool and the process that made it.
static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// The pool of this process. A process that was forked has none of its parent's threads, so it
/// makes a pool of its own.
pub fn pool() -> Result<Arc<ThreadPool>, Failure> {
    let mut kept = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    let process = std::process::id();
    match &*kept {
        Some((maker, pool)) if *maker == process => Ok(Arc::clone(pool)),
        _ => {
            let new = ThreadPoolBuilder::new()
                .thread_name(|number| format!("flatten-anything-{number}"))
                .build()
                .map_err(|error| Failure::Internal(format!("cannot start threads: {error}")))?;
            let new = Arc::new(new);
            // To drop the parent's pool would wait for its threads.
            std::mem::forget(kept.replace((process, Arc::clone(&new))));
            Ok(new)
        }
    }
}
