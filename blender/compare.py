"""Layouts by the extension beside those by Blender itself, on the same meshes in one run.

    python blender/compare.py [--render PICTURE.png] [MESH.obj ...]

Without meshes: Suzanne, plain and subdivided. Prints a table in Markdown. The extension is the zip in
blender/dist; `blender/check` makes it, and a virtual environment that has what this needs.
"""

import argparse
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "tests"))

import conftest  # noqa: F401, the folder of Blender's settings
import bpy
import scenes

COLUMNS = ("charts", "seam_length", "symmetric_dirichlet", "flipped_triangles", "overlapping_pairs")


def flatten_anything():
    bpy.ops.uv.flatten_anything(use_seams=False, mark_seams=True)


def smart_project():
    bpy.ops.uv.smart_project()


def minimum_stretch():
    bpy.ops.uv.unwrap(method="MINIMUM_STRETCH")


#: The last is along the seams that the first has marked: it needs some.
METHODS = [
    ("Flatten Anything", flatten_anything),
    ("Smart UV Project", smart_project),
    ("Minimum Stretch, along the seams of Flatten Anything", minimum_stretch),
]


def rows(name, one):
    for title, method in METHODS:
        scenes.edit(one)
        started = time.perf_counter()
        method()
        seconds = time.perf_counter() - started
        if method is not flatten_anything:
            bpy.ops.uv.select_all(action="SELECT")
            bpy.ops.uv.pack_islands(margin=4 / 2048)
        scenes.leave()
        found = scenes.measured(one.data)
        area = covered(one.data)
        charts, seams, energy, flips, overlaps = (found[column] for column in COLUMNS)
        print(
            f"| {name} | {title} | {seconds:.2f} | {charts} | {seams:.2f} | {energy:.4g} "
            f"| {flips} | {overlaps} | {100 * area:.0f} |"
        )


def covered(mesh):
    """The area of the triangles in the unit square."""
    _, _, corners = scenes.triangles(mesh)
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    twice = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    return float(abs(twice).sum() / 2)


def checkered(mesh):
    image = bpy.data.images.new("checker", 1024, 1024)
    image.generated_type = "COLOR_GRID"
    material = bpy.data.materials.new("checker")
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    texture = nodes.new("ShaderNodeTexImage")
    texture.image = image
    links.new(texture.outputs["Color"], nodes["Principled BSDF"].inputs["Base Color"])
    mesh.materials.clear()
    mesh.materials.append(material)


def render(path):
    """Suzanne, subdivided, with a checker texture: by the extension and by Smart UV Project."""
    bpy.ops.wm.read_homefile(use_empty=True)
    for x, (_, method) in zip((-1.35, 1.35), METHODS, strict=False):
        one = scenes.monkey(1)
        one.location.x = x
        scenes.edit(one)
        method()
        scenes.leave()
        one.data.shade_smooth()
        checkered(one.data)
    bpy.ops.object.camera_add(location=(0, -7.5, 0.4), rotation=(1.52, 0, 0))
    scene = bpy.context.scene
    scene.camera = scenes.active()
    bpy.ops.object.light_add(type="SUN", rotation=(0.6, 0.3, 0))
    scenes.active().data.energy = 3
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (1, 1, 1, 1)
    scene.render.engine = "CYCLES"
    scene.cycles.samples = 24
    scene.render.resolution_x, scene.render.resolution_y = 1200, 600
    scene.render.filepath = str(Path(path).resolve())
    bpy.ops.render.render(write_still=True)


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--render")
    arguments.add_argument("meshes", nargs="*")
    given = arguments.parse_args()
    [zip_file] = conftest.DIST.glob("*.zip")
    bpy.ops.extensions.package_install_files(
        filepath=str(zip_file), repo="user_default", enable_on_install=True
    )
    print(f"Blender {bpy.app.version_string}\n")
    print(
        "| mesh | layout by | seconds | charts | seam length | energy | flips | overlaps "
        "| coverage, % |\n| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"
    )
    if not given.meshes:
        for subdivisions in range(3):
            bpy.ops.wm.read_homefile(use_empty=True)
            rows(f"Suzanne, subdivided {subdivisions} times", scenes.monkey(subdivisions))
    for path in given.meshes:
        bpy.ops.wm.read_homefile(use_empty=True)
        bpy.ops.wm.obj_import(filepath=path)
        rows(Path(path).stem, scenes.active())
    if given.render:
        render(given.render)


if __name__ == "__main__":
    main()
