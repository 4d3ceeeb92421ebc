//! Which files may be worked on at the same time within the memory of the machine.

use sysinfo::{MemoryRefreshKind, Pid, ProcessRefreshKind, ProcessesToUpdate, System};

/// Bytes that a worker takes for any file: 123 MiB were measured for a single triangle.
const BASE: u64 = 128 << 20;

/// Bytes that it takes for each byte of the file. A layout takes about 1,500 bytes per triangle; a
/// triangle takes about 20 bytes in a binary file and 80 in a text file. So this is a middle, and
/// workers are stopped where it is too low.
const PER_BYTE: u64 = 40;

/// Fraction of the memory that is left free, for what grows between two looks at it.
const RESERVE: f64 = 0.05;

/// Bytes that a file of a size is expected to take.
pub fn need(size: u64) -> u64 {
    BASE.saturating_add(size.saturating_mul(PER_BYTE))
}

/// The memory at a moment, in bytes.
#[derive(Debug, Clone, Copy)]
pub struct Memory {
    /// Of the machine or of the container.
    pub total: u64,
    /// Of it, what is available.
    pub available: u64,
}

/// What a worker takes, in bytes.
#[derive(Debug, Clone, Copy)]
pub struct Share {
    /// What it is expected to take.
    pub need: u64,
    /// What it takes now.
    pub used: u64,
}

impl Memory {
    /// Whether a file finds room beside the workers that run.
    pub fn has_room(&self, need: u64, running: &[Share]) -> bool {
        let promised = running.iter().map(|r| r.need.saturating_sub(r.used));
        let taken = promised.fold(need.saturating_add(self.reserve()), u64::saturating_add);
        taken <= self.available
    }

    /// Whether less than the reserve is left.
    pub fn is_short(&self) -> bool {
        self.available < self.reserve()
    }

    /// The memory under a limit, of which so many bytes are used.
    fn within(self, limit: u64, used: u64) -> Self {
        Self {
            total: self.total.min(limit),
            available: self.available.min(limit.saturating_sub(used)),
        }
    }

    fn reserve(&self) -> u64 {
        (self.total as f64 * RESERVE) as u64
    }
}

/// Looks at the memory.
pub struct Gauge {
    system: System,
    /// Bytes that all workers together may take, where a job has a limit.
    limit: Option<u64>,
}

impl Gauge {
    pub fn new() -> Self {
        Self {
            system: System::new(),
            limit: slurm_limit(|name| std::env::var(name).ok()),
        }
    }

    /// The memory now, of which this process and its workers use so many bytes. Pages that only hold files count as
    /// available.
    pub fn memory(&mut self, used: u64) -> Memory {
        let ram = MemoryRefreshKind::nothing().with_ram();
        self.system.refresh_memory_specifics(ram);
        let machine = Memory {
            total: self.system.total_memory(),
            available: self.system.available_memory(),
        };
        let machine = match self.system.cgroup_limits() {
            Some(limits) if limits.total_memory < machine.total => {
                machine.within(limits.total_memory, limits.rss)
            }
            _ => machine,
        };
        match self.limit {
            Some(limit) => machine.within(limit, used),
            None => machine,
        }
    }

    /// Bytes that processes take now.
    pub fn used(&mut self, processes: &[u32]) -> Vec<u64> {
        let pids: Vec<Pid> = processes.iter().map(|pid| Pid::from_u32(*pid)).collect();
        self.system.refresh_processes_specifics(
            ProcessesToUpdate::Some(&pids),
            true,
            ProcessRefreshKind::nothing().with_memory(),
        );
        let used = |pid: &Pid| self.system.process(*pid).map_or(0, |p| p.memory());
        pids.iter().map(used).collect()
    }
}

/// Bytes that Slurm gives to a job on this node, from the variables that it sets. Its limit need not
/// be where containers have theirs.
fn slurm_limit(variable: impl Fn(&str) -> Option<String>) -> Option<u64> {
    let number = |name: &str| variable(name)?.parse::<u64>().ok();
    let per_cpu = || number("SLURM_MEM_PER_CPU")?.checked_mul(number("SLURM_CPUS_ON_NODE")?);
    let mebibytes = number("SLURM_MEM_PER_NODE").or_else(per_cpu)?;
    // 0 stands for the whole node.
    (mebibytes > 0).then(|| mebibytes.saturating_mul(1 << 20))
}

#[cfg(test)]
mod tests {
    use super::*;

    const GIB: u64 = 1 << 30;

    #[test]
    fn a_file_waits_for_what_others_will_still_take() {
        let memory = Memory {
            total: 10 * GIB,
            available: 6 * GIB,
        };
        let young = Share {
            need: 4 * GIB,
            used: GIB,
        };
        assert!(memory.has_room(5 * GIB, &[]));
        assert!(!memory.has_room(6 * GIB, &[]));
        assert!(memory.has_room(2 * GIB, &[young]));
        assert!(!memory.has_room(3 * GIB, &[young]));
        // One that takes more than expected has it already.
        let large = Share {
            need: GIB,
            used: 3 * GIB,
        };
        assert!(memory.has_room(5 * GIB, &[large]));
        assert!(!memory.has_room(u64::MAX, &[young]));
        assert!(need(u64::MAX) == u64::MAX);
    }

    #[test]
    fn the_limit_of_a_slurm_job_is_seen() {
        let limit = |variables: &[(&str, &str)]| {
            slurm_limit(|name| {
                let found = variables.iter().find(|(known, _)| *known == name);
                found.map(|(_, value)| (*value).to_owned())
            })
        };
        assert_eq!(limit(&[]), None);
        assert_eq!(limit(&[("SLURM_MEM_PER_NODE", "2048")]), Some(2 * GIB));
        assert_eq!(limit(&[("SLURM_MEM_PER_NODE", "0")]), None);
        let per_cpu = [("SLURM_MEM_PER_CPU", "512"), ("SLURM_CPUS_ON_NODE", "4")];
        assert_eq!(limit(&per_cpu), Some(2 * GIB));
        let node = Memory {
            total: 100 * GIB,
            available: 50 * GIB,
        };
        let job = node.within(2 * GIB, GIB);
        assert!(!job.has_room(GIB, &[]) && job.has_room(GIB / 2, &[]));
        assert!(node.within(2 * GIB, 2 * GIB).is_short());
    }

    #[test]
    fn memory_is_short_below_the_reserve() {
        let memory = |available| Memory {
            total: 100 * GIB,
            available,
        };
        assert!(memory(4 * GIB).is_short());
        assert!(!memory(6 * GIB).is_short());
    }

    #[test]
    fn the_gauge_sees_this_process() {
        let mut gauge = Gauge::new();
        let memory = gauge.memory(0);
        assert!(
            memory.total > 0 && memory.available <= memory.total,
            "{memory:?}"
        );
        assert!(gauge.used(&[std::process::id()])[0] > 1 << 20);
    }
}
