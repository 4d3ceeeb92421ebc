use std::hash::Hasher;
use std::path::Path;

use fam_io::Document;

use super::run::Run;
use crate::failure::Failure;

impl Run {
    /// A number that changes with the content of a file and with all that shapes its results.
    pub fn fingerprint(&self, path: &Path, document: &Document) -> Result<String, Failure> {
        let fail = |error: std::io::Error| Failure::input(format!("{}: {error}", path.display()));
        let mut hasher = Hashing::default();
        let mut file = std::fs::File::open(path).map_err(fail)?;
        std::io::copy(&mut file, &mut hasher).map_err(fail)?;
        for companion in document.companions() {
            // One that is missing changes the results as well.
            if let Ok(mut file) = std::fs::File::open(companion) {
                std::io::copy(&mut file, &mut hasher).map_err(fail)?;
            }
        }
        let arguments = &self.arguments;
        let shaping = format!(
            "{}\n{}\n{:?} {} {} {} {} {} {:?} {:?}",
            env!("CARGO_PKG_VERSION"),
            serde_json::to_string(&self.config).map_err(Failure::work)?,
            arguments.format,
            arguments.uv_set,
            arguments.checker,
            arguments.seam_lines,
            arguments.per_material,
            arguments.separate_duplicates,
            arguments.seam_rule,
            arguments.time_budget,
        );
        hasher.0.write(shaping.as_bytes());
        self.marks.write_to(&mut hasher).map_err(fail)?;
        Ok(format!("{:016x}", hasher.0.finish()))
    }
}

/// Hashes what is written.
#[derive(Default)]
struct Hashing(std::hash::DefaultHasher);

impl std::io::Write for Hashing {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.write(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}
