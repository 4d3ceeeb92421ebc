"""Usage: read_mesh.py (trimesh | meshio) FILE...

Prints meshes and point clouds as another program sees them, as JSON: {FILE: {faces, points}, ...}.
Faces are lists of corners; there are points only if there are no faces. A corner or a point is
its position and UV, or its position alone where the program sees no UV. V points up.
"""

import json
import sys

import numpy


def main():
    tool, *paths = sys.argv[1:]
    read = {"trimesh": with_trimesh, "meshio": with_meshio}[tool]
    seen = {}
    for path in paths:
        faces, points = read(path)
        seen[path] = {"faces": faces, "points": points}
    json.dump(seen, sys.stdout)


def with_trimesh(path):
    import trimesh

    faces, points = [], []
    scene = trimesh.load_scene(path, process=False)
    for node in scene.graph.nodes_geometry:
        transform, name = scene.graph[node]
        geometry = scene.geometry[name]
        vertices = trimesh.transform_points(geometry.vertices, transform)
        uvs = getattr(geometry.visual, "uv", None)
        if uvs is not None:
            vertices = numpy.hstack([vertices, uvs])
        if isinstance(geometry, trimesh.Trimesh):
            faces += vertices[geometry.faces].tolist()
        else:
            points += vertices.tolist()
    return faces, points


def with_meshio(path):
    import meshio

    mesh = meshio.read(path)
    data = mesh.point_data
    vertices = mesh.points
    if "obj:vt" in data:
        vertices = numpy.hstack([vertices, data["obj:vt"]])
    elif "s" in data:
        vertices = numpy.column_stack([vertices, data["s"], data["t"]])
    if not mesh.cells:
        return [], vertices.tolist()
    return [vertices[face].tolist() for cells in mesh.cells for face in cells.data], []


main()
