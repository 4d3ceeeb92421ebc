//! What figures were measured on.

use std::process::Command;

/// The processor, as far as the system tells, and how many threads it is used with.
pub fn description() -> String {
    let threads = std::thread::available_parallelism().map_or(1, |count| count.get());
    let system = format!("{} {}", std::env::consts::OS, std::env::consts::ARCH);
    let plural = if threads == 1 { "" } else { "s" };
    match processor() {
        Some(processor) => format!("{processor}, {threads} thread{plural}, {system}"),
        None => format!("{threads} thread{plural}, {system}"),
    }
}

/// The first processor that Linux lists.
fn processor() -> Option<String> {
    let list = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let name = list.lines().find(|line| line.starts_with("model name"))?;
    Some(name.split_once(':')?.1.trim().to_string())
}

/// The commit of the sources that the program was built from, if they are still at hand; with a plus
/// sign if they have changes since.
pub fn commit() -> Option<String> {
    let git = |arguments: &[&str]| {
        let output = Command::new("git")
            .arg("-C")
            .arg(env!("CARGO_MANIFEST_DIR"))
            .args(arguments)
            .output()
            .ok()?;
        let text = String::from_utf8(output.stdout).ok()?;
        output.status.success().then(|| text.trim().to_string())
    };
    let commit = git(&["rev-parse", "--short=10", "HEAD"])?;
    // Documents change no figure.
    let changed = git(&["status", "--porcelain", "--", ":/*.rs", ":/*Cargo.*"])?;
    Some(match changed.is_empty() {
        true => commit,
        false => format!("{commit}+"),
    })
}
