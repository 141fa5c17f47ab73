"""The compiler's cache survives a kill, holds each form once, and a process that keeps it locked is named."""

import errno
import fcntl
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import ufl
from dolfinx import fem, mesh
from held_compiler import held_compiler
from mpi4py import MPI

from cellmech.fem import jit
from cellmech.fem.jit import PointValues

COMPILE = """
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI
from cellmech.fem.jit import compile_form, displacement_space

square = mesh.create_unit_square(MPI.COMM_SELF, 2, 2)
u = fem.Function(displacement_space(square, 2))
E = ufl.grad(u).T * ufl.grad(u)
energy = ufl.exp(ufl.tr(E * E * E)) * ufl.det(E) * ufl.dx(metadata={"quadrature_degree": 8})
V = u.function_space
K = ufl.derivative(ufl.derivative(energy, u, ufl.TestFunction(V)), u, ufl.TrialFunction(V))
compile_form(K, MPI.COMM_SELF)
print("compiled")
"""

ALIKE = """
from cellmech.fem import fenicsx
from dolfinx import fem, mesh
from mpi4py import MPI
import ufl

square = mesh.create_unit_square(MPI.COMM_SELF, 2, 2)
fem.Constant(square, 0.0)  # one more: then 9 and 10 are a pair
def form():
    a, b = fem.Constant(square, 1.0), fem.Constant(square, 2.0)
    return a * b * ufl.dx(metadata={"quadrature_degree": 2})
print(len({form().signature() for _ in range(60)}))
"""


@pytest.fixture
def held(tmp_path, monkeypatch):
    """The compiler waits until this file is there: till then a compilation that has begun is under way."""
    path, gate = held_compiler(tmp_path, path=os.environ.get("PYTHONPATH", ""))
    monkeypatch.setenv("PYTHONPATH", path)
    yield gate
    gate.touch()


def start(cache, before=""):
    environment = {**os.environ, "XDG_CACHE_HOME": str(cache)}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen([sys.executable, "-c", before + COMPILE], env=environment, start_new_session=True, **pipes)


def begun(process, cache):
    """The C files whose compilation has begun, as soon as there are any."""
    marks = []
    while not marks:
        assert process.poll() is None, process.communicate()[1]
        marks = list((cache / "cellmech").glob("libffcx_*.c"))
        time.sleep(0.01)
    return marks


def test_who_waits_for_a_stopped_compilation_says_for_which_process(held, tmp_path):
    stopped = start(tmp_path)
    begun(stopped, tmp_path)
    os.killpg(stopped.pid, signal.SIGSTOP)
    waiting = start(tmp_path, "import cellmech.fem.jit as f; f.TELL_S = 0.1\n")
    said = waiting.stderr.readline()
    os.killpg(stopped.pid, signal.SIGCONT)
    held.touch()
    assert f"waits for process {stopped.pid}, which compiles" in said
    assert waiting.communicate(timeout=300)[0] == stopped.communicate(timeout=300)[0] == "compiled\n"


def test_killed_compilation_does_not_stop_the_next_run(held, tmp_path):
    """FFCx's own mark of a compilation, a C file without a `.cached` beside it, makes every later run wait and fail."""
    killed = start(tmp_path)
    marks = begun(killed, tmp_path)
    os.killpg(killed.pid, signal.SIGKILL)
    killed.communicate()
    assert not marks[0].with_suffix(".c.cached").exists()  # it was in the middle of it

    held.touch()
    after = start(tmp_path)
    out, err = after.communicate(timeout=300)
    assert out == "compiled\n", err
    assert marks[0].with_suffix(".c.cached").exists()


@pytest.mark.parametrize("spoil", [lambda path: path.write_bytes(b""), Path.unlink], ids=["empty", "gone"])
def test_module_that_a_power_cut_has_cut_short_is_compiled_anew(spoil, tmp_path):
    """It stands beside the mark of a compilation that has ended well."""
    assert start(tmp_path).communicate(timeout=60)[0] == "compiled\n"
    modules = list((tmp_path / "cellmech").glob("libffcx_*.so"))
    for path in modules:
        spoil(path)
    out, err = start(tmp_path).communicate(timeout=60)
    assert out == "compiled\n", err
    assert modules and all(path.stat().st_size > 0 for path in modules)


def test_error_of_a_compilation_is_told_as_it_is(tmp_path, monkeypatch):
    """Tried once, and nothing removed: it names no module that is kept."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    tried = []

    def make(options):
        tried.append(options["cache_dir"])
        raise RuntimeError("libffcx_forms_ab.c: no compiler")

    kept = [tmp_path / "cellmech" / name for name in ("libffcx_cd.c", "libffcx_cd.c.cached", "libffcx_cd.x86.so")]
    kept[0].parent.mkdir()
    for path in kept:
        path.touch()
    with pytest.raises(RuntimeError, match="no compiler"):
        jit._compiled(MPI.COMM_SELF, make)
    assert len(tried) == 1 and all(path.exists() for path in kept)


def test_who_waits_long_for_the_compiler_is_told_for_what(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(jit, "TELL_S", 0.0)
    (tmp_path / "cellmech").mkdir()
    other = open(tmp_path / "cellmech" / "lock", "w")
    print(4711, file=other, flush=True)
    fcntl.flock(other, fcntl.LOCK_EX)
    looks = []

    def sleep(seconds):
        looks.append(seconds)
        if len(looks) == 3:
            other.close()

    monkeypatch.setattr(jit.time, "sleep", sleep)
    with jit._compiling(MPI.COMM_SELF):
        pass
    where = tmp_path / "cellmech" / "lock"
    assert capsys.readouterr().err == f"cellmech: waits for process 4711, which compiles equations and holds {where}\n"
    assert len(looks) == 3


@pytest.mark.parametrize("why", [errno.ENOSYS, errno.ENOLCK, errno.EOPNOTSUPP])
def test_file_system_without_locks_will_do(why, tmp_path, monkeypatch):
    """Nobody knows there whether a compilation goes on, but by its age."""

    def refuse(*arguments):
        raise OSError(why, os.strerror(why))

    monkeypatch.setattr(fcntl, "flock", refuse)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    (tmp_path / "cellmech").mkdir()
    dead, alive = (tmp_path / "cellmech" / f"libffcx_{name}.c" for name in ("dead", "alive"))
    alive.touch()
    dead.touch()
    long_ago = time.time() - 610.0
    os.utime(dead, (long_ago, long_ago))
    square = mesh.create_unit_square(MPI.COMM_SELF, 1, 1)
    one = jit.compile_form(fem.Constant(square, 1.0) * ufl.dx, MPI.COMM_SELF)
    assert fem.assemble_scalar(one) == pytest.approx(1.0, rel=1e-14)
    assert alive.exists() and not dead.exists()


def test_form_is_the_same_however_many_constants_were_made_before():
    """In a process of its own, whose numbers begin anew: 60 pairs pass 9 and 99, where UFL changes the order."""
    out = subprocess.run([sys.executable, "-c", ALIKE], capture_output=True, text=True, check=True).stdout
    assert out == "1\n"
    assert _without_our_numbers() != "1\n"


def _without_our_numbers():
    code = ALIKE.replace("from cellmech.fem import fenicsx\n", "")
    environment = {**os.environ, "OMPI_MCA_btl": "self"}  # leaves no shared memory, which the package would see to
    pipes = {"stdout": subprocess.PIPE, "text": True}
    return subprocess.run([sys.executable, "-c", code], env=environment, check=True, **pipes).stdout


def test_expression_with_variables_is_compiled_once(tmp_path, monkeypatch):
    """Each `ufl.variable` has a number of its own, by which FFCx 0.9 tells expressions apart."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    square = mesh.create_unit_square(MPI.COMM_SELF, 1, 1)
    for _ in range(3):
        v = ufl.variable(fem.Constant(square, 3.0))
        values = PointValues(ufl.diff(v**3, v), np.array([[0.25, 0.25]]), MPI.COMM_SELF)
        np.testing.assert_allclose(values(np.arange(2, dtype=np.int32)), 27.0, rtol=1e-14)
    assert len(list((tmp_path / "cellmech").glob("libffcx_*.so"))) == 1
