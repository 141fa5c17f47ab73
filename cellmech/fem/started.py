"""MPI, PETSc and DOLFINx, started in this order and undisturbed by what surrounds the process.

Whoever imports DOLFINx or MPI at the head of a module that a program begins with imports this before.
"""

from __future__ import annotations

from cellmech import surroundings

surroundings.open_streams()
surroundings.refuse_other_numpy()
MPI = surroundings.start_mpi()
surroundings.start_petsc()
with surroundings.some_home():
    import dolfinx  # noqa: F401
