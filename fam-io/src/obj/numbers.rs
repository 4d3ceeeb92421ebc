//! The numbers of an OBJ file: its `v`, `vt` and `vn` statements, as `tobj` reads them.

use std::io::Write;

use crate::error::ReadFault;
use crate::text::{is_nan_of_c, syntax};

use super::statements::Statement;

/// How many statements `tobj` gets at once; their number bounds its memory.
const BLOCK: usize = 1024;
const FIRST_VERTEX: &[u8] = b"v 0 0 0\n";

/// The tables that faces refer to, in the order of the file.
#[derive(Default)]
pub(super) struct Numbers {
    pub positions: Vec<[f64; 3]>,
    pub uvs: Vec<[f32; 2]>,
    pub normals: Vec<[f64; 3]>,
    /// The line of the first position that is not finite.
    non_finite: Option<usize>,
}

impl Numbers {
    /// Checks that all positions are finite.
    pub fn check_finite(&self) -> Result<(), ReadFault> {
        match self.non_finite {
            None => Ok(()),
            Some(line) => Err(syntax(
                line,
                "the vertex has a coordinate that is not a finite number",
            )),
        }
    }
}

/// Reads numbers, block by block.
#[derive(Default)]
pub(super) struct NumberReader {
    numbers: Numbers,
    block: Block,
    seen: [usize; 3],
}

impl NumberReader {
    /// How many `v`, `vt` and `vn` there are so far.
    pub fn seen(&self) -> [usize; 3] {
        self.seen
    }

    /// Takes one of the three statements; others are passed over.
    pub fn push(&mut self, statement: &Statement) -> Result<(), ReadFault> {
        let found = statement.arguments().len();
        let (table, used) = match statement.keyword() {
            // Three coordinates and a weight, or three coordinates and a colour.
            b"v" if found == 4 => (0, 4),
            b"v" => (0, 3),
            b"vt" => (1, 2),
            b"vn" => (2, 3),
            _ => return Ok(()),
        };
        self.seen[table] += 1;
        self.block.origins.push((table, statement.line));
        let text = &mut self.block.text;
        text.extend_from_slice(statement.keyword());
        for word in statement.words().take(used) {
            text.push(b' ');
            text.extend_from_slice(match word {
                _ if is_nan_of_c(word) => b"nan",
                // What is not ASCII is no number, but might be a blank to others.
                _ if !word.is_ascii() => b"?",
                _ => word,
            });
        }
        // A texture may have one dimension.
        if table == 1 && found == 1 {
            text.extend_from_slice(b" 0");
        }
        text.push(b'\n');
        if self.block.origins.len() == BLOCK {
            self.read_block()?;
        }
        Ok(())
    }

    /// All numbers.
    pub fn finish(mut self) -> Result<Numbers, ReadFault> {
        self.read_block()?;
        Ok(self.numbers)
    }

    fn read_block(&mut self) -> Result<(), ReadFault> {
        let mesh = self.block.read()?;
        let numbers = &mut self.numbers;
        // The first vertex is none of the file.
        let positions = triples(&mesh.positions).get(1..).unwrap_or_default();
        let is_finite = |p: &[f64; 3]| p.iter().all(|c| c.is_finite());
        if numbers.non_finite.is_none() {
            let bad = positions.iter().position(|p| !is_finite(p));
            numbers.non_finite = bad.map(|bad| self.block.vertex_line(bad));
        }
        numbers.positions.extend_from_slice(positions);
        numbers.normals.extend_from_slice(triples(&mesh.normals));
        let (uvs, _) = mesh.texcoords.as_chunks();
        numbers
            .uvs
            .extend(uvs.iter().map(|uv: &[f64; 2]| uv.map(|c| c as f32)));
        self.block.clear();
        Ok(())
    }
}

fn triples(numbers: &[f64]) -> &[[f64; 3]] {
    numbers.as_chunks().0
}

/// Statements to be read, after a vertex that is not one of them: `tobj` reads no faces, and
/// so no numbers, without vertices.
struct Block {
    text: Vec<u8>,
    /// The table and the line of each statement.
    origins: Vec<(usize, usize)>,
}

impl Default for Block {
    fn default() -> Self {
        Self {
            text: FIRST_VERTEX.to_vec(),
            origins: Vec::new(),
        }
    }
}

impl Block {
    fn clear(&mut self) {
        self.text.truncate(FIRST_VERTEX.len());
        self.origins.clear();
    }

    fn read(&mut self) -> Result<tobj::Mesh, ReadFault> {
        self.push_polygon();
        // Every statement is on one line, and so is what was read where reading stopped.
        let mut rest = self.text.as_slice();
        let (models, _) = tobj::load_obj_buf(&mut rest, &tobj::LoadOptions::default(), |_| {
            Err(tobj::LoadError::OpenFileFailed)
        })
        .map_err(|error| {
            let read = &self.text[FIRST_VERTEX.len()..self.text.len() - rest.len()];
            let lines = read.iter().filter(|&&byte| byte == b'\n').count();
            let origin = self.origins.get(lines.saturating_sub(1));
            syntax(origin.map_or(0, |&(_, line)| line), error.to_string())
        })?;
        Ok(models
            .into_iter()
            .next()
            .map(|model| model.mesh)
            .unwrap_or_default())
    }

    /// Adds a polygon that visits the entries of all three tables in their order: `tobj` stores
    /// what faces refer to, in the order of the first reference.
    fn push_polygon(&mut self) {
        let mut counts = [1, 0, 0];
        for &(table, _) in &self.origins {
            counts[table] += 1;
        }
        self.text.push(b'f');
        for corner in 1..=counts.into_iter().max().unwrap_or(0) {
            let [vertex, uv, normal] = counts.map(|count: usize| corner.min(count));
            // Writing to memory cannot fail.
            let _ = match (uv, normal) {
                (0, 0) => write!(self.text, " {vertex}"),
                (0, _) => write!(self.text, " {vertex}//{normal}"),
                (_, 0) => write!(self.text, " {vertex}/{uv}"),
                _ => write!(self.text, " {vertex}/{uv}/{normal}"),
            };
        }
        self.text.push(b'\n');
    }

    /// The line of a vertex of the file.
    fn vertex_line(&self, vertex: usize) -> usize {
        let mut vertices = self.origins.iter().filter(|(table, _)| *table == 0);
        vertices.nth(vertex).map_or(0, |&(_, line)| line)
    }
}

#[cfg(test)]
mod tests {
    use super::super::statements::Statements;
    use super::*;

    fn read(text: &str) -> Result<Numbers, ReadFault> {
        let mut reader = NumberReader::default();
        let mut statements = Statements::new(text.as_bytes());
        while let Some(statement) = statements.next().unwrap() {
            reader.push(&statement)?;
        }
        reader.finish()
    }

    #[test]
    fn tables_keep_the_order_of_the_file() {
        let text = "vn 0 0 1\nv 1 2 3 0.5\nvt 9\nf 3 2 1\nv 1 1 1 .1 .2 .3\nvn 1 0 0\ng x\n\
                    vn 0 0 1\nv 1 1 1\nvn 5 5 5 7\nvt 0.5 1e-2 0";
        let numbers = read(text).unwrap();
        assert_eq!(
            numbers.positions,
            [[2., 4., 6.], [1., 1., 1.], [1., 1., 1.]]
        );
        assert_eq!(numbers.uvs, [[9., 0.], [0.5, 0.01]]);
        let normals = [[0., 0., 1.], [1., 0., 0.], [0., 0., 1.], [5., 5., 5.]];
        assert_eq!(numbers.normals, normals);
    }

    #[test]
    fn blocks_join_without_a_seam() {
        for count in [BLOCK / 3, BLOCK - 1, BLOCK, BLOCK + 1, 3 * BLOCK + 7] {
            let mut text: String = (0..count).map(|i| format!("v {i} 0 -{i}\n")).collect();
            text.extend((0..count).map(|i| format!("vt {i} 1\nvn 0 {i} 0\n")));
            let numbers = read(&text).unwrap();
            for i in 0..count {
                let c = i as f64;
                assert_eq!(numbers.positions[i], [c, 0.0, -c]);
                assert_eq!(numbers.uvs[i], [i as f32, 1.0]);
                assert_eq!(numbers.normals[i], [0.0, c, 0.0]);
            }
            let lengths = [
                numbers.positions.len(),
                numbers.uvs.len(),
                numbers.normals.len(),
            ];
            assert_eq!(lengths, [count; 3]);
        }
    }

    #[test]
    fn numbers_are_written_in_several_ways() {
        let numbers = read("v +1 1. .5\nv 1e5 1E-2 -0\nv\t-.5e+1 \x0b 007 1").unwrap();
        assert_eq!(
            numbers.positions,
            [[1., 1., 0.5], [1e5, 0.01, 0.], [-5., 7., 1.]]
        );
    }

    #[test]
    fn numbers_that_are_not_finite_are_no_fault_of_uvs_and_normals() {
        let text = "v 1 2 3\nvt -1.#IND00 1.#QNAN # none\nvt 1 2\nvn -nan(ind) 1.#INF 0\n";
        let numbers = read(text).unwrap();
        assert!(numbers.uvs[0].iter().all(|c| c.is_nan()));
        assert_eq!(numbers.uvs[1], [1.0, 2.0]);
        assert!(numbers.normals[0][..2].iter().all(|c| c.is_nan()));
    }

    #[test]
    fn coordinates_are_double_precision() {
        let numbers = read("v 665187.522077 5648349.895035 241.767693").unwrap();
        assert_eq!(
            numbers.positions,
            [[665187.522077, 5648349.895035, 241.767693]]
        );
    }

    #[test]
    fn faults_name_the_line_of_the_file() {
        let late = format!("{}v 1 x 0\n", "v 0 0 0\n\n".repeat(BLOCK));
        let infinite = format!("{}v 1 0 inf\n", "vt 0 0\nv 0 0 0\n\n".repeat(BLOCK));
        let cases = [
            ("v 0 0 0\n\ng v\nv 1 x 0\n", "line 4: position parse error"),
            ("v 0 0 0\nv 1 0", "line 2: position parse error"),
            ("v 1\u{a0}2 3\n", "line 1: position parse error"),
            ("v 1\u{2003}2 3 4\n", "line 1: position parse error"),
            ("v 1 0\0 1\n", "line 1: position parse error"),
            ("v 1d5 0 1\n", "line 1: position parse error"),
            ("v 1,5 0 1\n", "line 1: position parse error"),
            ("v 1 2 3 x\n", "line 1: position parse error"),
            (
                "v 0 0 0\nv 0 0 0 0\nv 0 0 0\n",
                "line 2: scaling (w) by zero",
            ),
            ("v 0 0 0\nvt\n", "line 2: texcoord parse error"),
            ("# a\nv 0 0 0\nvn 1 \\\n 2\n", "line 3: normal parse error"),
            (
                "v 0 0 0\nvt nan 0\nv 0 inf 0\n",
                "line 3: the vertex has a coordinate that is not a finite number",
            ),
            (&late, "line 2049: position parse error"),
            (
                &infinite,
                "line 3073: the vertex has a coordinate that is not a finite number",
            ),
        ];
        for (text, message) in cases {
            let fault = read(text).and_then(|numbers| numbers.check_finite());
            let fault = fault.err().unwrap();
            assert_eq!(fault.to_string(), message, "{text}");
        }
    }
}
