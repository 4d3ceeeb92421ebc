//! Files that are replaced as a whole or not at all.
//!
//! The content goes to a temporary file in the folder of the target, is flushed and synced
//! to the disk, and is then renamed over the target. If anything fails on the way, the
//! target is untouched and the temporary file is removed. The new file has the permissions
//! of the one it replaces.

use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use crate::error::{WriteError, WriteFault};

/// Begins the names of temporary files.
const PREFIX: &str = ".fam-";

/// Replaces the file at `path` by what `content` writes.
///
/// # Errors
/// `content` fails, or the folder cannot be written to.
pub fn write_atomically(
    path: impl AsRef<Path>,
    content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), WriteError> {
    let path = path.as_ref();
    replace(path, content).map_err(|error| WriteFault::from(error).at(path))
}

/// Removes the temporary files in a folder that a process left when it was killed. Nothing else may be
/// writing there.
///
/// # Errors
/// The folder cannot be read, or a file not be removed.
pub fn remove_leftovers(folder: &Path) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        if entry.file_name().to_string_lossy().starts_with(PREFIX) {
            fs::remove_file(entry.path())?;
        }
    }
    Ok(())
}

fn replace(path: &Path, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    if !folder.is_dir() {
        let problem = format!("there is no folder {}", folder.display());
        return Err(io::Error::new(io::ErrorKind::NotFound, problem));
    }
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX);
    // Temporary files are private by default; a result is as readable as any new file.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut temporary = builder.tempfile_in(folder)?;
    let mut writer = BufWriter::new(temporary.as_file_mut());
    content(&mut writer)?;
    writer.flush()?;
    drop(writer);
    if let Ok(replaced) = fs::metadata(path) {
        temporary
            .as_file()
            .set_permissions(replaced.permissions())?;
    }
    temporary.as_file().sync_all()?;
    temporary.persist(path).map_err(|failed| failed.error)?;
    Ok(())
}

/// Replaces the file at `path` as a whole or not at all, and keeps what the fault of `content`
/// is.
pub(crate) fn write_file(
    path: &Path,
    content: impl FnOnce(&mut dyn Write) -> Result<(), WriteFault>,
) -> Result<(), WriteError> {
    let mut fault = None;
    write_atomically(path, |out| match content(out) {
        Ok(()) => Ok(()),
        Err(WriteFault::Io(error)) => Err(error),
        Err(other) => {
            let error = io::Error::other(other.to_string());
            fault = Some(other);
            Err(error)
        }
    })
    .map_err(|error| fault.map_or(error, |fault| fault.at(path)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> = fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn replaces_the_whole_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        for text in ["a long first version", "second"] {
            write_atomically(&path, |out| out.write_all(text.as_bytes())).unwrap();
            assert_eq!(fs::read_to_string(&path).unwrap(), text);
        }
        assert_eq!(names(folder.path()), ["a.txt"]);
    }

    #[test]
    fn a_failure_keeps_the_old_file_and_leaves_nothing_behind() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        fs::write(&path, "old").unwrap();
        let error = write_atomically(&path, |out| {
            out.write_all(&[b'x'; 100_000])?;
            Err(io::Error::other("the disk is full"))
        })
        .unwrap_err();
        assert!(
            error.to_string().ends_with("a.txt: the disk is full"),
            "{error}"
        );
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(names(folder.path()), ["a.txt"]);
    }

    #[test]
    fn a_missing_folder_and_a_folder_as_target_are_errors() {
        let folder = tempfile::tempdir().unwrap();
        let missing = folder.path().join("no/such/a.txt");
        assert!(write_atomically(missing, |_| Ok(())).is_err());
        let inside = folder.path().join("inside");
        fs::create_dir(&inside).unwrap();
        assert!(write_atomically(&inside, |_| Ok(())).is_err());
        assert_eq!(names(folder.path()), ["inside"]);
    }

    #[cfg(unix)]
    #[test]
    fn permissions_are_those_of_any_new_file_or_of_the_replaced_one() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
        let plain = folder.path().join("plain.txt");
        fs::write(&plain, "").unwrap();
        let new = folder.path().join("new.txt");
        write_atomically(&new, |_| Ok(())).unwrap();
        assert_eq!(mode(&new), mode(&plain));
        fs::set_permissions(&new, fs::Permissions::from_mode(0o640)).unwrap();
        write_atomically(&new, |_| Ok(())).unwrap();
        assert_eq!(mode(&new), 0o640);
    }

    #[test]
    fn only_temporary_files_are_left_over() {
        let folder = tempfile::tempdir().unwrap();
        for name in [".fam-x1", "kept.obj", ".kept"] {
            fs::write(folder.path().join(name), "text").unwrap();
        }
        remove_leftovers(folder.path()).unwrap();
        assert_eq!(names(folder.path()), [".kept", "kept.obj"]);
    }
}
