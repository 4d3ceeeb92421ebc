//! The file again, with other UVs.

use std::io::{self, Write};
use std::ops::Range;

use fam_surface::UvMap;
use fam_surface::polygons::Split;

use super::Source;
use super::rows::Row;
use crate::text::{self, Edits};
use crate::uvs::Uvs;

impl Source {
    pub fn write(&self, uvs: &Uvs, out: &mut dyn Write) -> io::Result<()> {
        match uvs {
            Uvs::Mesh(uvs) => self.write_mesh(uvs, out),
            Uvs::Points(uvs) => self.write_points(uvs, out),
        }
    }

    fn write_mesh(&self, uvs: &UvMap, out: &mut dyn Write) -> io::Result<()> {
        let split = Split::at_seams(self.vertices.len(), &self.polygons, uvs);
        let mut edits = self.with_vertex_uvs(&split.uvs[..self.vertices.len()]);
        let line_end = text::line_end(&self.bytes);
        if let Some(last) = self.vertices.last() {
            let added = split.added.iter().zip(&split.uvs[self.vertices.len()..]);
            for (&vertex, [u, v]) in added {
                let row = &self.vertices[vertex as usize];
                let copied = self.text(row.text.start..self.uv_place(row).start);
                let line = format_args!("{} {u} {v}{line_end}", copied.trim());
                edits.replace(last.next..last.next, line);
            }
        }
        if !split.added.is_empty() {
            edits.replace(self.vertex_count.clone(), split.uvs.len());
        }
        let mut face_count = self.faces.len();
        let mut polygons = self.polygons.iter().zip(&split.faces);
        for row in &self.faces {
            let words = row.words(&self.bytes);
            let corners: usize = text::parse(&self.bytes[words[0].clone()]).unwrap_or(0);
            if corners < 3 {
                continue;
            }
            let Some((polygon, pieces)) = polygons.next() else {
                break;
            };
            if let [whole] = pieces.as_slice() {
                for ((word, old), new) in words[1..].iter().zip(polygon).zip(whole) {
                    if old != new {
                        edits.replace(word.clone(), new);
                    }
                }
                continue;
            }
            face_count += pieces.len() - 1;
            let color = self.text(words[corners].end..row.text.end);
            let faces: Vec<String> = pieces
                .iter()
                .map(|piece| format!("3 {} {} {}", piece[0], piece[1], piece[2]))
                .collect();
            let between = format!("{}{line_end}", color.trim_end());
            edits.replace(words[0].start..words[corners].end, faces.join(&between));
        }
        if face_count != self.faces.len() {
            edits.replace(self.face_count.clone(), face_count);
        }
        edits.apply(&self.bytes, out)
    }

    fn write_points(&self, uvs: &[[f32; 2]], out: &mut dyn Write) -> io::Result<()> {
        let uvs = self.kept.uvs_of_all(uvs);
        self.with_vertex_uvs(&uvs).apply(&self.bytes, out)
    }

    /// The new keyword, and the UVs of the vertices that are there.
    fn with_vertex_uvs(&self, uvs: &[[f32; 2]]) -> Edits {
        let mut edits = Edits::default();
        let line_end = text::line_end(&self.bytes);
        let after = if self.keyword.is_empty() {
            line_end
        } else {
            ""
        };
        let letter = |wanted: bool, letter: &'static str| if wanted { letter } else { "" };
        let colors = letter(self.letters.colors, "C");
        let normals = letter(self.letters.normals, "N");
        let keyword = format_args!("ST{colors}{normals}OFF{after}");
        edits.replace(self.keyword.clone(), keyword);
        for (row, [u, v]) in self.vertices.iter().zip(uvs) {
            let place = self.uv_place(row);
            let before = if place.is_empty() { " " } else { "" };
            edits.replace(place, format_args!("{before}{u} {v}"));
        }
        edits
    }

    /// Where the UV of a vertex is, or an empty range where to insert it.
    fn uv_place(&self, row: &Row) -> Range<usize> {
        let words = row.words(&self.bytes);
        let end = words[words.len() - 1].end;
        if self.letters.uvs {
            words[words.len() - 2].start..end
        } else {
            end..end
        }
    }

    fn text(&self, range: Range<usize>) -> std::borrow::Cow<'_, str> {
        String::from_utf8_lossy(&self.bytes[range])
    }
}
