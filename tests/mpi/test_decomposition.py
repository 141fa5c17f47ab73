"""One case over 2 and 3 ranks equals the serial one: every scalar at every step, and the steps themselves."""

import csv

import pytest
from cli.programs import program

pytestmark = pytest.mark.mpi

SCENES = {
    "half": 'title = "half"\n[mesh]\nsize_um = 6.0\n[time]\nend_s = 2000.0\n',
    "full": 'title = "full"\n[cell]\nshape = "full"\n[mesh]\nsize_um = 8.0\n[time]\nend_s = 1000.0\nrtol = 1e-2\n',
    "inertia": 'title = "i"\n[cell]\ninertia = true\n[mesh]\nsize_um = 8.0\n[time]\nend_s = 2000.0\nrtol = 1e-2\n',
    "ball": 'title = "b"\n[cell]\ngeometry = "3d"\n[mesh]\nsize_um = 8.0\norder = 2\n[time]\nhistory = false\n',
    "turned": 'title = "t"\n[cell]\ngeometry = "axisymmetric"\n[mesh]\nsize_um = 6.0\n[time]\nhistory = false\n',
    "mixed": 'title = "m"\n[cell]\npoisson = 0.499\n[mesh]\nsize_um = 5.0\n[time]\nend_s = 1000.0\nrtol = 1e-2\n',
}


def history(folder, name, ranks):
    scene = folder / f"{name}.toml"
    scene.write_text(SCENES[name])
    out = folder / f"on-{ranks}" / name  # side by side the first result would be taken over
    outcome = program(scene, "--out", out, "--ranks-per-case", ranks, "--quiet", ranks=ranks)
    assert outcome.status == 0, outcome.err
    with open(out / name / "history.csv", newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("name", SCENES)
def test_decomposition_leaves_every_number_alone(name, tmp_path, ladder):
    serial = history(tmp_path, name, 1)
    largest = {key: max(abs(float(row[key] or 0.0)) for row in serial) for key in serial[0]}
    for ranks in (2, 3):
        parallel = history(tmp_path, name, ranks)
        case = f"{ranks} ranks and 1, {name} cell"
        steps = [[float(row["dt_s"]) for row in rows] for rows in (parallel, serial)]
        assert len(steps[0]) == len(steps[1])
        ladder(f"{case}: steps", ours=steps[0], reference=steps[1], unit="s")
        gaps = {}
        for ours, theirs in zip(parallel, serial, strict=True):
            for key, value in theirs.items():
                # round-off may decide a last iteration, and the place of a maximum may jump between equal values
                if key == "newton" or key.endswith((".x", ".y")) or not value:
                    assert bool(ours[key]) == bool(value)
                    continue
                # shares are ratios of small numbers; the tilt of a section that is almost round is one too
                small = key.startswith("share") or key.endswith("_deg")
                scale = 1.0 if small else max(largest[key], 1e-3)
                gap = (float(ours[key]) - float(value)) / scale
                gaps[key] = max(gaps.get(key, 0.0), abs(gap))
        ladder(
            f"{case}: {len(gaps)} scalars over the history, each over its largest", ours=list(gaps.values()), abs=1e-8
        )
