"""The package as a library on two ranks: results on both, and what goes wrong on one is known to both."""

import pytest
from cli.programs import ENVIRONMENT, program

pytestmark = pytest.mark.mpi

CODE = """
import os, sys
import cellmech
from cellmech.results import records
from mpi4py import MPI

world, coarse = MPI.COMM_WORLD, {"mesh": {"size_um": 8.0}, "time": {"history": False}}

def told(text):
    for line in world.gather(text) or ():
        print(line, flush=True)

result = cellmech.solve(coarse)
if world.rank == 0:
    folder, first = result.folder, result.number("lamina.J1_max")
    del result
else:
    first = result.number("lamina.J1_max")
world.barrier()
told(f"solved {first:.9g} {len(cellmech.load(world.bcast(folder if world.rank == 0 else None)).series())}")

ours = records.write_whole
for name in ("history.csv", "result.json"):
    def full(path, *rest):
        if path.name == name:
            raise OSError(28, "No space left on device", name)
        ours(path, *rest)

    records.write_whole = full
    try:
        cellmech.solve(coarse)
    except OSError as error:
        told(f"OSError: {error}")
records.write_whole = ours

def broken(observer):
    if world.rank == 0:
        raise ValueError("on one rank only")
    return 1.0

for words in ({"folder": sys.argv[1]}, {"additions": cellmech.Additions(observables={"broken": broken})}):
    try:
        cellmech.solve(coarse, **words)
    except (cellmech.CellmechError, OSError) as error:
        told(f"{type(error).__name__}: {error}")
for cache in sys.argv[1:]:
    os.environ["XDG_CACHE_HOME"] = cache
    try:
        cellmech.solve(coarse)
    except (cellmech.CellmechError, OSError) as error:
        told(f"{type(error).__name__}: {error}")
"""


def test_what_goes_wrong_on_one_rank_is_known_to_both(tmp_path):
    (tmp_path / "file").write_text("")
    (tmp_path / "cellmech" / "libffcx_forms.c").mkdir(parents=True)  # looks like a killed compilation's, and stays
    outcome = program(tmp_path / "file", tmp_path, ranks=2, program=("-c", CODE))
    lines = outcome.out.splitlines()
    assert outcome.status == 0, outcome.err
    assert len(lines) == 14
    assert lines[::2] == lines[1::2]
    said = (
        "solved 2.0",
        "OSError: [Errno 28] No space left on device: 'history.csv'",
        "OSError: [Errno 28] No space left on device: 'result.json'",
        "InputError: folder: must be a folder",
        "SolveError: the observable broken",
        f"OSError: {tmp_path}/file/cellmech: compiled equations cannot be kept there (Not a directory). Name ano",
        f"OSError: {tmp_path}/cellmech: compiled equations cannot be kept there (Is a directory). Name another pla",
    )
    for line, start in zip(lines[::2], said, strict=True):
        assert line.startswith(start)


ALONE = """
from mpi4py import MPI
import cellmech

world = MPI.COMM_WORLD

def bug(progress):
    if world.rank == 1:
        raise ZeroDivisionError

try:
    cellmech.solve({"mesh": {"size_um": 8.0}, "time": {"history": False}}, progress=bug)
except ZeroDivisionError:
    print("came out", flush=True)
world.Abort()
"""


def test_rank_that_fails_alone_does_not_wait_for_the_others():
    assert "came out" in program(ranks=2, program=("-c", ALONE)).out


FORM = """
import ufl
from dolfinx import mesh
from mpi4py import MPI
from cellmech.fem.jit import compile_form, pressure_space

world = MPI.COMM_WORLD
space = pressure_space(mesh.create_unit_square(world, 4, 4))
compile_form(ufl.TestFunction(space) * ufl.dx, world)
sizes = world.gather(space.dofmap.index_map.size_global)
if world.rank == 0:
    print(*sizes)
"""


def test_module_that_a_power_cut_has_cut_short_is_compiled_anew(tmp_path, monkeypatch):
    monkeypatch.setitem(ENVIRONMENT, "XDG_CACHE_HOME", str(tmp_path))
    assert program(ranks=2, program=("-c", FORM)).out == "96 96\n"
    libraries = list((tmp_path / "cellmech").glob("libffcx_*.so"))
    for library in libraries:
        library.write_bytes(b"")
    outcome = program(ranks=2, program=("-c", FORM))
    assert outcome.out == "96 96\n", outcome.err
    assert libraries and all(library.stat().st_size > 0 for library in libraries)
