"""One layout of one surface by one peer, in a process of its own; `layouts` starts it.

    lay_out.py PEER                          prints the peer's version
    lay_out.py PEER SURFACE OBJ JSON LIMIT   writes OBJ, if there is a layout, and JSON, what came of it
"""

import importlib
import json
import os
import signal
import sys
import time
from importlib.metadata import version

import numpy as np

import obj


def by_atlas(peer, surface):
    from atlases import PEERS

    started = time.perf_counter()
    uvs, corners = PEERS[peer](surface.vertices, surface.faces)
    return uvs, corners, time.perf_counter() - started, False


def by_igl(peer, surface):
    from flatten import by_igl

    return by_igl(peer, surface)


def by_blender(peer, surface):
    from blender import by_blender

    return by_blender(peer, surface)


# The function that lays out, the package on PyPI, and its module.
PEERS = {
    "slim": (by_igl, "libigl", "igl"),
    "lscm": (by_igl, "libigl", "igl"),
    "xatlas": (by_atlas, "xatlas", "xatlas"),
    "uvunwrap": (by_atlas, "uvunwrap", "uvunwrap"),
    "smart-uv-project": (by_blender, "bpy", "bpy"),
    "minimum-stretch": (by_blender, "bpy", "bpy"),
}


def outcome(peer, surface, out):
    """Lays out, writes the OBJ, and tells what goes into the JSON."""
    lay_out, _, module = PEERS[peer]
    parent = os.getppid()
    try:
        importlib.import_module(module)
        surface = obj.read(surface)
        uvs, corners, seconds, is_cut = lay_out(peer, surface)
        if not np.isfinite(uvs).all():
            raise obj.Refused("a UV is not finite")
        if len(corners) != len(surface.faces):
            raise obj.Refused("triangles are missing")
        if os.getppid() != parent:
            sys.exit("nobody waits for this layout any more, and another may be on its way")
        obj.write(out, surface.vertices, surface.faces, uvs, corners)
    except obj.Refused as reason:
        return {"reason": str(reason)}
    except Exception as error:
        return {"reason": " ".join(f"{type(error).__name__}: {error}".split())}
    return {"seconds": seconds, **({"cut": True} if is_cut else {})}


def main():
    peer = sys.argv[1]
    _, package, module = PEERS[peer]
    if len(sys.argv) == 2:
        importlib.import_module(module)
        print(version(package))
        return
    _, _, surface, out, result, limit = sys.argv
    # Where nobody is left to end this process, it ends by itself.
    signal.alarm(int(float(limit)) + 2)
    with open(result, "w") as file:
        json.dump(outcome(peer, surface, out), file)


if __name__ == "__main__":
    main()
