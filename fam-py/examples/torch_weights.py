"""The networks of a trained map in PyTorch: exported weights in modules with the paper's names.

    python torch_weights.py [ITERATIONS]

Trains a map of a torus, exports its weights by `fam export`, loads them strictly into the modules
below, which are those of the authors' program, and compares the UVs of both. Needs PyTorch.
"""

import itertools
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn

import flatten_anything as fa

#: Largest difference of two UVs, for a square of side 1.
TOLERANCE = 1e-4


class Layer(nn.Module):
    """A linear layer as a convolution of width 1."""

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__()
        self.conv = nn.Conv1d(inputs, outputs, 1)

    def forward(self, x: Tensor) -> Tensor:
        """Return `[1, outputs, N]` of `[1, inputs, N]`."""
        return self.conv(x)


def stack(*channels: int) -> nn.Sequential:
    """Return linear layers; activations are applied between them."""
    return nn.Sequential(*(Layer(*pair) for pair in itertools.pairwise(channels)))


def run(layers: nn.Sequential, x: Tensor) -> Tensor:
    """Apply layers with LeakyReLU after each but the last."""
    for layer in layers[:-1]:
        x = nn.functional.leaky_relu(layer(x), 0.01)
    return layers[-1](x)


class Two(nn.Module):
    """Two stacks: the second takes the input and what the first makes of it."""

    def __init__(self, inputs: int, outputs: int, width: int, latent: int, hidden: int) -> None:
        super().__init__()
        self.mlp_1 = stack(inputs, *[width] * hidden, latent)
        self.mlp_2 = stack(inputs + latent, *[width] * hidden, outputs)

    def forward(self, x: Tensor) -> Tensor:
        """Return `[1, outputs, N]` of `[1, inputs, N]`."""
        return run(self.mlp_2, torch.cat([x, run(self.mlp_1, x)], 1))


class Unwrapping(nn.Module):
    """Cut-Net and Unwrap-Net."""

    def __init__(self, width: int, latent: int) -> None:
        super().__init__()
        self.cut = Two(3, 3, width, latent, 2)
        self.mlp = stack(3, width, width, 2)

    def forward(self, x: Tensor) -> Tensor:
        """Return Q `[1, 2, N]` of P `[1, 3, N]`."""
        return run(self.mlp, x + self.cut(x))


class FlattenAnything(nn.Module):
    """The four networks under the names of the authors' program."""

    def __init__(self, width: int, unwrap_width: int, latent: int) -> None:
        super().__init__()
        self.grid_deforming = Two(2, 2, width, latent, 3)
        self.wrapping = Two(2, 6, width, latent, 3)
        self.unwrapping = Unwrapping(unwrap_width, latent)


def torus(around: int = 32, across: int = 16) -> tuple[np.ndarray, np.ndarray]:
    """Return the vertices and triangles of a torus."""
    i, j = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    u, v = 2 * np.pi * i / around, 2 * np.pi * j / across
    radius = 1 + 0.4 * np.cos(v)
    vertices = np.stack([radius * np.cos(u), radius * np.sin(u), 0.4 * np.sin(v)], -1)
    a, b = i * across + j, (i + 1) % around * across + j
    c, d = (i + 1) % around * across + (j + 1) % across, i * across + (j + 1) % across
    triangles = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)])
    return vertices.reshape(-1, 3), triangles.reshape(-1, 3)


def main() -> None:
    """Compare the UVs of a map with those of its weights in PyTorch."""
    iterations = int(sys.argv[1]) if len(sys.argv) > 1 else 300
    vertices, faces = torus()
    trained = fa.train(vertices, faces, iterations=iterations)
    with tempfile.TemporaryDirectory() as folder:
        model, weights = Path(folder, "model.safetensors"), Path(folder, "weights.pth")
        trained.save(model)
        program = [sys.executable, "-m", "flatten_anything"]
        subprocess.run([*program, "export", model, "-o", weights], check=True)
        state = torch.load(weights, weights_only=True)
    width, latent = state["wrapping.mlp_1.0.conv.bias"].numel(), state["wrapping.mlp_1.3.conv.bias"]
    unwrap_width = state["unwrapping.mlp.0.conv.bias"].numel()
    networks = FlattenAnything(width, unwrap_width, latent.numel())
    networks.load_state_dict(state, strict=True)

    # The unit ball around the center of the bounding box.
    center = (vertices.min(0) + vertices.max(0)) / 2
    points = (vertices - center) / np.linalg.norm(vertices - center, axis=1).max()
    with torch.no_grad():
        inputs = torch.from_numpy(points.T[None].astype(np.float32))
        q = networks.unwrapping(inputs)[0].T.double().numpy()
    # The map turns and scales Q into the unit square.
    uvs = trained.uvs(vertices)
    known = np.column_stack([q, np.ones(len(q))])
    frame, *_ = np.linalg.lstsq(known, uvs, rcond=None)
    difference = np.abs(known @ frame - uvs).max()
    print(f"{len(state)} tensors; largest difference of two UVs: {difference:.1e}")
    if difference > TOLERANCE:
        sys.exit("the networks are not those of the map")


if __name__ == "__main__":
    main()
