"""The compiler's cache survives a kill."""

import os
import signal
import subprocess
import sys
import time

COMPILE = """
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI
from cellmech.forms import compile_form, displacement_space

square = mesh.create_unit_square(MPI.COMM_SELF, 2, 2)
u = fem.Function(displacement_space(square, 2))
E = ufl.grad(u).T * ufl.grad(u)
energy = ufl.exp(ufl.tr(E * E * E)) * ufl.det(E) * ufl.dx(metadata={"quadrature_degree": 8})
V = u.function_space
K = ufl.derivative(ufl.derivative(energy, u, ufl.TestFunction(V)), u, ufl.TrialFunction(V))
compile_form(K, MPI.COMM_SELF)
print("compiled")
"""


def start(cache):
    environment = {**os.environ, "XDG_CACHE_HOME": str(cache)}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen([sys.executable, "-c", COMPILE], env=environment, start_new_session=True, **pipes)


def test_killed_compilation_does_not_stop_the_next_run(tmp_path):
    """FFCx's own mark of a compilation, a C file without a `.cached` beside it, makes every later run wait and fail."""
    killed = start(tmp_path)
    marks = []
    while not marks:
        assert killed.poll() is None, killed.communicate()[1]
        marks = list((tmp_path / "cellmech").glob("libffcx_*.c"))
        time.sleep(0.01)
    os.killpg(killed.pid, signal.SIGKILL)
    killed.communicate()
    assert not marks[0].with_suffix(".c.cached").exists()  # it was in the middle of it

    after = start(tmp_path)
    out, err = after.communicate(timeout=60)
    assert out == "compiled\n", err
    assert marks[0].with_suffix(".c.cached").exists()
