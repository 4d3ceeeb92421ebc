//! Files made up at random keep all but their UVs.

use super::*;

proptest! {
    #[test]
    fn ply_keeps_everything_but_its_uvs(
        (points, faces) in polygons(),
        (encoding, line_end, sized) in (0..3usize, 0..3usize, any::<bool>()),
        (index, length, uv_kind, normals) in (0..8usize, 0..6usize, 0..5usize, any::<bool>()),
        (vertex_extras, face_extras, other_extras) in (extras(), extras(), extras()),
        (order, others, seed, values) in (any::<u64>(), 0..3u64, any::<u64>(), 1..50u64),
    ) {
        let line_end = ["\n", "\r\n", "\r"][line_end];
        let double = order % 2 == 0;
        let coordinate = if double { "double" } else { "float" };
        let mut vertex = element("vertex", &["x", "y", "z"].map(|c| (c, None, coordinate)));
        vertex.rows = points.iter().map(|p| p.map(|c| vec![c.into()]).to_vec()).collect();
        let mut add = |names: &[&str], kind: &'static str, seed: u64| {
            for (at, name) in names.iter().enumerate() {
                let (name, length) = (name.to_string(), None);
                vertex.properties.push(Property { name, length, kind });
                for (row, values) in vertex.rows.iter_mut().enumerate() {
                    values.push(vec![any_value(kind, seed ^ (row * 7 + at) as u64)]);
                }
            }
        };
        if normals {
            add(&["nx", "ny", "nz"], "float", seed);
        }
        match uv_kind {
            1 => add(&["s", "t"], "double", seed),
            2 => add(&["u", "v"], "float", seed),
            3 => add(&["t"], "uchar", seed),
            _ => {}
        }
        add_extras(&mut vertex, &vertex_extras);

        let length = KINDS[length].0;
        let mut face = element("face", &[("vertex_indices", Some(length), KINDS[index].0)]);
        let list = |face: &Vec<u32>| vec![face.iter().map(|&v| v.into()).collect()];
        face.rows = faces.iter().map(list).collect();
        if uv_kind == 4 {
            let name = "texcoord".to_owned();
            face.properties.push(Property { name, length: Some("uchar"), kind: "float" });
            for row in &mut face.rows {
                let uvs = (0..2 * row[0].len()).map(|i| any_value("float", seed ^ i as u64));
                row.push(uvs.collect());
            }
        }
        add_extras(&mut face, &face_extras);

        let mut elements = vec![vertex, face];
        for number in 0..others {
            let mut other = element(&format!("other{number}"), &[]);
            other.rows = vec![Vec::new(); 1 + (seed % 3) as usize];
            add_extras(&mut other, &other_extras);
            if other.properties.is_empty() {
                other.rows.clear();
            }
            elements.insert((order / 7 + number) as usize % (elements.len() + 1), other);
        }
        if order % 3 == 0 {
            elements.reverse();
        }

        let bytes = encode(&elements, encoding, line_end, sized);
        prop_assert_eq!(&decode(&bytes, line_end), &elements);
        let document = read(Format::Ply, &bytes);
        let (again, output) = check_round_trip(&document, seed, values);
        if line_end != "\r" {
            foreign_ply::check(&output, &again);
        }
        let output = decode(&output, line_end);
        prop_assert_eq!(output.len(), elements.len());
        let is_mesh = matches!(again.surface(), Surface::Mesh(_));
        let at_corners = is_mesh && uv_kind == 4;
        for (before, after) in elements.iter().zip(&output) {
            match before.name.as_str() {
                "vertex" => {
                    let old: &[&str] = if at_corners { &[] } else { &["s", "t", "u", "v"] };
                    let (before, mut after) = (without(before, old), without(after, old));
                    for copy in after.rows.split_off(before.rows.len()) {
                        prop_assert!(before.rows.contains(&copy));
                    }
                    prop_assert_eq!(before, after);
                }
                "face" if is_mesh => {
                    let corners = |row: &Vec<Vec<f64>>, of: &Element| {
                        let list = of.properties.iter().position(|p| p.name == "vertex_indices");
                        row[list.unwrap()].len()
                    };
                    let uvs = ["vertex_indices", "texcoord"];
                    let (old, new) = (without(before, &uvs), without(after, &uvs));
                    prop_assert_eq!(&old.properties, &new.properties);
                    let mut pieces = after.rows.iter().zip(&new.rows);
                    for (row, old) in before.rows.iter().zip(&old.rows) {
                        let count = corners(row, before);
                        let mut left = count.max(3) - 2;
                        while left > 0 {
                            let (piece, new) = pieces.next().unwrap();
                            prop_assert_eq!(new, old);
                            left -= corners(piece, after).max(3) - 2;
                        }
                    }
                    prop_assert!(pieces.next().is_none());
                }
                _ => prop_assert_eq!(before, after),
            }
        }
    }

    #[test]
    fn off_keeps_everything_but_its_uvs(
        (points, faces) in polygons(),
        (uvs, normals, color) in (any::<bool>(), any::<bool>(), 0..5usize),
        (face_color, comments, seed, values) in (0..5usize, any::<bool>(), any::<u64>(), 1..50u64),
    ) {
        let letters = [(uvs, "ST"), (color > 0, "C"), (normals, "N")];
        let letters: String = letters.map(|(has, letter)| if has { letter } else { "" }).concat();
        let comment = if comments { "  # note" } else { "" };
        let columns = |count: usize, row: usize| -> Vec<String> {
            let value = |at| any_value("float", seed ^ (row * 16 + at) as u64).to_string();
            (0..count).map(value).collect()
        };
        let mut text = format!("{letters}OFF{comment}\n\n{} {}\n", points.len(), faces.len());
        for (row, point) in points.iter().enumerate() {
            let count = 3 * usize::from(normals) + color + 2 * usize::from(uvs);
            let point = point.map(|c| c.to_string()).to_vec();
            text += &format!(" {}{comment}\n", [point, columns(count, row)].concat().join(" "));
        }
        for (row, face) in faces.iter().enumerate() {
            let corners: Vec<String> = face.iter().map(u32::to_string).collect();
            let words = [vec![face.len().to_string()], corners, columns(face_color, row)].concat();
            text += &format!("{}{comment}\n\n", words.join("\t"));
        }
        let document = read(Format::Off, &text);
        let (_, output) = check_round_trip(&document, seed, values);
        let rows = |text: &str| -> Vec<Vec<String>> {
            let lines = text.lines().map(|line| line.split('#').next().unwrap());
            let rows = lines.map(|line| line.split_whitespace().map(str::to_owned).collect());
            rows.filter(|row: &Vec<String>| !row.is_empty()).collect()
        };
        let (before, after) = (rows(&text), rows(&String::from_utf8(output).unwrap()));
        prop_assert!(after[0][0].starts_with("ST"));
        for row in 0..points.len() {
            let (old, new) = (&before[2 + row], &after[2 + row]);
            let end = old.len() - 2 * usize::from(uvs);
            prop_assert_eq!(&new[..new.len() - 2], &old[..end]);
        }
        let count: usize = after[1][0].parse().unwrap();
        let mut new = after[2 + count..].iter();
        for (face, old) in faces.iter().zip(&before[2 + points.len()..]) {
            let mut left = face.len().max(3) - 2;
            while left > 0 {
                let piece = new.next().unwrap();
                let corners: usize = piece[0].parse().unwrap();
                prop_assert_eq!(&piece[1 + corners..], &old[1 + face.len()..]);
                left -= corners.max(3) - 2;
            }
        }
        prop_assert!(new.next().is_none());
    }

    #[test]
    fn stl_facets_share_equal_corners(
        points in prop::collection::vec(point(), 1..6),
        facets in prop::collection::vec((0..6usize, 0..6usize, 0..6usize), 1..12),
        (solids, binary) in (1..4usize, any::<bool>()),
    ) {
        let facets: Vec<[[f32; 3]; 3]> = facets
            .iter()
            .map(|&(a, b, c)| [a, b, c].map(|i| points[i % points.len()]))
            .collect();
        let per_solid = if binary { facets.len() } else { facets.len().div_ceil(solids) };
        let bytes = if binary {
            let mut bytes = vec![b' '; 80];
            bytes.extend((facets.len() as u32).to_le_bytes());
            for facet in &facets {
                let numbers = [[0.0; 3]].iter().chain(facet).flatten();
                bytes.extend(numbers.flat_map(|c| c.to_le_bytes()));
                bytes.extend([7, 7]);
            }
            bytes
        } else {
            let mut text = String::new();
            for solid in facets.chunks(per_solid) {
                text += "solid of points\n";
                for facet in solid {
                    text += "facet normal 0 0 0\n outer loop\n";
                    for [x, y, z] in facet {
                        text += &format!("  vertex {x:e} {y} {z}\n");
                    }
                    text += " endloop\nendfacet\n";
                }
                text += "endsolid of points\n";
            }
            text.into_bytes()
        };
        let document = read(Format::Stl, &bytes);
        let mesh = mesh(&document);
        // The other reader stops at the end of the first solid.
        let mut bytes = Cursor::new(bytes);
        let foreign = stl_io::create_stl_reader(&mut bytes).unwrap();
        let foreign: Vec<_> = foreign.map(|facet| facet.unwrap().vertices.map(|v| v.0)).collect();
        prop_assert_eq!(foreign.len(), per_solid.min(facets.len()));
        for (t, foreign) in foreign.iter().enumerate() {
            prop_assert_eq!(&mesh.corners(t).map(|corner| corner.map(|c| c as f32)), foreign);
        }
        let (mut vertices, mut objects) = (Vec::new(), Vec::new());
        let mut triangles = Vec::new();
        for (object, solid) in facets.chunks(per_solid).enumerate() {
            let mut known: Vec<([f32; 3], u32)> = Vec::new();
            for facet in solid {
                objects.push(object as u32);
                triangles.push(facet.map(|corner| {
                    let found = known.iter().find(|(point, _)| *point == corner);
                    found.map(|found| found.1).unwrap_or_else(|| {
                        vertices.push(corner);
                        known.push((corner, vertices.len() as u32 - 1));
                        vertices.len() as u32 - 1
                    })
                }));
            }
        }
        prop_assert_eq!(mesh.triangles(), triangles);
        let narrow = |p: &[f64; 3]| p.map(|c| c as f32);
        prop_assert_eq!(mesh.positions().iter().map(narrow).collect::<Vec<_>>(), vertices);
        let several = facets.len() > per_solid;
        prop_assert_eq!(&document.labels().objects, if several { &objects } else { &objects[..0] });
    }

    #[test]
    fn xyz_keeps_every_column(
        points in prop::collection::vec([any::<f64>(), any::<f64>(), any::<f64>()], 1..9),
        (separator, header, extra) in (0..4usize, 0..5usize, 0..4usize),
        (normals, uvs, comments, seed) in (any::<bool>(), any::<bool>(), any::<bool>(), any::<u64>()),
    ) {
        let separator = [" ", ",", ";\t", "  "][separator];
        let mut names = vec!["X", "y", "z"];
        names.extend(if normals { vec!["nx", "ny", "nz"] } else { vec![] });
        names.extend(&["a", "b", "c"][..extra]);
        names.extend(if uvs { vec!["U", "v"] } else { vec![] });
        let named = header == 1 || header == 2 || uvs;
        let mut text = String::new();
        if named {
            text += &format!("{}{}\n", if header == 1 { "" } else { "// " }, names.join(separator));
        } else if header == 3 {
            text += &format!("{}\n", points.len());
        }
        let comment = if comments { " # c" } else { "" };
        for (row, point) in points.iter().enumerate() {
            let mut words = point.map(|c| format!("{c:?}")).to_vec();
            if normals {
                let mut normal = ["0"; 3];
                normal[row % 3] = "-1";
                words.extend(normal.map(str::to_owned));
            }
            words.extend((0..extra).map(|at| any_value("int", seed ^ at as u64).to_string()));
            words.extend(if uvs { vec![".5".to_owned(), "1e-1".to_owned()] } else { vec![] });
            text += &format!("{}{comment}\n", words.join(separator));
        }
        let document = read(Format::Xyz, &text);
        prop_assert_eq!(document.surface().positions(), &points[..]);
        prop_assert_eq!(document.point_uvs().is_some(), uvs);
        let Surface::PointCloud(cloud) = document.surface() else {
            panic!("a cloud was expected");
        };
        if normals {
            let normal = cloud.normals().unwrap()[points.len() - 1];
            prop_assert_eq!(normal[(points.len() - 1) % 3], -1.0);
        }
        let (_, output) = check_round_trip(&document, seed, 99);
        let output = String::from_utf8(output).unwrap();
        let added = usize::from(!uvs);
        prop_assert_eq!(output.lines().count(), text.lines().count() + added);
        let rows = text.lines().rev().zip(output.lines().rev()).take(points.len());
        for (old, new) in rows {
            let old = old.strip_suffix(comment).unwrap();
            let old = if uvs { old.strip_suffix(&format!("{separator}.5{separator}1e-1")).unwrap() } else { old };
            prop_assert!(new.starts_with(old) && new.ends_with(comment), "{new}");
        }
    }
}
