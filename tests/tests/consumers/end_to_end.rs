//! What the `fam` binary writes.

use fam_io::WriteOptions;

use crate::common::{brief, succeeds};
use crate::installed::Consumers;
use crate::meshes::{expected, seen_triangles};
use crate::pictures::{ASLANT, shares};
use crate::surfaces::{HOUSE, obj, per_vertex, write};

#[test]
fn every_program_reads_what_unwrap_writes() {
    let validator = Consumers::with_validator();
    let readers = Consumers::with_mesh_readers();
    let browser = Consumers::with_browser();
    let (Some(validator), Some(readers), Some(browser)) = (validator, readers, browser) else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let document = obj(HOUSE);
    let uvs = per_vertex(document.surface());
    let input = folder.path().join("house.obj");
    write(&document, &uvs, &input, &WriteOptions::default());
    for format in ["glb", "obj", "ply"] {
        let options = ["house.obj", "-q", "--format", format, "-o", format];
        let shown = ["--checker", "--seam-lines"];
        let shown = if format == "glb" { &shown[..] } else { &[] };
        succeeds(folder.path(), &brief(&[&options, shown].concat()));
    }
    let output = |format: &str| folder.path().join(format).join(format!("house.{format}"));

    let glb = output("glb");
    let messages = &validator.validate(std::slice::from_ref(&glb))[&glb];
    assert!(
        !messages.iter().any(|m| m.is_error_or_warning()),
        "{messages:?}"
    );
    let [light, dark] = shares(&browser.pictures(ASLANT, &[&glb])[0]);
    assert!(light > 0.15 && dark > 0.15, "{light} {dark}");

    for (tool, format) in [("trimesh", "obj"), ("meshio", "ply")] {
        let file = output(format);
        let seen = readers.read(tool, std::slice::from_ref(&file));
        let document = fam_io::read_surface(&file).unwrap();
        let uvs = document.uv_map().unwrap();
        assert!(
            seen_triangles(&seen[&file]) == expected(document.surface(), uvs),
            "{format}"
        );
    }
}
