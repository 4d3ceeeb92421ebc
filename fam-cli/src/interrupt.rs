//! Ctrl-C.

use std::io::IsTerminal;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::failure::Failure;

/// Exit code after Ctrl-C: 128 and the number of the signal, as shells count.
pub const INTERRUPTED: u8 = 130;

/// What the user is told after the first Ctrl-C.
pub const STOPPING: &str = "stopping: what is done so far gets written; Ctrl-C again ends at once";

/// A flag that Ctrl-C sets, with a word to the user unless `quiet`; a second Ctrl-C ends the
/// program at once.
pub fn stop_on_interrupt(quiet: bool) -> Result<Arc<AtomicBool>, Failure> {
    let stop = Arc::new(AtomicBool::new(false));
    let flag = stop.clone();
    ctrlc::set_handler(move || {
        if flag.swap(true, Ordering::Relaxed) {
            std::process::exit(i32::from(INTERRUPTED));
        }
        if !quiet {
            // A bar may have left its line open.
            let open = if std::io::stderr().is_terminal() {
                "\n"
            } else {
                ""
            };
            eprintln!("{open}{STOPPING}");
        }
    })
    .map_err(Failure::work)?;
    Ok(stop)
}
