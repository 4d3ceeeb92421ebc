//! What figures were measured on.

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
