"""One training step of the paper's objective in PyTorch, timed.

`reference` computes as the authors' program does: convolutions of width 1 and Jacobians by double
backward. `tuned` has linear layers and forward tangents. Both Jacobians, one torus, weights of
their own: the loss only shows that it is a step and not noise.
"""

import argparse
import math
import statistics
import time

import numpy as np
import torch
from scipy.spatial import cKDTree
from torch import nn

SLOPE = 0.01
LATENT = 64


class Mlp(nn.Module):
    def __init__(self, channels, tuned):
        super().__init__()
        pairs = zip(channels, channels[1:])
        layer = nn.Linear if tuned else (lambda a, b: nn.Conv1d(a, b, 1))
        self.layers = nn.ModuleList(layer(a, b) for a, b in pairs)
        self.tuned = tuned

    def forward(self, x):
        x = x if self.tuned else x.T[None]
        for i, layer in enumerate(self.layers):
            x = layer(x)
            if i + 1 < len(self.layers):
                x = nn.functional.leaky_relu(x, SLOPE)
        return x if self.tuned else x[0].T

    def push(self, x, tangents):
        for i, layer in enumerate(self.layers):
            x = layer(x)
            tangents = [t @ layer.weight.T for t in tangents]
            if i + 1 < len(self.layers):
                slope = torch.where(x > 0, 1.0, SLOPE)
                x, tangents = x * slope, [t * slope for t in tangents]
        return x, tangents


class Twofold(nn.Module):
    """ξ″([x, ξ′(x)])."""

    def __init__(self, inner, outer, tuned):
        super().__init__()
        self.inner, self.outer = Mlp(inner, tuned), Mlp(outer, tuned)

    def forward(self, x):
        return self.outer(torch.cat([x, self.inner(x)], 1))

    def push(self, x, tangents):
        latent, pushed = self.inner.push(x, tangents)
        beside = [torch.cat(pair, 1) for pair in zip(tangents, pushed)]
        return self.outer.push(torch.cat([x, latent], 1), beside)


class Model(nn.Module):
    def __init__(self, width, unwrap_width, tuned):
        super().__init__()
        w, u, h = width, unwrap_width, LATENT
        self.tuned = tuned
        self.deform = Twofold([2, w, w, w, h], [2 + h, w, w, w, 2], tuned)
        self.wrap = Twofold([2, w, w, w, h], [2 + h, w, w, w, 6], tuned)
        self.cut = Twofold([3, u, u, h], [3 + h, u, u, 3], tuned)
        self.unwrap = Mlp([3, u, u, 2], tuned)

    def flatten(self, p):
        return self.unwrap(self.cut(p) + p)

    def wrap_with_jacobian(self, q):
        if self.tuned:
            axes = [axis.expand_as(q) for axis in torch.eye(2, device=q.device)]
            y, columns = self.wrap.push(q, axes)
            return y, [column[:, :3] for column in columns]
        y = self.wrap(q)
        rows = [
            torch.autograd.grad(y[:, k].sum(), q, create_graph=True)[0] for k in range(3)
        ]
        return y, torch.stack(rows, 1).unbind(2)


def nearest(points, queries, k=1):
    if points.is_cuda:
        distances = torch.cdist(queries.detach(), points.detach())
        return distances.topk(k, largest=False).indices.squeeze(1)
    tree = cKDTree(points.detach().cpu().numpy())
    _, indices = tree.query(queries.detach().cpu().numpy(), k, workers=-1)
    return torch.from_numpy(indices).to(points.device)


def conformality(columns):
    u, v = columns
    e, f, g = (u * u).sum(1), (u * v).sum(1), (v * v).sum(1)
    return ((e - g) ** 2 + 4 * f * f).clamp_min(1e-16).sqrt().mean()


def loss(model, p, normals, grid):
    q_hat = model.deform(grid) + grid
    wrapped, jacobian_g = model.wrap_with_jacobian(q_hat)
    p_hat = wrapped[:, :3]
    q_hat_cycle = model.flatten(p_hat)
    q = model.flatten(p)
    cycle, jacobian_f = model.wrap_with_jacobian(q)
    chamfer = torch.maximum(
        (p_hat - p[nearest(p, p_hat)]).norm(dim=1).mean(),
        (p - p_hat[nearest(p_hat, p)]).norm(dim=1).mean(),
    )
    side = (q.detach().amax(0) - q.detach().amin(0)).max()
    epsilon = 0.2 * side / math.sqrt(len(q))
    squared = (q[nearest(q, q, 9)[:, 1:]] - q[:, None]).pow(2).sum(2)
    unwrap = (epsilon - (squared + 1e-8).sqrt()).clamp_min(0).mean()
    cycles = (
        (p - cycle[:, :3]).abs().mean()
        + (q_hat - q_hat_cycle).abs().mean()
        + (1 - torch.cosine_similarity(normals, cycle[:, 3:])).mean()
    )
    conformal = conformality(jacobian_f) + conformality(jacobian_g)
    return chamfer + 0.01 * (unwrap + cycles + conformal)


def torus(count, device):
    around, across = np.random.default_rng(0).uniform(0, 2 * math.pi, (2, count))
    circle = np.stack([np.cos(around), np.sin(around), 0 * around], 1)
    normals = circle * np.cos(across)[:, None] + np.sin(across)[:, None] * [0, 0, 1]
    points = (circle + 0.4 * normals) / 1.4
    return [torch.tensor(a, dtype=torch.float32, device=device) for a in (points, normals)]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--width", type=int, default=512)
    parser.add_argument("--unwrap-width", type=int)
    parser.add_argument("--points", type=int, default=10_000)
    parser.add_argument("--steps", type=int, default=5)
    parser.add_argument("--device", default="cpu")
    options = parser.parse_args()
    points, normals = torus(options.points, options.device)
    line = torch.linspace(-1, 1, math.ceil(math.sqrt(options.points)))
    grid = torch.cartesian_prod(line, line).to(options.device)
    for name in ["reference", "tuned"]:
        torch.manual_seed(0)
        model = Model(options.width, options.unwrap_width or options.width, name == "tuned").to(options.device)
        adam = torch.optim.AdamW(model.parameters(), 1e-3, weight_decay=1e-8)
        seconds = []
        # The first step allocates and is not counted.
        for _ in range(options.steps + 1):
            before = time.perf_counter()
            adam.zero_grad()
            total = loss(model, points, normals, grid)
            total.backward()
            adam.step()
            value = total.item()
            seconds.append(time.perf_counter() - before)
        step = statistics.median(seconds[1:]) * 1e3
        print(f"PyTorch {torch.__version__}, {name}: {step:.1f} ms a step, loss {value:.5f}")


main()
