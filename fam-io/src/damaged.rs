//! Damaged files never make a reader panic, and what can still be read can be written.

use fam_core::surface::{Surface, UvMap};

use crate::{Document, Format, Uvs, WriteOptions};

#[path = "../tests/common/random.rs"]
mod random;

use random::Random;

fn ply(vertices: &str, faces: &str, body: &str) -> String {
    format!(
        "ply\nformat ascii 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\n\
         property float z\nelement face {faces}\nproperty list uchar int vertex_indices\n\
         end_header\n{body}"
    )
}

/// Small files that use every part of the readers.
fn seeds() -> Vec<(Format, Vec<u8>)> {
    let body = b"\0\0\0\0\0\0\x80?\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x80?\x03\0\0\0\0\x01\0\0\0\0\0\0\0";
    let header = |encoding| ply("2", "1", "").replace("ascii", encoding).into_bytes();
    let little = [&header("binary_little_endian"), &body[..]].concat();
    let big = [&header("binary_big_endian"), &body[..]].concat();
    let corner_uvs = ply(
        "3",
        "1",
        "0 0 0 9\n1 0 0 8\n0 1 0 7\n3 0 1 2 6 0 0 1 0 0 1\n",
    )
    .replace("\nelement face", "\nproperty uchar s\nelement face")
    .replace("\nend", "\nproperty list uchar float texcoord\nend");
    let strips = ply("4", "1", "0 0 0\n1 0 0\n0 1 0\n1 1 0\n8 0 1 2 3 -1 0 2 3\n")
        .replace("element face", "comment c\r\nelement tristrips");
    let stl = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n\
               vertex 0 1 0\nendloop\nendfacet\nendsolid\n";
    let mut binary_stl = vec![0; 80];
    binary_stl.extend([1, 0, 0, 0]);
    binary_stl.extend((0..50).map(|i| i * 5));
    let binary_off = [
        &b"STOFF BINARY\n\0\0\0\x01\0\0\0\x01\0\0\0\0"[..],
        &body[..20],
        b"\0\0\0\x03\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x01?\0\0\0",
    ];
    vec![
        (
            Format::Obj,
            b"o a\nv 0 0 0 1\nv 1 0 0 .1 .2 .3\nvt 0 0\nvn 0 0 1\n\\\nv 0 1 0\r\n\
              f 1/1/1 2//-1 3/-1\nf -1 -2 \\\n -3 1 # c\nl 1 2\n"
                .to_vec(),
        ),
        (
            Format::Off,
            b"STCNOFF 4 2 0 # c\n0 0 0 0 0 1 255 0 0 1 .5 .5\n1 0 0 0 0 1 9 0 1\n\
              1 1 0 0 0 1 1 1\n0 1 0 0 0 1 1 1\n4 0 1 2 3 1 0 0\n3 0 1 2\n"
                .to_vec(),
        ),
        (
            Format::Ply,
            ply("3", "1", "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n").into_bytes(),
        ),
        (Format::Off, binary_off.concat()),
        (Format::Ply, little),
        (Format::Ply, big),
        (Format::Ply, corner_uvs.into_bytes()),
        (Format::Ply, strips.into_bytes()),
        (Format::Stl, stl.repeat(2).into_bytes()),
        (Format::Stl, binary_stl),
        (
            Format::Xyz,
            b"# x y z nx ny nz u v\n3\n1,2,3,0,0,1,.5,.5\n4 5 6 0 1 0 1 1\n".to_vec(),
        ),
    ]
}

#[test]
fn damaged_files_never_panic() {
    let mut random = Random::new(2);
    let tokens: [&[u8]; 14] = [
        b"-1",
        b"0",
        b"4294967296",
        b"-9223372036854775808",
        b"18446744073709551615",
        b"nan",
        b"1e999",
        b"/",
        b"\\\n",
        b"\r",
        b"#",
        b" ",
        b"\xff",
        b"list uint double",
    ];
    let mut read = 0;
    for (format, seed) in seeds() {
        let truncations = (0..seed.len()).map(|length| seed[..length].to_vec());
        let mut damaged: Vec<Vec<u8>> = truncations.collect();
        for _ in 0..700 {
            let mut bytes = seed.clone();
            for _ in 0..=random.below(3) {
                let at = random.below(bytes.len());
                match random.below(4) {
                    0 => bytes[at] = random.below(256) as u8,
                    1 => bytes[at] ^= 1 << random.below(8),
                    2 => drop(bytes.splice(at..at, tokens[random.below(14)].iter().copied())),
                    _ => {
                        let end = (at + random.below(9)).min(bytes.len());
                        bytes.splice(at..end, tokens[random.below(14)].iter().copied());
                    }
                }
            }
            damaged.push(bytes);
        }
        for bytes in damaged {
            let document = match Document::from_bytes(format, bytes) {
                Ok(document) => document,
                Err(fault) => {
                    let message = fault.to_string();
                    assert!(!message.contains(char::is_control), "{message}");
                    continue;
                }
            };
            read += 1;
            document.scene().unwrap();
            if format == Format::Stl {
                continue;
            }
            let mut out = Vec::new();
            let uvs = match document.surface() {
                Surface::Mesh(mesh) => {
                    let count = mesh.triangles().len() as u32;
                    let uvs = (0..3 * count).map(|i| [i as f32, 0.0]).collect();
                    let triangles = (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
                    Uvs::Mesh(UvMap::new(uvs, triangles.collect()).unwrap())
                }
                Surface::PointCloud(cloud) => Uvs::Points(vec![[0.5, 0.25]; cloud.points().len()]),
            };
            let options = WriteOptions::default();
            document.write_to(&uvs, format, &options, &mut out).unwrap();
            Document::from_bytes(format, out).unwrap();
        }
    }
    assert!(read > 900, "only {read} damaged files were still readable");
}
