"""The neighbours that one iteration asks for, by scipy's k-d tree and by brute force in PyTorch.

Points as in fam-core/benches/neighbors.rs: the 8 nearest of each of 10,000 points in
the plane, and the nearest of each of two samples of a torus in the other.
"""

import argparse
import statistics
import time

import numpy as np
import torch
from scipy.spatial import cKDTree

POINTS = 10_000


def torus(random):
    around, across = random.uniform(0, 2 * np.pi, (2, POINTS))
    radius = 1 + 0.4 * np.cos(across)
    return np.stack([radius * np.cos(around), radius * np.sin(around), 0.4 * np.sin(across)], 1)


def tree(points, queries, k):
    return cKDTree(points).query(queries, k, workers=-1)[1]


def brute_force(points, queries, k):
    return torch.cdist(queries, points).topk(k, largest=False).indices


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--device", default="cpu")
    device = parser.parse_args().device
    random = np.random.default_rng(0)
    arrays = [random.uniform(0, 1, (POINTS, 2)), torus(random), torus(random)]
    arrays = [array.astype(np.float32) for array in arrays]
    tensors = [torch.tensor(array, device=device) for array in arrays]

    def search(how, q, p, p_hat):
        found = [how(q, q, 9), how(p, p_hat, 1), how(p_hat, p, 1)]
        return float(found[-1].reshape(-1)[-1])  # waits for the device

    for name, how, points in [
        ("scipy k-d tree", tree, arrays),
        ("PyTorch brute force", brute_force, tensors),
    ]:
        seconds = []
        for _ in range(8):
            before = time.perf_counter()
            search(how, *points)
            seconds.append(time.perf_counter() - before)
        print(f"{name}: {statistics.median(seconds[1:]) * 1e3:.1f} ms an iteration")


main()
