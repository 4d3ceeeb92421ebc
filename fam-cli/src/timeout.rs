//! The end of a single file's time.

use std::time::Duration;

use crate::terminal::print_line;

/// Ends the program with exit code 1 and one line once the time is over, if there is a limit.
pub fn end_after(limit: Option<Duration>, input: String) {
    let Some(limit) = limit else {
        return;
    };
    std::thread::spawn(move || {
        std::thread::sleep(limit);
        print_line(&format!("fam: {}", not_done(&input, limit)));
        std::process::exit(1);
    });
}

/// What is said of a file whose time is over.
pub fn not_done(input: &str, limit: Duration) -> String {
    let seconds = limit.as_secs_f64();
    format!("{input}: not done within {seconds} s (--timeout)")
}
