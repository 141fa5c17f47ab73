"""Where a deformed boundary crosses itself: segments of an outline in the plane, triangles of a surface in space."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

AT_ONCE = 256  # segments that are compared with all others together
ON_AXIS = 1e-9  # of the boundary's size: nearer ends are one


def crossing_of(segments: np.ndarray, axis: float | None = None) -> tuple[float, float] | None:
    """The middle of a segment that crosses another one, or an axis [µm]; None where none does.

    Args:
        segments: their ends [µm], shape (n, 2, 2); where two share an end they may meet.
        axis: x of a vertical that they must not pass.
    """
    size = float(np.ptp(segments.reshape(-1, 2), axis=0).max()) if len(segments) else 0.0
    if axis is not None and len(segments):
        beyond = segments[..., 0].min(axis=1) < axis - ON_AXIS * size
        if beyond.any():
            return _middle(segments[int(np.argmax(beyond))])
    c, d = segments[None, :, 0], segments[None, :, 1]
    for some in np.array_split(segments, -(-len(segments) // AT_ONCE) or 1):
        a, b = some[:, None, 0], some[:, None, 1]
        crosses = (_side(a, b, c) * _side(a, b, d) < 0) & (_side(c, d, a) * _side(c, d, b) < 0)
        for one in (a, b):
            for other in (c, d):
                crosses &= np.linalg.norm(one - other, axis=-1) > ON_AXIS * size
        found = np.argwhere(crosses)
        if len(found):
            return _middle(some[found[0, 0]])
    return None


def _side(p: np.ndarray, q: np.ndarray, r: np.ndarray) -> np.ndarray:
    """Twice the area of the triangle of three points, positive if they run counter-clockwise."""
    return np.asarray((q - p)[..., 0] * (r - p)[..., 1] - (q - p)[..., 1] * (r - p)[..., 0])


def _middle(segment: np.ndarray) -> tuple[float, float]:
    x, y = segment.mean(axis=0)
    return float(x), float(y)


def crossing_of_triangles(triangles: np.ndarray, mirrored: Sequence[int] = ()) -> tuple[float, float, float] | None:
    """The middle of a triangle that crosses another one, or a plane of symmetry [µm]; None where none does.

    Sheets of one body meet outside to outside, so only triangles whose normals are opposed are compared.

    Args:
        triangles: their corners [µm], shape (n, 3, 3), seen from outside counter-clockwise; neighbours share corners.
        mirrored: coordinates whose planes through 0 they must not pass to the negative side.
    """
    if not len(triangles):
        return None
    size = float(np.ptp(triangles.reshape(-1, 3), axis=0).max())
    beyond = np.any(triangles[..., list(mirrored)].min(axis=1) < -ON_AXIS * size, axis=1)
    if beyond.any():
        return _centroid(triangles[int(np.argmax(beyond))])
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    for i, j in _near(triangles):
        opposed = np.einsum("nc,nc->n", normal[i], normal[j]) < 0.0
        one, other = triangles[i[opposed]], triangles[j[opposed]]
        apart = np.linalg.norm(one[:, :, None] - other[:, None], axis=-1).min(axis=(1, 2)) > ON_AXIS * size
        one, other = one[apart], other[apart]
        found = np.flatnonzero(_pierced(one, other) | _pierced(other, one))
        if len(found):
            return _centroid(one[found[0]])
    return None


def _near(triangles: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Numbers of triangles whose circles about their centroids meet: those of a size with all that are not larger."""
    from scipy.spatial import cKDTree  # a tenth of the start of Python, for who looks for crossings in space only

    centre = triangles.mean(axis=1)
    reach = np.linalg.norm(triangles - centre[:, None], axis=-1).max(axis=1)
    octave = np.floor(np.log2(np.maximum(reach, np.finfo(float).tiny)))
    for one in np.unique(octave):
        mine, others = np.flatnonzero(octave == one), np.flatnonzero(octave <= one)
        tree = cKDTree(centre[others])
        for some in np.array_split(mine, -(-len(mine) // AT_ONCE)):
            near = cKDTree(centre[some]).sparse_distance_matrix(tree, 2.0 ** (one + 2), output_type="ndarray")
            i, j = some[near["i"]], others[near["j"]]
            meet = (near["v"] < reach[i] + reach[j]) & (i != j)
            yield i[meet], j[meet]


def _pierced(triangles: np.ndarray, others: np.ndarray) -> np.ndarray:
    """For each pair, True if a side of the second triangle pierces the first; shape (n,).

    Source: Möller & Trumbore, J. Graphics Tools 2 (1997) 21-28.
    """
    a, b = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    found = np.zeros(len(triangles), dtype=bool)
    for k in range(3):
        start, way = others[:, k], others[:, (k + 1) % 3] - others[:, k]
        p = np.cross(way, b)
        det = np.einsum("nc,nc->n", a, p)
        to = start - triangles[:, 0]
        q = np.cross(to, a)
        with np.errstate(divide="ignore", invalid="ignore"):  # parallel ones
            u, v, s = (np.einsum("nc,nc->n", *pair) / det for pair in ((to, p), (way, q), (b, q)))
            found |= (u > 0) & (v > 0) & (u + v < 1) & (s > 0) & (s < 1)
    return found


def _centroid(triangle: np.ndarray) -> tuple[float, float, float]:
    x, y, z = triangle.mean(axis=0)
    return float(x), float(y), float(z)
