//! Which format a file is in: by its content, and by its extension where that leaves it open.
//!
//! Only the beginning of the file is looked at, and its length. These decide, whatever the
//! extension: the magic of GLB, the first line of PLY, a JSON object (glTF), exactly the size
//! of a binary STL file, `solid` with facets, a keyword of OFF, a vertex, face or material
//! statement of OBJ. Common formats that are not read are named as such, and so is text in
//! UTF-16.
//!
//! Otherwise it is the format of the extension. Rows of numbers are XYZ under any extension
//! that is not one of a known format.

use std::fs::File;
use std::io::Read;
use std::ops::Range;
use std::path::Path;

use crate::error::ReadFault;
use crate::format::Format;
use crate::text::{self, is_blank, lines, words};
use crate::{content, stl};

/// How much of a file is looked at.
pub(crate) const LOOKED_AT: u64 = 1 << 16;

/// Formats that are not read, with their extensions.
const UNSUPPORTED: [(&str, &[&str]); 11] = [
    ("3DS", &["3ds"]),
    ("3MF", &["3mf"]),
    ("Blender", &["blend"]),
    ("COLLADA", &["dae"]),
    ("Draco", &["drc"]),
    ("FBX", &["fbx"]),
    ("STEP", &["step", "stp"]),
    ("USD", &["usd", "usda", "usdc", "usdz"]),
    ("VRML", &["wrl"]),
    ("X3D", &["x3d"]),
    ("ZIP", &["zip"]),
];

/// What the content of a file says about its format.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Content {
    Known(Format),
    Unsupported(&'static str),
    /// Text in UTF-16, and whether it would be read if it were in UTF-8.
    Utf16 {
        is_surface: bool,
    },
    /// Rows of numbers.
    Rows,
    Undecided,
}

/// The format of a file.
///
/// # Errors
/// The file cannot be opened, or its format is not one that is read.
pub fn format_of(path: &Path) -> Result<Format, ReadFault> {
    open(path).map(|opened| opened.format)
}

/// The format of a file, and its content; in memory if it can be read only once, as that of a
/// pipe.
pub(crate) fn open_known(path: &Path) -> Result<(Format, content::Content), ReadFault> {
    let mut opened = open(path)?;
    let content = if opened.is_file {
        content::Content::File(path.to_owned())
    } else {
        opened.file.read_to_end(&mut opened.start)?;
        content::Content::Bytes(opened.start)
    };
    Ok((opened.format, content))
}

/// Refuses a text in UTF-16.
pub(crate) fn check_encoding(bytes: &[u8]) -> Result<(), ReadFault> {
    let is_binary = stl::has_binary_size(bytes, bytes.len() as u64);
    let start = &bytes[..bytes.len().min(LOOKED_AT as usize)];
    if !is_binary && text::utf16(start).is_some() {
        return Err(ReadFault::Utf16);
    }
    Ok(())
}

/// A file that has been read as far as its format was looked for.
struct Opened {
    file: File,
    /// Whether it can be read again.
    is_file: bool,
    start: Vec<u8>,
    format: Format,
}

fn open(path: &Path) -> Result<Opened, ReadFault> {
    let mut file = File::open(path)?;
    let metadata = file.metadata()?;
    let mut start = Vec::new();
    file.by_ref().take(LOOKED_AT).read_to_end(&mut start)?;
    let length = match start.len() as u64 {
        _ if metadata.is_file() => metadata.len(),
        // There may be any number of bytes to come.
        LOOKED_AT => u64::MAX,
        length => length,
    };
    Ok(Opened {
        file,
        is_file: metadata.is_file(),
        format: decide(path, content(&start, length))?,
        start,
    })
}

fn decide(path: &Path, content: Content) -> Result<Format, ReadFault> {
    let unsupported = |name: &str| Err(ReadFault::Unsupported(format!("{name} is")));
    match content {
        Content::Known(format) => return Ok(format),
        Content::Unsupported(name) => return unsupported(name),
        Content::Utf16 { is_surface } if is_surface || Format::of_path(path).is_some() => {
            return Err(ReadFault::Utf16);
        }
        Content::Utf16 { .. } | Content::Rows | Content::Undecided => {}
    }
    if let Some(format) = Format::of_path(path) {
        return Ok(format);
    }
    let extension = path
        .extension()
        .map(|extension| extension.to_string_lossy());
    if let Some(extension) = &extension {
        let named =
            |(_, all): &(&str, &[&str])| all.iter().any(|e| extension.eq_ignore_ascii_case(e));
        if let Some((name, _)) = UNSUPPORTED.iter().copied().find(named) {
            return unsupported(name);
        }
    }
    if content == Content::Rows {
        return Ok(Format::Xyz);
    }
    Err(ReadFault::UnknownFormat(match extension {
        Some(extension) => format!("`.{}`", text::excerpt(extension.as_bytes())),
        None => "a file without an extension".to_owned(),
    }))
}

/// What the content of a file of so many bytes that starts with these says.
fn content(start: &[u8], length: u64) -> Content {
    if start.starts_with(b"glTF") {
        return Content::Known(Format::Glb);
    }
    if matches!(without_bom(start), [b'p', b'l', b'y', end, ..] if end.is_ascii_whitespace()) {
        return Content::Known(Format::Ply);
    }
    if let Some(name) = unsupported(start, length) {
        return Content::Unsupported(name);
    }
    if stl::has_binary_size(start, length) {
        return Content::Known(Format::Stl);
    }
    if let Some(text) = text::utf16(start) {
        let says = text_content(whole_lines(text.as_bytes()));
        let is_surface = matches!(says, Content::Known(_) | Content::Rows);
        return Content::Utf16 { is_surface };
    }
    if without_bom(start).trim_ascii_start().starts_with(b"{") {
        return Content::Known(Format::Gltf);
    }
    let is_cut_off = (start.len() as u64) < length;
    text_content(if is_cut_off {
        whole_lines(start)
    } else {
        start
    })
}

/// The name of a format that is not read, by its first bytes.
fn unsupported(start: &[u8], length: u64) -> Option<&'static str> {
    let magics: [(&[u8], &str); 8] = [
        (b"Kaydara FBX Binary", "FBX"),
        (b"; FBX", "FBX"),
        (b"BLENDER", "Blender"),
        (b"DRACO", "Draco"),
        (b"ISO-10303-21", "STEP"),
        (b"PXR-USDC", "USD"),
        (b"#usda", "USD"),
        (b"#VRML", "VRML"),
    ];
    if let Some((_, name)) = magics.iter().find(|(magic, _)| start.starts_with(magic)) {
        return Some(name);
    }
    match start {
        // The main chunk, as long as the file.
        [b'M', b'M', size @ ..] => {
            let size: [u8; 4] = size.get(..4)?.try_into().ok()?;
            (u64::from(u32::from_le_bytes(size)) == length).then_some("3DS")
        }
        [b'P', b'K', 3, 4, ..] => Some(archive(start)),
        _ => {
            let text = without_bom(start).trim_ascii_start();
            text.starts_with(b"<").then(|| xml(text))
        }
    }
}

/// A text without its byte order mark.
fn without_bom(text: &[u8]) -> &[u8] {
    text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text)
}

fn archive(start: &[u8]) -> &'static str {
    if holds(start, b"3D/") || holds(start, b"[Content_Types].xml") {
        "3MF"
    } else if holds(start, b".usd") {
        "USD"
    } else {
        "ZIP"
    }
}

fn xml(text: &[u8]) -> &'static str {
    if holds(text, b"<COLLADA") {
        "COLLADA"
    } else if holds(text, b"<X3D") {
        "X3D"
    } else {
        "XML"
    }
}

fn holds(bytes: &[u8], part: &[u8]) -> bool {
    bytes.windows(part.len()).any(|window| window == part)
}

/// A text without the last line, which may be cut off.
fn whole_lines(text: &[u8]) -> &[u8] {
    let end = text.iter().rposition(|b| matches!(b, b'\n' | b'\r'));
    &text[..end.map_or(0, |end| end + 1)]
}

fn text_content(text: &[u8]) -> Content {
    let rows: Vec<_> = rows(text).collect();
    let Some(first) = rows.first() else {
        return Content::Undecided;
    };
    let starts = |row: &Row, keyword| text[row[0].clone()].eq_ignore_ascii_case(keyword);
    if is_off_keyword(&text[first[0].clone()]) {
        return Content::Known(Format::Off);
    }
    if text.contains(&0) {
        return Content::Undecided;
    }
    let is_facet = |row| {
        [&b"facet"[..], b"end", b"endsolid"]
            .iter()
            .any(|word| starts(row, word))
    };
    if starts(first, b"solid") && rows.iter().any(is_facet) {
        return Content::Known(Format::Stl);
    }
    if is_obj(text, &rows) {
        return Content::Known(Format::Obj);
    }
    // Their number or the names of their columns may be before the points.
    let is_point = |row: &Row| row.len() >= 3 && numbers(text, row) >= 3;
    if rows.iter().take(2).any(is_point) {
        Content::Rows
    } else {
        Content::Undecided
    }
}

/// The words of a line.
type Row = Vec<Range<usize>>;

/// The lines that are not empty, without their comments.
fn rows(text: &[u8]) -> impl Iterator<Item = Row> {
    lines(text).filter_map(|line| {
        let is_separator = |b| is_blank(b) || matches!(b, b',' | b';');
        let mut row = words(text, line.text, is_separator);
        let is_comment = |word: &Range<usize>| {
            let word = &text[word.clone()];
            word.starts_with(b"#") || word.starts_with(b"//")
        };
        row.truncate(row.iter().position(is_comment).unwrap_or(row.len()));
        (!row.is_empty()).then_some(row)
    })
}

/// How many numbers a row starts with.
fn numbers(text: &[u8], row: &[Range<usize>]) -> usize {
    row.iter()
        .take_while(|word| text::number::<f64>(&text[(*word).clone()]).is_some())
        .count()
}

/// Whether a word is `OFF` with letters before it, known ones or not, and possibly with the
/// first count after it.
fn is_off_keyword(word: &[u8]) -> bool {
    let at = word.windows(3).position(|three| three == b"OFF");
    at.is_some_and(|at| {
        let letters = word[..at].iter().all(|letter| b"STCN4n".contains(letter));
        letters && word[at + 3..].iter().all(u8::is_ascii_digit)
    })
}

/// Whether the first statement that only OBJ has is one of OBJ.
fn is_obj(text: &[u8], rows: &[Row]) -> bool {
    for row in rows {
        let is_corner = |word: &Range<usize>| {
            let word = &text[word.clone()];
            matches!(word, [b'-' | b'0'..=b'9', ..])
        };
        match &text[row[0].clone()] {
            b"v" => return numbers(text, &row[1..]) >= 3,
            b"f" => return row.get(1).is_some_and(is_corner),
            b"mtllib" | b"usemtl" => return row.len() > 1,
            b"g" | b"l" | b"o" | b"p" | b"s" | b"vn" | b"vp" | b"vt" => {}
            _ => return false,
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decided(name: &str, bytes: &[u8]) -> Result<Format, String> {
        decide(Path::new(name), content(bytes, bytes.len() as u64)).map_err(|f| f.to_string())
    }

    fn binary_stl(facets: u8) -> Vec<u8> {
        let mut bytes = b"solid".to_vec();
        bytes.resize(84 + 50 * usize::from(facets), 0);
        bytes[80] = facets;
        bytes
    }

    #[test]
    fn content_decides_whatever_the_extension() {
        let stl = binary_stl(2);
        let cases: [(Format, &[u8]); 19] = [
            (Format::Glb, b"glTF\x02\0\0\0"),
            (Format::Ply, b"ply\nformat ascii 1.0\n"),
            (Format::Ply, b"ply\r\n"),
            (Format::Ply, b"\xef\xbb\xbfply\n"),
            (Format::Gltf, b"\xef\xbb\xbf \n { \"asset\": 1}"),
            (Format::Gltf, b"{}"),
            (Format::Stl, &stl),
            (Format::Stl, b"SOLID\n facet normal 0 0 1\n"),
            (Format::Stl, b"solid x\nendsolid x\n"),
            (Format::Stl, b"\t solid x\n end solid x\n"),
            (Format::Off, b"# a\n\nSTCNOFF\n"),
            (Format::Off, b" OFF8 6 12 # or nah"),
            (Format::Off, b"4nOFF 4"),
            (Format::Off, b"OFF BINARY\n\0\0\0\x02"),
            (Format::Obj, b"# solid\no OFF\nvt 0 0\nv 0 0 0"),
            (Format::Obj, b"g a\nf 1//2 2//3 3//4"),
            (Format::Obj, b"mtllib a.mtl\n"),
            (Format::Obj, b"o\nusemtl x\n"),
            (Format::Obj, b"v -1 .5 1e3 1 0 0\n"),
        ];
        for (format, bytes) in cases {
            for name in ["a", "a.obj", "a.xyz", "a.stl", "a.fbx", "a.png"] {
                let text = String::from_utf8_lossy(bytes);
                assert_eq!(decided(name, bytes), Ok(format), "{name}: {text}");
            }
        }
    }

    #[test]
    fn the_extension_decides_what_the_content_leaves_open() {
        let mut longer = binary_stl(1);
        longer.push(0);
        for (name, format, bytes) in [
            ("a.obj", Format::Obj, &b""[..]),
            ("a.OBJ", Format::Obj, b"# only\ng a comment\n"),
            ("a.obj", Format::Obj, b"v nan-ish\n"),
            ("a.off", Format::Off, b"8 6 12\n0 0 0\n"),
            ("a.off", Format::Off, b"OFFICE\n"),
            ("a.ply", Format::Ply, b"plywood\n"),
            ("a.stl", Format::Stl, b"solid a\n"),
            ("a.stl", Format::Stl, &longer),
            ("a.xyz", Format::Xyz, b"3\nf g h\n1 2 3"),
            ("a.xyz", Format::Xyz, b"v u w\n1 2 3"),
            ("a.xyz", Format::Xyz, b"x\n"),
            ("a.glb", Format::Glb, b"\0\0"),
        ] {
            assert_eq!(decided(name, bytes), Ok(format), "{name}");
        }
    }

    #[test]
    fn rows_of_numbers_are_points_under_any_other_extension() {
        for text in [
            "1 2 3",
            "1,2,3\n",
            "2\n1;2;3;4\n5;6;7;8",
            "x y z\n1 2 3",
            "// a\n.5 1 2",
        ] {
            for name in ["a", "a.txt", "a.asc", "a.PTS", "a.csv"] {
                assert_eq!(
                    decided(name, text.as_bytes()),
                    Ok(Format::Xyz),
                    "{name}: {text}"
                );
            }
        }
    }

    #[test]
    fn what_is_not_read_is_named() {
        let known = "is not a known format; \
                     the known ones are .glb, .gltf, .obj, .off, .ply, .stl and .xyz";
        let unknown = |what: &str| format!("{what} {known}");
        let unsupported = |what: &str| format!("{what} is not supported");
        for (name, bytes, expected) in [
            ("a", &b""[..], unknown("a file without an extension")),
            ("a.txt", b"some\nnotes\n1 2 3", unknown("`.txt`")),
            ("a.txt", b"1 2\n3 4\n", unknown("`.txt`")),
            ("a.p\ng", b"\x89PNG\r\n\x1a\n\0\0", unknown("`.p\u{fffd}g`")),
            ("a.FBX", b"", unsupported("FBX")),
            ("a.obj", b"Kaydara FBX Binary  \0", unsupported("FBX")),
            ("a", b"; FBX 7.3.0 project file\n", unsupported("FBX")),
            ("a.ply", b"BLENDER-v293", unsupported("Blender")),
            ("a", b"MM\x0a\0\0\0\x02\0\0\0", unsupported("3DS")),
            (
                "a",
                b"<?xml version=\"1.0\"?>\n<COLLADA xmlns",
                unsupported("COLLADA"),
            ),
            ("a", b"\xef\xbb\xbf<X3D>", unsupported("X3D")),
            ("a.gltf", b"\n<svg>", unsupported("XML")),
            ("a", b"PXR-USDC\0", unsupported("USD")),
            ("a", b"#usda 1.0\n", unsupported("USD")),
            ("a", b"PK\x03\x04\0\0\0\0a.usdc\0", unsupported("USD")),
            (
                "a.zip",
                b"PK\x03\x04[Content_Types].xml",
                unsupported("3MF"),
            ),
            ("a.obj", b"PK\x03\x04a.obj", unsupported("ZIP")),
            ("a", b"ISO-10303-21;\nHEADER;", unsupported("STEP")),
            ("a", b"DRACO\x02\x02", unsupported("Draco")),
            ("a", b"#VRML V2.0 utf8\n", unsupported("VRML")),
            ("a.stp", b"", unsupported("STEP")),
        ] {
            assert_eq!(decided(name, bytes), Err(expected), "{name}");
        }
    }

    #[test]
    fn text_in_utf_16_is_named_whatever_its_format() {
        let texts = [
            ("a.obj", "v 0 0 0\nf 1 1 1\n"),
            ("a.ply", "ply\nformat ascii 1.0\n"),
            ("a.off", "OFF\n1 0 0\n"),
            ("a.stl", "solid a\nendsolid a\n"),
            ("a.xyz", "1 2 3\n"),
            ("a.gltf", "{\"asset\": {}}"),
            ("a", "1 2 3\n"),
            ("a.obj", "# nothing\n"),
        ];
        let expected = "text in UTF-16 is not supported; save it as UTF-8";
        for bytes in [u16::to_le_bytes, u16::to_be_bytes] {
            for mark in ["", "\u{feff}"] {
                for (name, text) in texts {
                    let text = format!("{mark}{text}");
                    let bytes: Vec<u8> = text.encode_utf16().flat_map(bytes).collect();
                    assert_eq!(decided(name, &bytes), Err(expected.to_owned()), "{name}");
                    assert!(check_encoding(&bytes).is_err(), "{name}");
                }
            }
        }
        // What would not be read in UTF-8 is something else.
        let bytes: Vec<u8> = "some notes\n"
            .encode_utf16()
            .flat_map(u16::to_le_bytes)
            .collect();
        assert!(
            decided("a.txt", &bytes)
                .unwrap_err()
                .contains("not a known format")
        );
        // The header of a binary file may be anything.
        let mut stl = binary_stl(1);
        stl[..2].copy_from_slice(&[0xff, 0xfe]);
        assert_eq!(decided("a.stl", &stl), Ok(Format::Stl));
        assert!(check_encoding(&stl).is_ok());
    }

    #[test]
    fn a_word_that_is_cut_off_does_not_count() {
        let mut text = b"# \n".repeat(10);
        text.extend(b"v 0 0 0");
        let length = text.len() as u64;
        assert_eq!(content(&text, length), Content::Known(Format::Obj));
        assert_eq!(content(&text, length + 1), Content::Undecided);
        let json = content(b"{\"asset\": ", 1 << 20);
        assert_eq!(json, Content::Known(Format::Gltf));
    }
}
