//! What URIs stand for: data in the URI itself, or a file beside the document.

use std::borrow::Cow;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use percent_encoding::{percent_decode, percent_decode_str};

/// Where the bytes of a URI are.
pub(super) enum Place<'a> {
    /// In the URI, after `data:`.
    Data(&'a str),
    /// In a file; relative to the document.
    Relative(PathBuf),
    /// Somewhere that is never read: an absolute path, a URL.
    Elsewhere,
}

impl<'a> Place<'a> {
    pub fn of(uri: &'a str) -> Self {
        if let Some((scheme, rest)) = uri.split_once(':') {
            if scheme.eq_ignore_ascii_case("data") {
                return Self::Data(rest);
            }
            let in_scheme = |b: u8| b.is_ascii_alphanumeric() || b"+-.".contains(&b);
            if scheme.starts_with(|c: char| c.is_ascii_alphabetic())
                && scheme.bytes().all(in_scheme)
            {
                return Self::Elsewhere;
            }
        }
        match percent_decode_str(uri).decode_utf8() {
            Ok(path) if !path.is_empty() && !path.starts_with(['/', '\\']) => {
                Self::Relative(PathBuf::from(path.as_ref()))
            }
            _ => Self::Elsewhere,
        }
    }
}

/// The bytes of a data URI, given what follows `data:`; `None` if they are not encoded right.
pub(super) fn decode(data: &str) -> Option<Vec<u8>> {
    const BASE64: GeneralPurpose = GeneralPurpose::new(
        &STANDARD,
        GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
    );
    let (media_type, data) = data.split_once(',')?;
    let bytes: Cow<[u8]> = percent_decode(data.as_bytes()).into();
    if media_type.ends_with(";base64") {
        BASE64.decode(bytes).ok()
    } else {
        Some(bytes.into_owned())
    }
}

/// Up to `limit` bytes of a file; of nothing but a file, since a device may have no end.
pub(super) fn read(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    let file = File::open(path)?;
    if !file.metadata()?.is_file() {
        return Err(io::Error::other("not a file"));
    }
    let mut bytes = Vec::new();
    file.take(limit).read_to_end(&mut bytes)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn data_is_decoded() {
        assert_eq!(
            decode("application/octet-stream;base64,AQID").unwrap(),
            [1, 2, 3]
        );
        assert_eq!(decode(";base64,AQ").unwrap(), [1]);
        assert_eq!(decode(";base64,AQ%3D%3D").unwrap(), [1]);
        assert_eq!(decode(",a%20b").unwrap(), b"a b");
        assert_eq!(decode(";base64,A*"), None);
        assert_eq!(decode("AQID"), None);
    }

    #[test]
    fn only_relative_paths_are_files() {
        let path = |uri| match Place::of(uri) {
            Place::Relative(path) => path.to_str().map(str::to_owned),
            _ => None,
        };
        assert_eq!(path("../a%20b.bin").as_deref(), Some("../a b.bin"));
        assert_eq!(path("f/a:b.bin").as_deref(), Some("f/a:b.bin"));
        for uri in [
            "",
            "/a",
            "\\a",
            "%2Fa",
            "%ff",
            "http://a/b",
            "file:a",
            "C:a",
            "DATA:,x",
        ] {
            assert_eq!(path(uri), None, "{uri}");
        }
        assert!(matches!(Place::of("DATA:,x"), Place::Data(",x")));
    }

    #[test]
    fn folders_are_not_read() {
        let folder = tempfile::tempdir().unwrap();
        assert!(read(folder.path(), 10).is_err());
        let path = folder.path().join("a");
        std::fs::write(&path, "abc").unwrap();
        assert_eq!(read(&path, 2).unwrap(), b"ab");
    }
}
