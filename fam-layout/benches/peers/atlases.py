"""Layouts by unwrappers that find their own charts: UVs [N, 2] and triangles [T, 3] into them."""

import numpy as np


def by_xatlas(vertices, faces):
    """By xatlas with its defaults, with room for the padding of a texture of 2,048 pixels."""
    import xatlas

    atlas = xatlas.Atlas()
    atlas.add_mesh(vertices.astype(np.float32), faces.astype(np.uint32))
    options = xatlas.PackOptions()
    options.resolution, options.padding = 2048, 4
    atlas.generate(pack_options=options)
    _, indices, uvs = atlas[0]
    return uvs, indices


def by_uvunwrap(vertices, faces):
    """By uvunwrap with its defaults."""
    import uvunwrap

    mesh = uvunwrap.Mesh(vertices.ravel().tolist(), faces.ravel().tolist())
    output = uvunwrap.generate([mesh]).meshes[0]
    uvs = np.array(output.uv, np.float64).reshape(-1, 2)
    return uvs, np.array(output.indices, np.uint32).reshape(-1, 3)


PEERS = {"xatlas": by_xatlas, "uvunwrap": by_uvunwrap}
