"""Layouts of the same meshes by fam and its peers, scored by `fam metrics`; see `run`."""

import argparse
import json
import multiprocessing
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import obj
from atlases import PEERS

COLUMNS = [
    ("charts", "charts", "{:d}"),
    ("seam length", "seam_length", "{:.2f}"),
    ("energy", "symmetric_dirichlet", "{:.4g}"),
    ("flips", "flipped_triangles", "{:d}"),
    ("overlaps", "overlapping_pairs", "{:d}"),
    ("coverage, %", "uv_coverage", "{:.0%}"),
]


def read(path):
    """The vertices [V, 3] and triangles [T, 3] of a mesh, as the file has them."""
    import trimesh

    mesh = trimesh.load(path, process=False, maintain_order=True, force="mesh")
    return np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.uint32)


def work(peer, path, out, sender):
    """Lays out one mesh and sends the seconds that the peer itself took."""
    vertices, faces = read(path)
    started = time.perf_counter()
    uvs, indices = PEERS[peer](vertices, faces)
    sender.send(time.perf_counter() - started)
    obj.write(out, vertices, faces, uvs, indices)


def peer_row(fam, peer, path, limit):
    """Seconds and metrics of a peer's layout, or why there is none."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out.obj"
        receiver, sender = multiprocessing.Pipe(duplex=False)
        process = multiprocessing.Process(target=work, args=(peer, path, out, sender))
        process.start()
        sender.close()
        if not receiver.poll(limit):
            process.kill()
            process.join()
            return None, f"not done in {limit:.0f} s"
        try:
            seconds = receiver.recv()
        except EOFError:
            return None, "failed"
        process.join()
        if process.exitcode != 0:
            return None, "failed"
        metrics = subprocess.run([fam, "metrics", out, "--json"], capture_output=True, text=True)
        if metrics.returncode != 0:
            return None, "its UVs cannot be measured"
        return seconds, json.loads(metrics.stdout)


def fam_row(fam, path, limit):
    """The same of `fam unwrap` with its defaults; what reading and writing take is left out."""
    with tempfile.TemporaryDirectory() as folder:
        command = [fam, "unwrap", path, "--json", "--quiet", "-o", Path(folder) / "out"]
        try:
            run = subprocess.run(command, capture_output=True, text=True, timeout=limit)
        except subprocess.TimeoutExpired:
            return None, f"not done in {limit:.0f} s"
        if run.returncode != 0:
            return None, run.stderr.strip().splitlines()[-1]
        summary = json.loads(run.stdout)
        return summary["finishing_seconds"], summary["mesh"]


def cells(seconds, metrics):
    if seconds is None:
        return [metrics] + [""] * len(COLUMNS)
    return [f"{seconds:.2f}"] + [form.format(metrics[key] or float("inf")) if key == "symmetric_dirichlet"
                                 else form.format(metrics[key]) for _, key, form in COLUMNS]


def processor():
    """The processor's name, where the system tells it."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--fam", required=True)
    parser.add_argument("--limit", type=float, default=150.0, help="seconds for one layout")
    parser.add_argument("--repeat", type=int, default=1, help="the median of so many runs counts")
    parser.add_argument("meshes", nargs="+", type=Path)
    arguments = parser.parse_args()
    fam, limit = arguments.fam, arguments.limit
    print(f"{processor()}, {multiprocessing.cpu_count()} cores\n")
    titles = ["mesh", "layout by", "seconds"] + [title for title, _, _ in COLUMNS]
    print("| " + " | ".join(titles) + " |")
    print("| --- | --- |" + " ---: |" * (len(titles) - 2))
    for path in arguments.meshes:
        for name in ["fam", *PEERS]:
            rows = []
            for _ in range(arguments.repeat):
                row = fam_row(fam, path, limit) if name == "fam" else peer_row(fam, name, path, limit)
                rows.append(row)
                if row[0] is None:
                    break
            seconds = None
            if rows[-1][0] is not None:
                seconds = statistics.median(row[0] for row in rows)
            print("| " + " | ".join([path.stem, name, *cells(seconds, rows[-1][1])]) + " |")
            sys.stdout.flush()


if __name__ == "__main__":
    main()
