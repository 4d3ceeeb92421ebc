use std::io;
use std::path::{Path, PathBuf};

use fam_io::Document;
use sha2::{Digest, Sha256};

use super::run::Run;
use crate::backend::Backend;
use crate::checkpoints::{Checkpoints, Label};
use crate::failure::Failure;

/// The content of an input, hashed.
pub struct Content(Sha256);

impl Content {
    /// That of a file.
    pub fn of(path: &Path) -> Result<Self, Failure> {
        let mut hasher = Sha256::new();
        std::fs::File::open(path)
            .and_then(|mut file| io::copy(&mut file, &mut hasher))
            .map_err(|error| Failure::input(format!("{}: {error}", path.display())))?;
        Ok(Self(hasher))
    }

    /// That of a document and the files that it refers to; of the built-in sample without a path. None
    /// if it cannot be read twice.
    pub fn of_document(path: Option<&Path>, document: &Document) -> Result<Option<Self>, Failure> {
        let mut content = match path {
            None => Self(Sha256::new()),
            Some(path) if path.is_file() => Self::of(path)?,
            Some(_) => return Ok(None),
        };
        content.add_companions(document)?;
        Ok(Some(content))
    }

    /// Adds the files that a document refers to.
    pub fn add_companions(&mut self, document: &Document) -> Result<(), Failure> {
        for companion in document.companions() {
            // One that is missing changes the results as well.
            if let Ok(mut file) = std::fs::File::open(&companion) {
                let fail = |error| Failure::input(format!("{}: {error}", companion.display()));
                io::copy(&mut file, &mut self.0).map_err(fail)?;
            }
        }
        Ok(())
    }

    /// SHA-256, in hexadecimal digits.
    pub fn hash(&self) -> String {
        format!("{:x}", self.0.clone().finalize())
    }
}

/// The checkpoint of a training, in the folder of its results.
pub fn checkpoint_file(folder: &Path) -> PathBuf {
    folder.join("checkpoint.safetensors")
}

impl Run {
    /// The checkpoints of a training with these options.
    pub fn checkpoints(
        &self,
        content: &Content,
        backend: &Backend,
        folder: &Path,
    ) -> Result<Checkpoints, Failure> {
        let arguments = &self.arguments;
        let training = serde_json::to_string(&self.config.training).map_err(Failure::work)?;
        let label = Label {
            input: content.hash(),
            options: format!(
                "{training} {:?} {:?} {} {:?} {}",
                arguments.squares(),
                arguments.weight,
                arguments.separate_duplicates,
                arguments.time_budget,
                backend.name(),
            ),
        };
        let file = checkpoint_file(folder);
        let writing = self.writing.clone();
        Ok(Checkpoints::new(
            file,
            label,
            arguments.checkpoint_every,
            writing,
        ))
    }

    /// A hash that changes with the content of an input and with all that shapes its results.
    pub fn fingerprint(&self, content: &Content) -> Result<String, Failure> {
        let mut hasher = content.0.clone();
        let arguments = &self.arguments;
        let shaping = format!(
            "{}\n{}\n{:?} {} {} {} {} {} {} {:?} {:?}\n{:?} {} {:?} {:?} {:?}",
            env!("CARGO_PKG_VERSION"),
            serde_json::to_string(&self.config).map_err(Failure::work)?,
            arguments.format,
            arguments.uv_set,
            arguments.checker,
            arguments.seam_lines,
            arguments.per_material,
            arguments.per_object,
            arguments.separate_duplicates,
            arguments.seam_rule,
            arguments.time_budget,
            arguments.weight,
            arguments.improve,
            arguments.only,
            arguments.selected,
            arguments.paint,
        );
        hasher.update(shaping.as_bytes());
        self.marks.write_to(&mut hasher).map_err(Failure::work)?;
        Ok(format!("{:x}", hasher.finalize()))
    }
}
