"""Gmsh scripts of discs and rings cut into annular layers: text only, gmsh itself is not needed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

Direction = tuple[float, float]


@dataclass(frozen=True)
class Annulus:
    """The surfaces between two circles: several where the mesh is structured, one elsewhere.

    Args:
        surfaces: numbers of the surfaces, in the order of the sector's directions.
        structured: whether they are meshed with elongated triangles.
    """

    surfaces: list[int]
    structured: bool


@dataclass(frozen=True)
class Sector:
    """Numbers of the curves and surfaces of one sector of a disc or ring.

    Args:
        arcs: curves of each circle, from the inside out, in the order of the directions.
        start: radial lines in the first direction, from the inside out.
        end: radial lines in the last direction.
        annuli: what lies between the circles, from the inside out.
    """

    arcs: list[list[int]]
    start: list[int]
    end: list[int]
    annuli: list[Annulus]


@dataclass
class GeoScript:
    """A growing Gmsh script with centre (x, y) [µm]; a point or curve asked for twice is made once."""

    centre: tuple[float, float]
    lines: list[str] = field(default_factory=list)
    _known: dict[tuple[str, str], int] = field(default_factory=dict)
    _count: Counter[str] = field(default_factory=Counter)

    def text(self) -> str:
        """The script."""
        return "\n".join(self.lines) + "\n"

    def sector(
        self, radii: Sequence[float], directions: Sequence[Direction], across: Sequence[int], solid: bool
    ) -> Sector:
        """Add the sector that the unit vectors `directions` span, each less than 180° from the next.

        Args:
            radii: of the circles, from the inside out [µm].
            directions: unit vectors, counterclockwise or clockwise.
            across: for each circle, elements across the annulus inside it; 0 for an unstructured one.
            solid: whether what the first circle encloses belongs to the sector.
        """
        middle = self._point(0.0, (0.0, 0.0))
        points = [[self._point(radius, d) for d in directions] for radius in radii]
        arcs = [[self._add("Curve", "Circle", (a, middle, b)) for a, b in pairwise(row)] for row in points]
        inner = [[middle] * len(directions), *points]
        first = 0 if solid else 1
        rows = range(first, len(radii))

        def ray(k: int, j: int) -> int:
            return self._add("Curve", "Line", (inner[k][j], points[k][j]))

        start, end = [ray(k, 0) for k in rows], [ray(k, -1) for k in rows]
        annuli = []
        for k in rows:
            below = arcs[k - 1] if k else []
            cuts = range(len(directions)) if across[k] else (0, len(directions) - 1)
            rays = [ray(k, j) for j in cuts]
            if across[k]:
                pieces = [[rays[j], arc, -rays[j + 1], -below[j]] for j, arc in enumerate(arcs[k])]
                self.lines.append(f"Transfinite Curve {_braces(rays)} = {across[k] + 1};")
            else:
                pieces = [[rays[0], *arcs[k], -rays[1], *(-arc for arc in reversed(below))]]
            annuli.append(Annulus([self._surface(piece) for piece in pieces], bool(across[k])))
            if across[k]:
                self.lines.append(f"Transfinite Surface {_braces(annuli[-1].surfaces)} AlternateRight;")
        self._tie_arcs(radii, arcs, across)
        return Sector(arcs, start, end, annuli)

    def mirror(self, right: Sector, left: Sector) -> None:
        """Mesh `left` as the mirror image of `right` about the vertical through the centre (Gmsh: to about 1e-7 µm)."""
        image = f"-1, 0, 0, {2.0 * float(self.centre[0])!r}, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1"
        for a, b in zip(right.annuli, left.annuli, strict=True):
            self.lines.append(f"Periodic Surface {_braces(b.surfaces)} = {_braces(a.surfaces)} Affine {{{image}}};")

    def group(self, dim: int, name: str, numbers: Iterable[int]) -> None:
        """Name a physical group of curves (dim 1) or surfaces (dim 2)."""
        self._count["group"] += 1
        kind = "Curve" if dim == 1 else "Surface"
        self.lines.append(f'Physical {kind}("{name}", {self._count["group"]}) = {_braces(numbers)};')

    def sizes(self, expressions: Sequence[str], order: int) -> None:
        """Take element sizes [µm] from the least of some MathEval expressions in x and y alone."""
        numbers = range(1, len(expressions) + 1)
        for k, expression in zip(numbers, expressions, strict=True):
            self.lines += [f"Field[{k}] = MathEval;", f'Field[{k}].F = "{expression}";']
        least = len(expressions) + 1
        self.lines += [
            f"Field[{least}] = Min;",
            f"Field[{least}].FieldsList = {_braces(numbers)};",
            f"Background Field = {least};",
            "Mesh.MeshSizeExtendFromBoundary = 0;",
            "Mesh.MeshSizeFromPoints = 0;",
            "Mesh.MeshSizeFromCurvature = 0;",
            "Mesh.Algorithm = 6; // frontal Delaunay",
            f"Mesh.ElementOrder = {order};",
        ]

    def _tie_arcs(self, radii: Sequence[float], arcs: Sequence[Sequence[int]], across: Sequence[int]) -> None:
        """Give both sides of a structured annulus the same angles: the inner arcs copy the outermost ones."""
        x, y = map(float, self.centre)
        outer = len(radii) - 1
        for k in range(len(radii) - 2, -1, -1):
            if not across[k + 1]:
                outer = k
                continue
            f = float(radii[k] / radii[outer])
            scaling = f"{f!r}, 0, 0, {x * (1 - f)!r}, 0, {f!r}, 0, {y * (1 - f)!r}, 0, 0, 1, 0, 0, 0, 0, 1"
            for arc, source in zip(arcs[k], arcs[outer], strict=True):
                self.lines.append(f"Periodic Curve {{{arc}}} = {{{source}}} Affine {{{scaling}}};")

    def _point(self, radius: float, direction: Direction) -> int:
        x, y = (float(c + radius * d) for c, d in zip(self.centre, direction, strict=True))
        return self._add("Point", "Point", (x, y, 0))

    def _surface(self, loop: Sequence[int]) -> int:
        return self._add("Surface", "Plane Surface", (self._add("Loop", "Curve Loop", loop),))

    def _add(self, kind: str, command: str, parts: Sequence[float]) -> int:
        body = _braces(parts)
        if (command, body) not in self._known:
            self._count[kind] += 1
            self._known[command, body] = self._count[kind]
            self.lines.append(f"{command}({self._count[kind]}) = {body};")
        return self._known[command, body]


def _braces(parts: Iterable[float]) -> str:
    return "{" + ", ".join(repr(part) for part in parts) + "}"
