"""A generated mesh with UVs and a baked texture, written as GLB.

    python examples/texture.py [OUT.glb]

The colour of every point of the surface is known by a formula, as a generator knows it from its
volume. Each texel takes the colour of the point of the surface that it lies on; texels around
charts take that of the nearest, so that no seam shows. Needs trimesh and Pillow.
"""

import sys

import numpy as np
import trimesh
from PIL import Image

import flatten_anything as fa

SIZE = 512


def color(points: np.ndarray) -> np.ndarray:
    """Return the colour of points [N, 3], as RGB from 0 to 255."""
    waves = 0.5 + 0.5 * np.sin(9 * points + [0, 2, 4])
    return (255 * waves).astype(np.uint8)


def bake(corners: np.ndarray, uvs: np.ndarray) -> Image.Image:
    """Return a texture for triangles [M, 3, 3] with the UVs [M, 3, 2]."""
    pixels = np.zeros((SIZE, SIZE, 3), dtype=np.uint8)
    distance = np.full((SIZE, SIZE), np.inf)
    for place, uv in zip(corners, uvs * SIZE - 0.5, strict=True):
        low = np.maximum(np.floor(uv.min(axis=0)).astype(int) - 2, 0)
        high = np.minimum(np.ceil(uv.max(axis=0)).astype(int) + 3, SIZE)
        x, y = np.meshgrid(np.arange(low[0], high[0]), np.arange(low[1], high[1]))
        edges = np.stack([uv[1] - uv[0], uv[2] - uv[0]], axis=1)
        if abs(np.linalg.det(edges)) < 1e-9:
            continue
        inner = np.linalg.solve(edges, np.stack([x.ravel(), y.ravel()]) - uv[0][:, None])
        weights = np.stack([1 - inner.sum(axis=0), *inner], axis=1)
        # Inside a triangle no weight is negative.
        outside = np.maximum(-weights.min(axis=1), 0).reshape(x.shape)
        closer = outside < distance[y, x]
        distance[y[closer], x[closer]] = outside[closer]
        inside = np.clip(weights, 0, None)
        inside /= inside.sum(axis=1, keepdims=True)
        pixels[y[closer], x[closer]] = color(inside @ place).reshape(*x.shape, 3)[closer]
    return Image.fromarray(pixels[::-1])


def main() -> None:
    """Make a mesh, unwrap it, bake its texture and write it."""
    mesh = trimesh.creation.torus(1.0, 0.4)
    layout = fa.from_trimesh(mesh)
    print({name: layout.metrics[name] for name in ("charts", "symmetric_dirichlet")})
    texture = bake(mesh.triangles, np.asarray(layout.uvs))
    textured = fa.to_trimesh(mesh, layout)
    textured.visual.material = trimesh.visual.material.PBRMaterial(baseColorTexture=texture)
    out = sys.argv[1] if len(sys.argv) > 1 else "textured.glb"
    textured.export(out)
    print(f"wrote {out}")


if __name__ == "__main__":
    main()
