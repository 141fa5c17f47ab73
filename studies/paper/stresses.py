"""Which von Mises stress the paper may mean: several, of one reading, beside the printed ones."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache, partial
from typing import Any

import numpy as np
import ufl

from cellmech import solve
from cellmech.cell import Observer
from cellmech.fem import PointValues, lattice
from cellmech.figures import Row, Section, significant
from cellmech.mechanics import deformation_gradient, green_lagrange
from cellmech.scene import put
from studies.paper.misfit import LOST, log_ratio
from studies.paper.printed import Paper, PrintedRow
from studies.paper.readings import LIMITS, ROUGH, Reading, misfits, row_settings, within

CHOICES = {
    "mixture": "of the whole tensor, σ_zz by the law",
    "in_plane": "of the components in the plane alone",
    "poisson": "σ_zz = ν (σ_xx + σ_yy)",
    "solid": "of the solid alone",
}
REGIONS = ("nucleus", "nucleoplasm")


def _mises(sigma: Any, out_of_plane: Any) -> Any:
    """Of a tensor whose zz component is taken to be `out_of_plane` [Pa]."""
    x, y, z, shear = sigma[0, 0], sigma[1, 1], out_of_plane, sigma[0, 1]
    return ufl.sqrt(((x - y) ** 2 + (y - z) ** 2 + (z - x) ** 2) / 2 + 3 * shear**2)


@lru_cache(maxsize=1)
def _evaluators(observer: Observer) -> list[tuple[np.ndarray, np.ndarray, PointValues]]:
    """Cells of each mixture in the nucleus, distance of their nodes from the centre [µm], and the choices there."""
    run, found = observer.run, []
    state, domain = run.state, run.body.domain
    k = state.kinematics
    F, E = deformation_gradient(state.u, k), green_lagrange(state.u, k)
    points = lattice(observer.subdivisions)[0]
    X = ufl.SpatialCoordinate(domain.mesh)
    for mixture in run.body.materials:
        S = mixture.solid(E, state.p)[1]
        solid = F * S * F.T / ufl.det(F)
        fluid = mixture.fluid(F, state.strain_rate()) if mixture.rate_dependent else 0.0 * S
        sigma = solid + F * fluid * F.T / ufl.det(F)
        poisson = 0.4 * (sigma[0, 0] + sigma[1, 1])
        taken = [_mises(sigma, sigma[2, 2]), _mises(sigma, 0.0), _mises(sigma, poisson), _mises(solid, solid[2, 2])]
        cells, _ = domain.own_of(name for name in observer.layout.groups["nucleus"] if name in mixture.names)
        place = PointValues(X, points, observer.comm)(cells) - np.array(observer.layout.centre)
        values = PointValues(ufl.as_vector(taken), points, observer.comm)
        found.append((cells, np.linalg.norm(place, axis=-1), values))
    return found


def largest(observer: Observer, choice: str, region: str) -> float:
    """The largest value of a choice at the nodes of a region [Pa]. Collective."""
    most, radius = 0.0, observer.layout.regions[region].outer_um * (1 + 1e-6)
    for cells, r, values in _evaluators(observer):
        at = values(cells)[..., list(CHOICES).index(choice)]
        most = max(most, float(np.max(at[r <= radius], initial=0.0)))
    return max(observer.comm.allgather(most))


def stresses(reading: Reading, row: PrintedRow) -> Mapping[str, float]:
    """Largest stresses at the end [Pa] by "choice_region", NaN where there is no solution. Collective."""
    from cellmech import Additions

    names = {f"{choice}_{region}": (choice, region) for choice in CHOICES for region in REGIONS}
    own: dict[str, Callable[[Observer], float]] = {
        name: partial(largest, choice=choice, region=region) for name, (choice, region) in names.items()
    }
    data: dict[str, Any] = {}
    for key, value in (ROUGH | row_settings(row) | dict(reading.settings)).items():
        put(data, key, value, row.name)
    result = solve(data, additions=Additions(observables=own), check=False)
    _evaluators.cache_clear()
    if result.failure:
        return dict.fromkeys(names, math.nan)
    return {name: result.number(f"own.{name}") for name in names}


def stress_section(reading: Reading, paper: Paper, note: Callable[[str], None]) -> Section:
    """How near each choice comes to the printed stresses. Collective."""
    rows = [row for row in paper.rows if "sigma" in row.values]
    found = []
    for row in rows:
        found.append(stresses(reading, row))
        note(f"{row.table} {row.name}: " + ", ".join(f"{name} {value:.3g}" for name, value in found[-1].items()))
    return _section(reading, [row.values["sigma"] for row in rows], found)


def _section(reading: Reading, printed: Sequence[float], found: Sequence[Mapping[str, float]]) -> Section:
    header = ("sigma_Mises", "region", "rms", "median", *LIMITS)
    text = f"{len(printed)} printed stresses; {reading.text}; largest values at the end, at the nodes."
    rows = []
    for choice, told in CHOICES.items():
        for region in REGIONS:
            ours = [of[f"{choice}_{region}"] for of in found]
            pairs = zip(ours, printed, strict=True)
            logs = [LOST if math.isnan(one) else log_ratio(one / other) for one, other in pairs]
            (rms, median), near = misfits(logs), within(logs)
            record = {"choice": choice, "region": region, "rms": rms, "median": median}
            record |= dict(zip(LIMITS, near, strict=True))
            cells = (told, region, significant(rms, 2), significant(median, 2), *map(str, near))
            rows.append(Row(cells, record))
    return Section("stress", "Which von Mises stress", text, header, rows)
