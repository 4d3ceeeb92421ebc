//! The backend-swap benchmark.

mod measure;
mod timed;

use std::process::{Command, Stdio};

use clap::ValueEnum;
use fam_core::training::OptimizerKind;
use serde_json::{Value, json};

use crate::args::{self, BackendName, name_of};
use crate::backend::Backend;
use crate::config::Config;
use crate::failure::{Failure, SUCCESS};
use crate::machine;
use measure::{Measure, Measurement};

/// Measures training steps on every backend that was asked for.
pub fn bench(arguments: &args::Bench) -> Result<u8, Failure> {
    let asked = match arguments.backends.as_slice() {
        [] => available(),
        some => some.to_vec(),
    };
    let (measurements, failed) = match asked.as_slice() {
        [one] => (vec![here(arguments, *one)?], None),
        several => apart(arguments, several)?,
    };
    if arguments.json {
        let all = json!({ "machine": machine::description(), "backends": measurements });
        let text = serde_json::to_string_pretty(&all).map_err(Failure::work)?;
        println!("{text}");
    } else {
        print(&measurements);
    }
    match failed {
        Some(failure) => Err(failure),
        None => Ok(SUCCESS),
    }
}

fn available() -> Vec<BackendName> {
    let names = BackendName::value_variants().iter().copied();
    names
        .filter(|name| *name != BackendName::Auto && Backend::choose(*name).is_ok())
        .collect()
}

/// In this process, whose peak memory is then that of the backend.
fn here(arguments: &args::Bench, name: BackendName) -> Result<Measurement, Failure> {
    let backend = Backend::choose(name)?;
    let mut config = Config::of(arguments.preset).training;
    // SOAP makes so much of rounding that the losses of backends could not be compared.
    config.optimizer = OptimizerKind::AdamW;
    // Steps of the opening are smaller.
    (config.opening, config.starts) = (0.0, 1);
    if let Some(jacobian) = arguments.jacobian {
        config.jacobian = jacobian.into();
    }
    let measure = Measure {
        backend: backend.to_string(),
        config: &config,
        steps: arguments.steps,
    };
    backend.run(measure).map_err(Failure::work)
}

/// Each in a process of its own; if one fails, that failure comes beside what the others did.
fn apart(
    arguments: &args::Bench,
    backends: &[BackendName],
) -> Result<(Vec<Measurement>, Option<Failure>), Failure> {
    let program = std::env::current_exe().map_err(Failure::work)?;
    let (mut measurements, mut failed) = (Vec::new(), None);
    for name in backends {
        let name = name_of(*name);
        let mut command = Command::new(&program);
        command
            .args(["bench", "--json", "--backends", &name])
            .args(["--preset", &name_of(arguments.preset)])
            .args(["--steps", &arguments.steps.to_string()])
            .stderr(Stdio::inherit());
        if let Some(jacobian) = arguments.jacobian {
            command.args(["--jacobian", &name_of(jacobian)]);
        }
        let output = command.output().map_err(Failure::work)?;
        if output.status.success() {
            let mut all: Value = serde_json::from_slice(&output.stdout).map_err(Failure::work)?;
            let one = serde_json::from_value(all["backends"][0].take());
            measurements.push(one.map_err(Failure::work)?);
        } else {
            failed = Some(Failure::work(format!("the backend {name} failed")));
        }
    }
    Ok((measurements, failed))
}

fn print(measurements: &[Measurement]) {
    let titles = [
        "backend",
        "step",
        "forward",
        "Jacobian",
        "neighbours",
        "losses",
        "backward",
        "optimizer",
        "points/s",
        "GFLOP/s",
        "product",
        "memory",
        "loss",
    ];
    let mut rows = vec![titles.map(String::from).to_vec()];
    for m in measurements {
        let s = &m.seconds;
        let parts = [
            s.step,
            s.forward,
            s.jacobian,
            s.neighbors,
            s.losses,
            s.backward,
            s.optimizer,
        ];
        let memory = m
            .peak_memory_mib
            .map_or("?".into(), |mib| format!("{mib:.0} MiB"));
        let mut row = vec![m.backend.clone()];
        row.extend(parts.map(|seconds| format!("{:.1} ms", seconds * 1e3)));
        row.extend([
            format!("{:.0}", m.points_per_second),
            format!("{:.1}", m.gflops),
            format!("{:.1}", m.product_gflops),
            memory,
            format!("{:.5}", m.loss),
        ]);
        rows.push(row);
    }
    let widths: Vec<usize> = (0..titles.len())
        .map(|c| {
            rows.iter()
                .map(|row| row[c].chars().count())
                .max()
                .unwrap_or(0)
        })
        .collect();
    for row in rows {
        let cells = row
            .iter()
            .zip(&widths)
            .enumerate()
            .map(|(c, (cell, &width))| match c {
                0 => format!("{cell:<width$}"),
                _ => format!("{cell:>width$}"),
            });
        println!("{}", cells.collect::<Vec<_>>().join("  "));
    }
    println!("{}", machine::description());
}
