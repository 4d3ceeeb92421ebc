//! Which format a file is in: by its content, and by its extension where that leaves it open.

use std::path::Path;

use crate::{Format, ReadFault};

/// The format of a file.
///
/// # Errors
/// The file cannot be opened, or its format is not one that is read.
pub fn format_of(path: &Path) -> Result<Format, ReadFault> {
    Format::of_path(path).ok_or_else(|| {
        ReadFault::UnknownFormat(match path.extension() {
            Some(extension) => format!("`.{}`", extension.display()),
            None => "a file without an extension".to_owned(),
        })
    })
}
