"""How far points, and a body's boundary, are from obstacles."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from dolfinx import fem
from mpi4py import MPI

from cellmech.fem.outline import Outline
from cellmech.fem.surface import Surface
from cellmech.mechanics.obstacles import Obstacle

FIRST, ZOOMS = 8, 4  # parts of a quarter turn in which directions are tried at first; to 1/2048 of it
STEPS = np.arange(-3, 4)  # of a quarter of the distance before
ALIKE_UM = 1e-6  # obstacles that are as near but for this are equally near: the first of them is named
BEYOND = 1.5  # a curved edge or facet lies within so many times its nodes' largest distance from one of them


class Nearest(NamedTuple):
    """The obstacle nearest to a boundary.

    Args:
        label: its name.
        distance_um: between the two, negative where they overlap.
    """

    label: str
    distance_um: float


def distance(obstacle: Obstacle, x: np.ndarray) -> np.ndarray:
    """Distance of points from an obstacle [µm], negative inside; shape x.shape[:-1].

    From a convex body it is the largest that any unit vector n shows, n.a - h(n), h being the body's support function:
    of |a_i/A_i|^e adding to 1 the norm of A_i n_i of the dual exponent e/(e - 1). Every n gives a bound from below,
    the best one is found to second order in its angle.

    Args:
        obstacle: one that `has_distance`.
        x: points [µm], shape (..., 2) or (..., 3).

    Source: Rockafellar, Convex Analysis (1970), section 13.
    """
    at = np.moveaxis(x, -1, 0)
    if hasattr(obstacle, "distance"):
        return np.broadcast_to(obstacle.distance(at), x.shape[:-1])
    offsets, half_axes = obstacle.octant(at)  # type: ignore[attr-defined]
    return _from_pillar(offsets, half_axes, obstacle.exponent)  # type: ignore[attr-defined]


def has_distance(obstacle: Obstacle) -> bool:
    """Whether `distance` knows it: a pillar, or one with a function of its own."""
    return hasattr(obstacle, "distance") or hasattr(obstacle, "octant")


def _from_pillar(a: Sequence[np.ndarray], half_axes: Sequence[Any], exponent: float) -> np.ndarray:
    """`distance` for two or three coordinates from the centre without signs, and half-axes along them [µm].

    Of three, the first two make one along each horizontal direction, as they do in a vertical section's support.
    """
    dual = exponent / (exponent - 1.0)

    def support(pair: Sequence[Any], first: np.ndarray, second: np.ndarray) -> np.ndarray:
        return np.asarray(((pair[0] * first) ** dual + (pair[1] * second) ** dual) ** (1.0 / dual))

    def from_one_side(first: np.ndarray, second: np.ndarray) -> np.ndarray:
        return np.asarray(first * a[0] + second * a[1] - support(half_axes, first, second))

    def from_one_section(first: np.ndarray, second: np.ndarray) -> np.ndarray:
        along = support(half_axes[:2], first, second)
        return _from_pillar((first * a[0] + second * a[1], a[2]), (along, half_axes[2]), exponent)

    shape = np.broadcast_shapes(*(np.shape(one) for one in a))
    return _largest(from_one_side if len(a) == 2 else from_one_section, shape)


def _largest(value: Callable[[np.ndarray, np.ndarray], np.ndarray], shape: tuple[int, ...]) -> np.ndarray:
    """Largest values of functions of a unit vector's two components over a quarter turn, each with one maximum.

    Angles are quarter turns times sin^2(pi t/2): fine where the support of a flat side has its kink. Between the
    neighbours of the best that is known those at a quarter of the distance are tried, again and again.
    """
    best = np.full(shape, 0.5)
    for level in range(ZOOMS + 1):
        steps = STEPS / (FIRST * 4**level) if level else np.linspace(-0.5, 0.5, FIRST + 1)
        tried = np.minimum(np.maximum(best + steps.reshape(-1, *[1] * len(shape)), 0.0), 1.0)
        angle = np.pi / 2 * np.sin(np.pi / 2 * tried) ** 2
        found = value(np.cos(angle), np.sin(angle))
        best = np.minimum(np.maximum(best + steps[found.argmax(axis=0)], 0.0), 1.0)
    return np.asarray(found.max(axis=0))


def nearest(boundary: Outline | Surface, u: fem.Function, obstacles: Mapping[str, Obstacle]) -> Nearest | None:
    """Of the obstacles that have a distance the nearest to the deformed boundary, if there is any. Collective.

    A distance changes by no more than one moves: obstacles and parts of the boundary that cannot be nearest are left
    out.

    Args:
        boundary: that of the modelled part of a body.
        u: displacement.
        obstacles: by label.
    """
    x, comm = boundary.nodes(u), boundary.comm
    known = {label: obstacle for label, obstacle in obstacles.items() if has_distance(obstacle)}
    outer = [-x.min(axis=(0, 1), initial=np.inf), x.max(axis=(0, 1), initial=-np.inf)]
    low, high = np.max(comm.allgather(outer), axis=0) * [[-1.0], [1.0]]
    radius = BEYOND * float(np.linalg.norm(high - low)) / 2
    from_middle = {label: float(distance(obstacle, (low + high) / 2)) for label, obstacle in known.items()}
    found: dict[str, float] = {}
    for label in sorted(known, key=lambda label: from_middle[label]):
        if from_middle[label] - radius > min(found.values(), default=np.inf):
            break
        found[label] = _between(boundary, x, known[label])
    least = min(found.values(), default=np.inf)
    return next((Nearest(label, least) for label in known if found.get(label, np.inf) < least + ALIKE_UM), None)


def _between(boundary: Outline | Surface, x: np.ndarray, obstacle: Obstacle) -> float:
    """Distance of edges or facets from an obstacle [µm]. Collective."""
    far = distance(obstacle, x[:, 0])
    size = BEYOND * np.linalg.norm(x - x[:, :1], axis=-1).max(axis=1, initial=0.0)
    least = boundary.comm.allreduce(float(far.min(initial=np.inf)), op=MPI.MIN)
    return -boundary.highest(x[far - size <= least], lambda at: -distance(obstacle, at))
