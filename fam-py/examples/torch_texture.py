"""UVs inside PyTorch: a texture is learnt, then a shifted scan finds its place by it.

    python examples/torch_texture.py [ITERATIONS]

A trained map gives UVs and their derivatives, so gradients flow from colours to UVs, points and the
shift of the scan. Few iterations are rough; without a number it is the preset's. Needs PyTorch.
"""

import sys

import numpy as np
import torch
from torch.nn import functional

import flatten_anything as fa


class Uvs(torch.autograd.Function):
    """The UVs [N, 2] of points [N, 3] by a trained map, with their derivatives."""

    @staticmethod
    def forward(ctx, points, trained):
        """Return the UVs."""
        ctx.save_for_backward(points)
        ctx.trained = trained
        return torch.from_numpy(trained.uvs(points.numpy(force=True))).to(points)

    @staticmethod
    def backward(ctx, gradient):
        """Return the gradient by the points; there is none by the map."""
        jacobian = ctx.trained.jacobian(ctx.saved_tensors[0].numpy(force=True))
        return torch.einsum("ni,nij->nj", gradient, torch.from_numpy(jacobian).to(gradient)), None


def color(points):
    """Return the colour of points [N, 3] of the surface, as RGB from 0 to 1."""
    return 0.5 + 0.5 * torch.sin(4 * points + torch.tensor([0.0, 2.0, 4.0]))


def sample(texture, uvs):
    """Return the colours [N, 3] of a texture [1, 3, H, W] at UVs [N, 2]."""
    found = functional.grid_sample(texture, 2 * uvs[None, None] - 1, align_corners=False)
    return found[0, :, 0].T


def fit(parameter, rate, wanted, found):
    """Change a parameter until the colours found are those wanted."""
    optimizer = torch.optim.Adam([parameter], lr=rate)
    losses = []
    for _ in range(100):
        optimizer.zero_grad()
        losses.append(functional.mse_loss(found(), wanted))
        losses[-1].backward()
        optimizer.step()
    print(f"loss {losses[0]:.4f}, at the end {losses[-1]:.4f}")
    assert losses[-1] < 0.5 * losses[0]


def main() -> None:
    """Train a map of a terrain, check its gradient, learn a texture and find a shift."""
    torch.manual_seed(0)
    points = 2 * torch.rand(2000, 3) - 1
    points[:, 2] = 0.3 * torch.sin(3 * points[:, 0]) * torch.cos(2 * points[:, 1])
    iterations = int(sys.argv[1]) if len(sys.argv) > 1 else None
    trained = fa.train(points, iterations=iterations)

    # The gradient is what finite differences say, except where a step crosses a kink of the map.
    moving = points.clone().requires_grad_()
    Uvs.apply(moving, trained).sum().backward()
    way = functional.normalize(torch.randn_like(points))
    high, low = trained.uvs(points + 1e-3 * way), trained.uvs(points - 1e-3 * way)
    slope = (high - low).sum(axis=1) / 2e-3
    error = abs((moving.grad * way).sum(dim=1).numpy() - slope)
    print(f"gradient: median error {np.median(error):.0e}")
    assert np.median(error) < 1e-3

    texture = torch.full((1, 3, 64, 64), 0.5, requires_grad=True)
    uvs, colors = Uvs.apply(points, trained), color(points)
    fit(texture, 0.1, colors, lambda: sample(texture, uvs))

    # The scan has the colours of the points, but lies elsewhere.
    learnt, scan = texture.detach(), points + torch.tensor([0.1, -0.15, 0.05])
    shift = torch.zeros(3, requires_grad=True)
    fit(shift, 0.01, colors, lambda: sample(learnt, Uvs.apply(scan + shift, trained)))
    print(f"the scan moved by {shift.detach().numpy().round(2)}")


if __name__ == "__main__":
    main()
