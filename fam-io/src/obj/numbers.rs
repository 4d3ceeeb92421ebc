//! The numbers of an OBJ file: its `v`, `vt` and `vn` statements, as `tobj` reads them.

use std::fmt::Write;

use crate::ReadFault;
use crate::text::syntax;

use super::statements::statements;

/// The tables that faces refer to, in the order of the file.
#[derive(Default)]
pub(super) struct Numbers {
    pub positions: Vec<[f64; 3]>,
    pub uvs: Vec<[f32; 2]>,
    pub normals: Vec<[f64; 3]>,
}

/// Reads all numbers. The positions are finite.
pub(super) fn read(bytes: &[u8]) -> Result<Numbers, ReadFault> {
    let mut text = String::new();
    let mut origins = Vec::new();
    let mut counts = [0_usize; 3];
    for statement in statements(bytes) {
        let found = statement.arguments().len();
        let (table, used) = match statement.keyword(bytes) {
            // Three coordinates and a weight, or three coordinates and a colour.
            b"v" if found == 4 => (0, 4),
            b"v" => (0, 3),
            b"vt" => (1, 2),
            b"vn" => (2, 3),
            _ => continue,
        };
        counts[table] += 1;
        origins.push((table, statement.line));
        text.push_str(["v", "vt", "vn"][table]);
        for word in statement.arguments().iter().take(used) {
            text.push(' ');
            text.push_str(&String::from_utf8_lossy(&bytes[word.clone()]));
        }
        // A texture may have one dimension.
        text.push_str(if table == 1 && found == 1 {
            " 0\n"
        } else {
            "\n"
        });
    }
    if counts[0] == 0 {
        return Ok(Numbers::default());
    }
    push_polygon(&mut text, counts);

    // Numbers have one statement per line and so has the text, up to where reading stopped.
    let mut rest = text.as_bytes();
    let (models, _) = tobj::load_obj_buf(&mut rest, &tobj::LoadOptions::default(), |_| {
        Err(tobj::LoadError::OpenFileFailed)
    })
    .map_err(|error| {
        let read = text.len() - rest.len();
        let lines = text.as_bytes()[..read]
            .iter()
            .filter(|&&b| b == b'\n')
            .count();
        let line = origins
            .get(lines.saturating_sub(1))
            .map_or(0, |&(_, line)| line);
        syntax(line, error.to_string())
    })?;
    let mesh = models
        .into_iter()
        .next()
        .map(|model| model.mesh)
        .unwrap_or_default();
    let positions: Vec<[f64; 3]> = triples(&mesh.positions);
    if let Some(bad) = positions
        .iter()
        .position(|p| !p.iter().all(|c| c.is_finite()))
    {
        let vertices = origins.iter().filter(|(table, _)| *table == 0);
        let line = vertices.map(|&(_, line)| line).nth(bad).unwrap_or(0);
        return Err(syntax(
            line,
            "the vertex has a coordinate that is not a finite number",
        ));
    }
    Ok(Numbers {
        positions,
        uvs: mesh
            .texcoords
            .as_chunks()
            .0
            .iter()
            .map(|uv: &[f64; 2]| uv.map(|c| c as f32))
            .collect(),
        normals: triples(&mesh.normals),
    })
}

fn triples(numbers: &[f64]) -> Vec<[f64; 3]> {
    numbers.as_chunks().0.to_vec()
}

/// Adds a polygon that visits the entries of all three tables in their order: `tobj` stores
/// what faces refer to, in the order of the first reference.
fn push_polygon(text: &mut String, counts: [usize; 3]) {
    let corners = counts.into_iter().max().unwrap_or(0);
    text.push('f');
    for corner in 1..=corners {
        let reference = |table: usize| match counts[table] {
            0 => String::new(),
            count => corner.min(count).to_string(),
        };
        let (vertex, uv, normal) = (reference(0), reference(1), reference(2));
        // Writing to a string cannot fail.
        let _ = write!(text, " {vertex}/{uv}/{normal}");
    }
    text.push('\n');
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_keep_the_order_of_the_file() {
        let text = "vn 0 0 1\nv 1 2 3 0.5\nvt 9\nf 3 2 1\nv 1 1 1 .1 .2 .3\nvn 1 0 0\ng x\n\
                    vn 0 0 1\nv 1 1 1\nvn 5 5 5 7\nvt 0.5 1e-2 0";
        let numbers = read(text.as_bytes()).unwrap();
        assert_eq!(
            numbers.positions,
            [[2., 4., 6.], [1., 1., 1.], [1., 1., 1.]]
        );
        assert_eq!(numbers.uvs, [[9., 0.], [0.5, 0.01]]);
        let normals = [[0., 0., 1.], [1., 0., 0.], [0., 0., 1.], [5., 5., 5.]];
        assert_eq!(numbers.normals, normals);
    }

    #[test]
    fn coordinates_are_double_precision() {
        let numbers = read(b"v 665187.522077 5648349.895035 241.767693").unwrap();
        assert_eq!(
            numbers.positions,
            [[665187.522077, 5648349.895035, 241.767693]]
        );
    }

    #[test]
    fn faults_name_the_line_of_the_file() {
        let cases = [
            ("v 0 0 0\n\ng v\nv 1 x 0\n", "line 4: position parse error"),
            ("v 0 0 0\nv 1 0", "line 2: position parse error"),
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
        ];
        for (text, message) in cases {
            let fault = read(text.as_bytes()).err().unwrap();
            assert_eq!(fault.to_string(), message, "{text}");
        }
    }
}
