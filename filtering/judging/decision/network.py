"""The network: attention between the demonstrations of a pool that sees what two have in common."""

import math
from dataclasses import dataclass

import torch
from torch import Tensor, nn

FAR = 4.0
"""Largest standardised value of a column; odd pools must not leave the range of the training."""


@dataclass(frozen=True)
class Shape:
    """Sizes of a network."""

    columns: int
    """F, columns of a demonstration."""
    pairs: int
    """P, columns of a pair of demonstrations."""
    facts: int
    """Number of answers about the pool as a whole."""
    width: int = 64
    """Width of the hidden layers."""
    heads: int = 4
    """Number of attention heads."""
    depth: int = 3
    """Number of attention blocks."""


class Block(nn.Module):
    """Attention between demonstrations, biased by what pairs have in common; then a perceptron."""

    def __init__(self, shape: Shape) -> None:
        super().__init__()
        width = shape.width
        self.heads = shape.heads
        self.before, self.after = nn.LayerNorm(width), nn.LayerNorm(width)
        self.triple, self.out = nn.Linear(width, 3 * width), nn.Linear(width, width)
        self.bias = nn.Linear(shape.pairs, shape.heads)
        self.inner, self.outer = nn.Linear(width, 2 * width), nn.Linear(2 * width, width)

    def forward(self, hidden: Tensor, pairs: Tensor, mask: Tensor) -> Tensor:
        """Return the hidden states (B, D, width) after the block."""
        pools, demos, width = hidden.shape
        triple = self.triple(self.before(hidden)).reshape(pools, demos, 3, self.heads, -1)
        query, key, value = triple.permute(2, 0, 3, 1, 4)
        logits = query @ key.transpose(-1, -2) / math.sqrt(query.shape[-1])
        logits = logits + self.bias(pairs).permute(0, 3, 1, 2)
        shares = logits.masked_fill(~mask[:, None, None, :], -1e4).softmax(-1)
        mixed = (shares @ value).transpose(1, 2).reshape(pools, demos, width)
        hidden = hidden + self.out(mixed)
        added: Tensor = self.outer(nn.functional.gelu(self.inner(self.after(hidden))))
        return hidden + added


class DecisionNetwork(nn.Module):
    """From described pools to logits: incorrect, per demonstration, and the facts of the pool."""

    centre: Tensor
    scale: Tensor

    def __init__(self, shape: Shape, dropout: float = 0.0) -> None:
        super().__init__()
        self.shape = shape
        self.register_buffer("centre", torch.zeros(shape.columns))
        self.register_buffer("scale", torch.ones(shape.columns))
        self.enter = nn.Linear(shape.columns, shape.width)
        self.drop = nn.Dropout(dropout)
        self.blocks = nn.ModuleList(Block(shape) for _ in range(shape.depth))
        self.norm = nn.LayerNorm(shape.width)
        self.demo = nn.Linear(shape.width, 1)
        self.pool = nn.Sequential(
            nn.Linear(2 * shape.width + 2, 32), nn.GELU(), nn.Linear(32, shape.facts)
        )

    def forward(self, rows: Tensor, pairs: Tensor, mask: Tensor) -> tuple[Tensor, Tensor]:
        """Return logits (B, D) and (B, facts).

        Args:
            rows: (B, D, F) squashed columns.
            pairs: (B, D, D, P) columns of pairs.
            mask: (B, D) False for padding.
        """
        hidden = self.enter(self.drop(((rows - self.centre) / self.scale).clamp(-FAR, FAR)))
        for block in self.blocks:
            hidden = block(hidden, pairs, mask)
        hidden = self.norm(hidden)
        logits = self.demo(hidden)[..., 0]
        inside = mask[..., None].to(hidden.dtype)
        mean = (hidden * inside).sum(1) / inside.sum(1)
        most = hidden.masked_fill(~mask[..., None], -1e4).amax(1)
        top = logits.masked_fill(~mask, -1e4).amax(1, keepdim=True)
        share = (logits.sigmoid() * mask).sum(1, keepdim=True) / inside.sum(1)
        return logits, self.pool(torch.cat([mean, most, top, share], 1))


def squash(values: Tensor) -> Tensor:
    """Return sign(x) log(1 + |x|), so that large counts and log-odds keep their order."""
    return torch.sign(values) * torch.log1p(torch.abs(values))
