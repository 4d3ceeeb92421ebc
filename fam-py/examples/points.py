"""UVs for a point cloud, and for points that were not in it.

    python examples/points.py [ITERATIONS]

The networks learn from the points alone. Few iterations are quick and rough; without a number it
is the preset's.
"""

import sys

import numpy as np

import flatten_anything as fa


def main() -> None:
    """Unwrap a cloud on a hemisphere and map other points of it."""
    rng = np.random.default_rng(0)
    points = rng.standard_normal((4000, 3))
    points[:, 2] = abs(points[:, 2])
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    layout = fa.unwrap_points(
        points[:3000],
        points[:3000],  # of a sphere, positions are normals
        iterations=int(sys.argv[1]) if len(sys.argv) > 1 else None,
        progress=lambda now: print(f"\r{now.stage} {now.fraction:4.0%}", end=""),
    )
    print(f"\n{len(layout.seams)} of {len(layout.uvs)} points lie on seams")
    # The map gives UVs to any point, and says how they change.
    others = layout.map.uvs(points[3000:])
    stretch = np.linalg.norm(layout.map.jacobian(points[3000:]), axis=(1, 2))
    print(f"other points: {others.shape}, stretch {stretch.min():.2f} to {stretch.max():.2f}")


if __name__ == "__main__":
    main()
