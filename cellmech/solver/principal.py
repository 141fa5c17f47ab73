"""Principal values of the strain at many points."""

from __future__ import annotations

from typing import Any

import numpy as np

ENTRIES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))  # of a symmetric tensor


def entries_of(tensor: Any) -> list[Any]:
    """The entries of a symmetric UFL tensor in the order of `ENTRIES`."""
    return [tensor[i, j] for i, j in ENTRIES]


def symmetric(entries: np.ndarray) -> np.ndarray:
    """Symmetric tensors, shape (..., 3, 3), from their entries, shape (..., 6)."""
    found = np.empty((*entries.shape[:-1], 3, 3))
    for k, (i, j) in enumerate(ENTRIES):
        found[..., i, j] = found[..., j, i] = entries[..., k]
    return found


def principal_values(entries: np.ndarray) -> np.ndarray:
    """Principal values of symmetric tensors from their entries, shape (n, 6), in any order; shape (3, n)."""
    if np.any(entries[:, 4:]):
        return np.linalg.eigvalsh(symmetric(entries)).T
    xx, yy, zz, xy = entries.T[:4]  # z is an axis
    mean, half = (xx + yy) / 2, np.hypot((xx - yy) / 2, xy)
    return np.stack([mean - half, mean + half, zz])


def principal_stretches(E: np.ndarray) -> np.ndarray:
    """The least and the greatest principal stretch [-], sqrt(1 + 2 e); shape (n, 2), of strains E as `ENTRIES`."""
    e = principal_values(E)
    return np.sqrt(1 + 2 * np.stack([e.min(axis=0), e.max(axis=0)], axis=-1))
