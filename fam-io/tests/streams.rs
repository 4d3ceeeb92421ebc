//! Clouds written a piece at a time are those written as a whole.

use std::fs;

use fam_io::{CloudStream, Format, StreamError, WriteOptions, read_surface};

/// More than one piece of each format.
const POINTS: usize = 150_000;

fn uv(p: &[f64; 3]) -> [f32; 2] {
    [p[0] as f32 * 0.5, p[2] as f32 + 0.25]
}

/// Writes a file both ways and compares the bytes.
fn both_ways(name: &str, content: &[u8]) {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    fs::write(path(name), content).unwrap();
    let document = read_surface(path(name)).unwrap();
    let uvs: Vec<_> = document.surface().positions().iter().map(uv).collect();
    let whole = path(&format!("whole-{name}"));
    document
        .write_point_uvs(&uvs, &whole, &WriteOptions::default())
        .unwrap();
    let stream = CloudStream::open(path(name)).unwrap().unwrap();
    assert_eq!(stream.format(), document.format());
    assert_eq!(stream.warnings(), document.warnings());
    let pieces = path(&format!("pieces-{name}"));
    let mut largest = 0;
    let some = |points: &[[f64; 3]]| {
        largest = largest.max(points.len());
        Some(points.iter().map(uv).collect())
    };
    stream.write_uvs(&pieces, some).unwrap();
    assert!(largest <= 1 << 20, "{largest} points at once");
    let (whole, pieces) = (fs::read(whole).unwrap(), fs::read(pieces).unwrap());
    assert!(
        whole == pieces,
        "{name}: {} and {} bytes",
        whole.len(),
        pieces.len()
    );
}

fn rows(row: impl Fn(usize) -> String) -> String {
    (0..POINTS).map(row).collect()
}

#[test]
fn text_is_the_same_in_pieces_and_as_a_whole() {
    let x = |i: usize| i as f64 / 1000.0;
    let plain =
        |end: &str| rows(|i| format!("{} {} {} 200 100 {}{end}", x(i), -x(i), x(i) / 3.0, i % 256));
    both_ways("plain.xyz", plain("\n").as_bytes());
    both_ways("returns.xyz", plain("\r").as_bytes());
    both_ways("both.xyz", plain("\r\n").trim_end().as_bytes());
    let named = rows(|i| format!("{};0;{};1;0;0\n# {i}\n\n", x(i), -x(i)));
    both_ways(
        "named.csv",
        format!("\u{feff}X;Y;Z;NX;NY;NZ\r\n{named}").as_bytes(),
    );
    let mapped = rows(|i| format!("{} 0 {} .5 {}\n", x(i), -x(i), i));
    both_ways(
        "mapped.xyz",
        format!("{POINTS}\n")
            .as_bytes()
            .iter()
            .chain(mapped.as_bytes())
            .copied()
            .collect::<Vec<_>>()
            .as_slice(),
    );
    // UVs that are named, and the last of which is none.
    both_ways(
        "broken.xyz",
        format!("# x y z u v\n{mapped}1 2 3 4 no\n").as_bytes(),
    );
    both_ways(
        "replaced.xyz",
        format!(
            "# x y z u v\n{}",
            rows(|i| format!("{} 0 {} 0.123456789 0.123456789\n", x(i), -x(i)))
        )
        .replace(" 0.123456789", " 0")
        .as_bytes(),
    );
}

#[test]
fn binary_points_are_the_same_in_pieces_and_as_a_whole() {
    for (format, big) in [("binary_little_endian", false), ("binary_big_endian", true)] {
        let header = format!(
            "ply\nformat {format} 1.0\ncomment scanned\nelement vertex {POINTS}\n\
             property uchar red\nproperty double x\nproperty float y\nproperty float u\n\
             property float z\nproperty float v\nelement face 0\n\
             property list uchar int vertex_indices\nend_header\n"
        );
        let mut content = header.into_bytes();
        for i in 0..POINTS {
            let order = |bytes: &mut [u8]| {
                if big {
                    bytes.reverse()
                }
            };
            let mut x = (i as f64 / 7.0).to_le_bytes();
            order(&mut x);
            content.push(i as u8);
            content.extend(x);
            for value in [1.0, 0.5, i as f32, 0.5] {
                let mut bytes = f32::to_le_bytes(value);
                order(&mut bytes);
                content.extend(bytes);
            }
        }
        content.extend(b"and more");
        both_ways("points.ply", &content);
    }
}

#[test]
fn points_that_are_left_out_are_the_same_in_pieces_and_as_a_whole() {
    let nan = "nan\tnan\tnan\t0\r\n\r\n";
    let row = |i: usize| match i % 1000 {
        0 => nan.to_owned(),
        1 => "-nan(ind)\t1.#QNAN\t0\r\n".to_owned(),
        _ => format!("{i}\t0\t{}\t7\r\n", i % 9),
    };
    both_ways(
        "nan.xyz",
        format!("X Y Z I\r\n\r\n{}", rows(row)).as_bytes(),
    );
    both_ways(
        "nan-uv.xyz",
        format!("# x y u z v\n{nan}1 2 3 .5 .5\n").as_bytes(),
    );
    both_ways(
        "nan-has-uv.xyz",
        format!("# x y z u v\n{nan}1 2 3 .5 .5\n").as_bytes(),
    );

    let header = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {POINTS}\nproperty float x\n\
         property float y\nproperty float z\nend_header\n"
    );
    let mut content = header.into_bytes();
    for i in 0..POINTS {
        // A whole block has no point.
        let is_nan = i % 1000 == 1 || (1 << 16..1 << 17).contains(&i);
        let x = if is_nan { f32::NAN } else { i as f32 };
        content.extend([x, 0.0, 1.0].iter().flat_map(|c| c.to_le_bytes()));
    }
    both_ways("nan.ply", &content);
}

#[test]
fn other_files_are_no_streams() {
    let folder = tempfile::tempdir().unwrap();
    let ascii = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
                 property float z\nend_header\n0 0 0\n";
    let lists = "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\n\
                 property float y\nproperty float z\nproperty list uchar int l\nend_header\n\
                 ------------\0";
    let faces = "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\n\
                 property float y\nproperty float z\nelement face 1\nproperty uchar none\n\
                 end_header\n-------------";
    for (name, content) in [
        ("ascii.ply", ascii),
        ("lists.ply", lists),
        ("faces.ply", faces),
        ("mesh.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
    ] {
        let path = folder.path().join(name);
        fs::write(&path, content).unwrap();
        assert!(CloudStream::open(&path).unwrap().is_none(), "{name}");
    }
}

/// The message is that of the file as a whole, and names the line of the file.
#[test]
fn faults_are_found_and_leave_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("points.xyz");
    let long = rows(|i| format!("{i} 0 0 and a word to fill the line with something\n"));
    for broken in [
        format!("{long}1 2\n"),
        format!("{long}1 2 x\n{long}"),
        "# x y z\n".into(),
    ] {
        fs::write(&path, broken).unwrap();
        let whole = read_surface(&path).unwrap_err().to_string();
        assert_eq!(CloudStream::open(&path).unwrap_err().to_string(), whole);
    }
    let point = "property float x\nproperty float y\nproperty float z\nend_header\n";
    let ply = folder.path().join("points.ply");
    let header = |count: usize| {
        format!("ply\nformat binary_little_endian 1.0\nelement vertex {count}\n{point}")
            .into_bytes()
    };
    fs::write(&ply, [header(5), vec![0; 30]].concat()).unwrap();
    let whole = read_surface(&ply).unwrap_err().to_string();
    assert_eq!(CloudStream::open(&ply).unwrap_err().to_string(), whole);

    let out = folder.path().join("out.ply");
    // All bits set are NaN.
    fs::write(&ply, [header(2), vec![255; 24]].concat()).unwrap();
    let whole = read_surface(&ply).unwrap_err().to_string();
    assert!(whole.ends_with("none of its 2 points has finite coordinates"));
    assert_eq!(CloudStream::open(&ply).unwrap_err().to_string(), whole);

    fs::write(&ply, [header(2), vec![0; 24]].concat()).unwrap();
    let stream = CloudStream::open(&ply).unwrap().unwrap();
    let fault = |uvs: Vec<[f32; 2]>| match stream.write_uvs(&out, |_| Some(uvs.clone())) {
        Err(StreamError::Write(error)) => error.fault.to_string(),
        other => panic!("{other:?}"),
    };
    assert_eq!(fault(vec![[0.0; 2]]), "2 points need as many UVs, found 1");
    assert_eq!(
        fault(vec![[0.0; 2], [f32::NAN, 0.0]]),
        "the UV of point 1 is not a finite number"
    );
    let broken_off = stream.write_uvs(&out, |_| None);
    assert!(matches!(broken_off, Err(StreamError::BrokenOff)));
    assert!(!out.exists());
    assert_eq!(Format::of_path(&out), Some(Format::Ply));
}
