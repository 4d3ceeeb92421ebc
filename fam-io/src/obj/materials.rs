//! Material files (MTL) in the folder of an OBJ file and below, and the images they name.
//!
//! `tobj` reads `newmtl`, `Kd`, `d` and `map_Kd`. Numbers that are none are passed over.
//! Options before the name of an image are skipped. Images are looked for in the folder of
//! the material file, then in that of the OBJ file; a backslash may separate folders. Paths
//! that are absolute or lead out of the folder are not followed.

use std::collections::HashMap;
use std::fs::{self, File};
use std::io::{self, BufReader, Write};
use std::path::{Component, Path, PathBuf};
use std::rc::Rc;

use crate::scene::{Image, Material};
use crate::text;

use super::statements::{Statements, decode};

/// The material files of an OBJ file that exist.
pub(super) struct Libraries<'a> {
    folder: &'a Path,
    files: Vec<PathBuf>,
}

impl<'a> Libraries<'a> {
    /// Looks for what `mtllib` statements name: a file, or several between blanks.
    pub fn find(folder: &'a Path, named: &[String]) -> Self {
        let mut files = Vec::new();
        for name in named {
            match existing(folder, Path::new(""), name) {
                Some(file) => add(&mut files, file),
                None => name
                    .split_whitespace()
                    .filter_map(|name| existing(folder, Path::new(""), name))
                    .for_each(|file| add(&mut files, file)),
            }
        }
        Self { folder, files }
    }

    /// The material files and their images, relative to the folder; what cannot be read is
    /// left out.
    pub fn files(&self) -> Vec<PathBuf> {
        let mut files = Vec::new();
        for library in &self.files {
            let Ok(images) = self.images(library) else {
                continue;
            };
            add(&mut files, library.clone());
            images.into_iter().for_each(|image| add(&mut files, image));
        }
        files
    }

    /// The materials of these names; white where no file defines them.
    pub fn materials(&self, names: &[String]) -> io::Result<Vec<Material>> {
        let mut definitions = HashMap::new();
        for library in &self.files {
            for definition in self.definitions(library)? {
                definitions.insert(definition.name.clone(), (library, definition));
            }
        }
        let mut images = HashMap::new();
        names
            .iter()
            .map(|name| {
                let mut material = white(name);
                if let Some((library, definition)) = definitions.get(name.trim()) {
                    material.base_color = base_color(definition);
                    let image = definition.diffuse_texture.as_deref();
                    let image = image.and_then(|image| self.image(library, image));
                    let read = |image| self.read_image(image, &mut images);
                    material.texture = image.map(read).transpose()?;
                }
                Ok(material)
            })
            .collect()
    }

    fn open(&self, library: &Path) -> io::Result<Statements<BufReader<File>>> {
        let file = File::open(self.folder.join(library))?;
        Ok(Statements::new(BufReader::new(file)))
    }

    fn definitions(&self, library: &Path) -> io::Result<Vec<tobj::Material>> {
        let mut text = Vec::new();
        let mut statements = self.open(library)?;
        while let Some(statement) = statements.next()? {
            let name = decode(&statement.name());
            let number = |word: &str| text::parse::<f64>(word.as_bytes()).is_some();
            let words: Vec<&str> = name.split_whitespace().collect();
            match (statement.keyword(), words.as_slice()) {
                (b"newmtl", [_, ..]) => writeln!(text, "newmtl {name}")?,
                (b"Kd", [r, g, b, ..]) if [r, g, b].iter().all(|word| number(word)) => {
                    writeln!(text, "Kd {r} {g} {b}")?;
                }
                (b"Kd", [grey]) if number(grey) => writeln!(text, "Kd {grey} {grey} {grey}")?,
                (b"d", [.., opacity]) if number(opacity) => writeln!(text, "d {opacity}")?,
                (b"map_Kd", [_, ..]) => writeln!(text, "map_Kd {name}")?,
                _ => {}
            }
        }
        let (materials, _) = tobj::load_mtl_buf(&mut text.as_slice())
            .map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))?;
        Ok(materials)
    }

    fn images(&self, library: &Path) -> io::Result<Vec<PathBuf>> {
        let mut images = Vec::new();
        let mut statements = self.open(library)?;
        while let Some(statement) = statements.next()? {
            let keyword = statement.keyword().to_ascii_lowercase();
            let is_image = keyword.starts_with(b"map_")
                || [&b"bump"[..], b"disp", b"decal", b"norm", b"refl"].contains(&&keyword[..]);
            if is_image {
                images.extend(self.image(library, &decode(&statement.name())));
            }
        }
        Ok(images)
    }

    fn image(&self, library: &Path, written: &str) -> Option<PathBuf> {
        let name = without_options(written);
        let beside = library.parent().unwrap_or(Path::new(""));
        existing(self.folder, beside, name).or_else(|| existing(self.folder, Path::new(""), name))
    }

    /// An image, read once for all materials that have it.
    fn read_image(
        &self,
        image: PathBuf,
        read: &mut HashMap<PathBuf, Rc<[u8]>>,
    ) -> io::Result<Image> {
        let name = image.file_name().unwrap_or_default();
        let name = name.to_string_lossy().into_owned();
        let bytes = match read.get(&image) {
            Some(bytes) => bytes.clone(),
            None => {
                let bytes: Rc<[u8]> = fs::read(self.folder.join(&image))?.into();
                read.insert(image, bytes.clone());
                bytes
            }
        };
        Ok(Image { name, bytes })
    }
}

/// A material of which only the name is known.
pub(super) fn white(name: &str) -> Material {
    Material {
        name: name.to_owned(),
        base_color: [1.0; 4],
        texture: None,
    }
}

fn base_color(definition: &tobj::Material) -> [f32; 4] {
    let [r, g, b] = definition.diffuse.unwrap_or([1.0; 3]);
    let part = |value: f64| {
        if value.is_finite() {
            value.clamp(0.0, 1.0) as f32
        } else {
            1.0
        }
    };
    [r, g, b, definition.dissolve.unwrap_or(1.0)].map(part)
}

fn add(files: &mut Vec<PathBuf>, file: PathBuf) {
    if !files.contains(&file) {
        files.push(file);
    }
}

/// The path of a file of this name in `folder`/`base`, relative to `folder`.
fn existing(folder: &Path, base: &Path, name: &str) -> Option<PathBuf> {
    [name.to_owned(), name.replace('\\', "/")]
        .iter()
        .find_map(|name| {
            let path = base.join(relative(name)?);
            folder.join(&path).is_file().then_some(path)
        })
}

/// A path that stays in its folder.
fn relative(name: &str) -> Option<PathBuf> {
    let mut path = PathBuf::new();
    for component in Path::new(name).components() {
        match component {
            Component::Normal(part) => path.push(part),
            Component::CurDir => {}
            _ => return None,
        }
    }
    (path != Path::new("")).then_some(path)
}

/// The name of an image without the options before it.
fn without_options(written: &str) -> &str {
    let mut rest = written.trim();
    while let Some((option, after)) = rest.split_once(char::is_whitespace) {
        let arguments = match option {
            "-blendu" | "-blendv" | "-bm" | "-boost" | "-cc" | "-clamp" | "-colorspace"
            | "-imfchan" | "-texres" | "-type" => 1..=1,
            "-mm" => 2..=2,
            "-o" | "-s" | "-t" => 1..=3,
            _ => break,
        };
        rest = after.trim_start();
        for argument in 1..=*arguments.end() {
            let (word, after) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
            if argument > *arguments.start() && text::parse::<f64>(word.as_bytes()).is_none() {
                break;
            }
            rest = after.trim_start();
        }
    }
    rest
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(files: &[(&str, &[u8])]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for (name, content) in files {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, content).unwrap();
        }
        folder
    }

    fn libraries<'a>(folder: &'a tempfile::TempDir, named: &[&str]) -> Libraries<'a> {
        let named: Vec<_> = named.iter().map(ToString::to_string).collect();
        Libraries::find(folder.path(), &named)
    }

    fn paths(paths: &[PathBuf]) -> Vec<&str> {
        paths.iter().map(|path| path.to_str().unwrap()).collect()
    }

    #[test]
    fn options_are_no_part_of_a_name() {
        for (written, name) in [
            ("a b.png", "a b.png"),
            ("-s 1 2 3 a b.png", "a b.png"),
            ("-o 1 a.png", "a.png"),
            ("-s 1 1 -t .5 -bm 2\t-mm 0 1  -clamp on x.jpg ", "x.jpg"),
            ("-s 1 1 1 2.png", "2.png"),
            ("-type sphere -imfchan m -x.png", "-x.png"),
            ("-s", "-s"),
            ("-s 1", ""),
            ("-mm 1", ""),
            ("", ""),
        ] {
            assert_eq!(without_options(written), name, "{written}");
        }
    }

    #[test]
    fn paths_stay_in_their_folder() {
        for name in ["../a", "a/../../b", "/etc/hosts", "", ".", "a/.."] {
            assert_eq!(relative(name), None, "{name}");
        }
        assert_eq!(relative("./a/./b.png").unwrap(), Path::new("a/b.png"));
    }

    #[test]
    fn material_files_and_images_are_found_once() {
        let folder = folder(&[
            ("my file.mtl", b"newmtl a\nmap_Kd -s 1 1 1 tex\\a.png # x\nbump tex/a.png\n"),
            (
                "sub/b.mtl",
                b"map_ka in sub.png\r\n NORM beside.png\r\ndisp ../out.png\rrefl -type cube_top none.png\n\
                  decal ./beside.png\nmap_Bump -bm 2 tex/a.png\nKd beside2.png\n",
            ),
            ("tex/a.png", b""),
            ("sub/in sub.png", b""),
            ("beside.png", b""),
            ("beside2.png", b""),
        ]);
        let named = [
            "my file.mtl",
            "none.mtl sub\\b.mtl my",
            "./sub/b.mtl",
            "..",
            "tex",
        ];
        let found = libraries(&folder, &named).files();
        let expected = [
            "my file.mtl",
            "tex/a.png",
            "sub/b.mtl",
            "sub/in sub.png",
            "beside.png",
        ];
        assert_eq!(paths(&found), expected);
    }

    #[test]
    fn materials_are_what_their_files_say() {
        let folder = folder(&[
            (
                "a.mtl",
                b"\xef\xbb\xbfKd 0 0 0\nnewmtl red\nKd 1 0.5 0 # c\nd -halo 0.25\nmap_Kd -s 2 2 a.png\n\
                  newmtl\nKd 9 nan -1 1\nd\nKd 0.5\nKd 1 2\nKd x y z\nillum\nNs\nmap_Ks\nKa 1\n\
                  newmtl two words\nKd 9 nan -1 1\nmap_Kd none.png\n",
            ),
            ("b.mtl", b"newmtl gr\xfcn\nKd 0 1 0\nmap_Kd\nmap_Kd ../a.png"),
            ("a.png", b"pixels"),
        ]);
        let names = ["two words", "gr\u{fc}n", "red", "other"].map(str::to_owned);
        let materials = libraries(&folder, &["a.mtl b.mtl"])
            .materials(&names)
            .unwrap();
        let colors: Vec<_> = materials.iter().map(|m| m.base_color).collect();
        let expected = [
            [1., 1., 0., 1.],
            [0., 1., 0., 1.],
            [0.5, 0.5, 0.5, 0.25],
            [1.; 4],
        ];
        assert_eq!(colors, expected);
        let found: Vec<_> = materials.iter().map(|m| m.name.clone()).collect();
        assert_eq!(found, names);
        let textures: Vec<_> = materials.into_iter().map(|m| m.texture).collect();
        let image = Image {
            name: "a.png".to_owned(),
            bytes: (*b"pixels").into(),
        };
        assert_eq!(textures, [None, None, Some(image), None]);
    }
}
