"""One case's files as they lie on disk: read, never solved.

Of a case's folder: scene.toml, result.json, history.csv, outline.csv, and fields.pvd with the files it lists.
"""

from __future__ import annotations

import csv
import html
import json
import os
import warnings
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from cellmech.causes import Cause
from cellmech.errors import InputError, cut
from cellmech.names import plain, spelt
from cellmech.results.records import OUTLINE, flatten
from cellmech.results.sealed import SEAL, damage, is_whole
from cellmech.results.vtu import IMAGE
from cellmech.scene.files import read_scene
from cellmech.scene.keys import likeness
from cellmech.scene.scene import Scene
from cellmech.scene.toml_file import read_toml

ALIKE = 0.6  # a name less like a wrong one is not suggested
AGAIN = "Solve the case again (python -m cellmech.study … --fresh)."


@dataclass(frozen=True)
class Result:
    """One case's files.

    Args:
        name: of the case and its folder.
        folder: where the files are.
        scene: the resolved input.
        result: the content of result.json.
    """

    name: str
    folder: Path
    scene: Scene
    result: Mapping[str, Any]

    @property
    def failure(self) -> str:
        """Why the case stopped early, "" when it was solved."""
        if self.result.get("status") == "solved":
            return ""
        return str(self.result.get("reason") or "no reason given")

    @property
    def cause(self) -> Cause | None:
        """The kind of that failure, with advice; None when it was solved."""
        return Cause.named(self.result.get("cause")) if self.failure else None

    @property
    def beyond_ellipticity(self) -> bool:
        """True if its last state is beyond the loss of ellipticity, as its scene allows: it depends on the mesh."""
        return ((self.result.get("beyond_ellipticity") or {}).get("since_s")) is not None

    def rest(self, quantity: str) -> float:
        """The value of a quantity where nothing is deformed: of J1, J2, J3 2, 2, 1 in the plane and 3, 3, 1 outside."""
        flat = self.scene.cell.geometry == "plane"
        return {"J1": 2.0 if flat else 3.0, "J2": 2.0 if flat else 3.0, "J3": 1.0}.get(quantity, 0.0)

    def number(self, key: str) -> float:
        """A number of result.json by its dotted key; NaN where it is null, or not there as the case failed.

        Raises:
            InputError: for a number that no result has, or when something else than a number stands there.
        """
        return self._number(key, must_be_there=not self.failure)

    def get(self, key: str) -> float:
        """The same, NaN also where there is no such number.

        Raises:
            InputError: when something else than a number stands there.
        """
        return self._number(key, must_be_there=False)

    def _number(self, key: str, must_be_there: bool) -> float:
        value: Any = self.result
        for part in plain(key).split("."):
            if must_be_there and isinstance(value, Mapping) and part not in value:
                raise InputError(
                    str(self.folder / "result.json"), key, "there is no such number", None, self._near(key)
                )
            value = value.get(part) if isinstance(value, Mapping) else None
        if value is not None and (isinstance(value, bool) or not isinstance(value, int | float)):
            raise InputError(str(self.folder / "result.json"), key, "must be a number", value, AGAIN)
        return float("nan") if value is None else float(value)

    def _near(self, key: str) -> str:
        """A sentence that names the numbers nearest to a wrong one."""
        score = {
            name: likeness(key, name) for name, value in flatten(self.result).items() if isinstance(value, int | float)
        }
        near = sorted((name for name in score if score[name] > ALIKE), key=score.__getitem__, reverse=True)[:3]
        return f"Did you mean {' or '.join(near)}?" if near else "result.json and docs/files.md have their names."

    def history(self, *columns: str) -> dict[str, np.ndarray]:
        """Columns of history.csv, all without names, one value per accepted step; NaN where a field is empty.

        An end state alone (time.history = false) has one step.

        Raises:
            InputError: for a file that is missing or broken, or has no such column.
        """
        path = self.folder / "history.csv"
        try:
            rows = list(csv.DictReader(_text(path).splitlines()))
        except csv.Error as error:
            raise InputError(str(path), "", f"is no table ({error})", None, AGAIN) from None
        if not rows:
            raise InputError(str(path), "", "holds no accepted step", None, AGAIN)
        found = {}
        for column in map(plain, columns or rows[0]):
            if column not in rows[0]:
                raise InputError(str(path), column, "there is no such column", None, AGAIN)
            try:
                found[column] = np.array([float(row[column] or "nan") for row in rows])
            except (TypeError, ValueError) as error:
                raise InputError(str(path), column, f"must hold numbers only ({error})", None, AGAIN) from None
        return found

    def outline(self, body: str = "nucleus", state: str = "deformed", view: str = "section") -> np.ndarray:
        """Points around a body in order [µm], shape (n, 2): x and y, or x and z of a view from above.

        Args:
            body: "nucleus" or "cell".
            state: "deformed", or "reference" before the load.
            view: "section", or "above" of a ball.

        Raises:
            InputError: for a file that is missing or broken, or has no such outline.
        """
        path, asked = self.folder / OUTLINE, [body, state, view]
        columns = ("x_um", "z_um" if view == "above" else "y_um")
        rows = csv.DictReader(_text(path).splitlines())
        mine = [row for row in rows if [row.get("body"), row.get("state"), row.get("view")] == asked]
        if not mine:
            raise InputError(str(path), " ".join(asked), "there is no such outline", None, AGAIN)
        try:
            return np.array([[float(row[column] or "nan") for column in columns] for row in mine])
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(str(path), "", f"must hold numbers only ({error})", None, AGAIN) from None

    def fields(self, file: Path | None = None) -> Any:
        """A field file, the last if none is given, as a pyvista UnstructuredGrid: every triangle has its own points.

        It has the whole cell, unless `output.whole_cell` is off; its cell data `image` is 0 for what was computed.

        Raises:
            InputError: for a file that is missing or broken.
        """
        path = file or self.last_fields()[1]
        try:
            return read_grid(path)
        except (AttributeError, ValueError, OSError, UserWarning) as error:
            text = " ".join(str(error).split())[:120]
            raise InputError(str(path), "", f"is no field file of this program ({text})", None, AGAIN) from None

    def __repr__(self) -> str:
        """One line: whether it is solved, the time reached, a number to begin with."""
        key = "lamina.sigma_mises_max_Pa"
        told = self.failure or f"solved at t = {self.get('t_s'):,.0f} s, {key} = {self.get(key):.5g}"
        return f"<Result {self.name!r}: {cut(told)}; {self.folder}>"

    def _repr_html_(self) -> str:
        """A notebook's view: largest and mean values by region."""
        columns = ("sigma_mises_max_Pa", "J1_max", "J2_max", "J3_max", "sigma_mises_mean_Pa", "det_F_min")
        rows = ["".join(f"<th>{name}</th>" for name in ("", *columns))]
        for region in ("nucleus", "nucleoplasm", "lamina", "cytosol", "membrane", "cell"):
            cells = (f"<td>{self.get(f'{region}.{column}'):.6g}</td>" for column in columns)
            rows.append(f"<th>{region}</th>{''.join(cells)}")
        title = f"{self.name}: {self.failure or 'solved'}, t = {self.number('t_s'):,.0f} s"
        table = "".join(f"<tr>{row}</tr>" for row in rows)
        return f"<table><caption>{html.escape(title)}</caption>{table}</table>"

    def series(self) -> list[tuple[float, Path]]:
        """Times [s] and files of the field files that fields.pvd lists, in order of time.

        Raises:
            InputError: for a fields.pvd that is missing or broken, or names a file that is not there.
        """
        return [self._there(*entry) for entry in self._listed()]

    def last_fields(self) -> tuple[float, Path]:
        """Time [s] and file of the last of them; raises likewise."""
        return self._there(*self._listed()[-1])

    def _listed(self) -> list[tuple[float, str]]:
        path = self.folder / "fields.pvd"
        try:
            entries = [e.attrib for e in ET.fromstring(_text(path)).iter("DataSet")]
            found = sorted((float(e["timestep"]), e["file"]) for e in entries if e.get("part", "0") == "0")
        except (ET.ParseError, KeyError, ValueError) as error:
            raise InputError(str(path), "", f"is no list of field files ({error})", None, AGAIN) from None
        if not found:
            raise InputError(str(path), "", "is no list of field files (it is empty)", None, AGAIN)
        return found

    def _there(self, t_s: float, name: str) -> tuple[float, Path]:
        if not (self.folder / name).is_file():
            raise InputError(str(self.folder / "fields.pvd"), name, "the file it names is not there", None, AGAIN)
        return t_s, self.folder / name


R = TypeVar("R", bound=Result)


def read_grid(path: Path) -> Any:
    """A field file as a pyvista UnstructuredGrid; what VTK dislikes raises one of several exceptions and warnings."""
    import pyvista

    with pyvista.vtk_verbosity("off"), warnings.catch_warnings():
        warnings.filterwarnings("error", message=".*raised an error while reading")  # pyvista reads on
        return pyvista.read(path)


def modelled(grid: Any) -> Any:
    """What was computed of a field file's cell, without its images."""
    if IMAGE not in grid.cell_data:  # a file of before images were written
        return grid
    mine = np.flatnonzero(np.asarray(grid.cell_data[IMAGE]) == 0)
    return grid if len(mine) == grid.n_cells else grid.extract_cells(mine, pass_cell_ids=False, pass_point_ids=False)


def load(folder: str | os.PathLike[str]) -> Result:
    """Read the folder of a case that was solved, or that failed on its way.

    Raises:
        InputError: for a file that is missing or broken.
    """
    return read(folder, Result)


def read(folder: str | os.PathLike[str], kind: type[R]) -> R:
    """As `load`, as this kind of result.

    Raises:
        InputError: for a file that is missing or broken.
    """
    folder = Path(spelt(folder))
    path = folder / "result.json"
    try:
        result = json.loads(_text(path))
    except (ValueError, RecursionError) as error:
        raise InputError(str(path), "", f"is no valid JSON: {error}", None, AGAIN) from None
    if not isinstance(result, dict) or not isinstance(result.get("files", {}), dict):
        raise InputError(str(path), "", "must be a JSON object, and `files` in it one", None, AGAIN)
    if SEAL in result and not is_whole(result):
        raise InputError(str(path), "", "is damaged: its content is not what was written", None, AGAIN)
    there = {name: known for name, known in result.get("files", {}).items() if (folder / name).exists()}
    if fault := damage(folder, there):
        raise InputError(str(folder), "", fault, None, AGAIN)
    scene = str(folder / "scene.toml")
    return kind(plain(folder.name), folder, read_scene(read_toml(scene), scene), result)


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(str(path), "", "there is no such file", None, AGAIN) from None
    except (OSError, ValueError) as error:
        raise InputError(str(path), "", f"cannot be read ({error})") from None
