"""Sizes of nodal vectors, and of an error beside what a run has come to."""

from __future__ import annotations

import numpy as np
from mpi4py import MPI

from cellmech.solver.state import State


class Sizes:
    """The largest displacement, deformation and mean velocity so far, by which errors are measured.

    Args:
        state: the displacements.
        inertia: whether the body has mass.
    """

    def __init__(self, state: State, inertia: bool) -> None:
        self.state, self.inertia = state, inertia
        self.dofmap = state.u.function_space.dofmap
        self.comm: MPI.Comm = state.u.function_space.mesh.comm
        self.so_far: list[float] = []  # displacement, its deforming part [µm], mean velocity [µm/s]
        self._now: list[float] = []  # the same with the state that was measured last

    def relative(self, error: np.ndarray, small_um: float, formula: tuple[float, float, float] | None = None) -> float:
        """Largest nodal length of an error [µm] over the largest displacement so far [-]. Collective.

        With inertia also that of its deforming part over the largest such part, as how far a body fell is no measure of
        how accurately it is deformed; and, given the step's formula [1/s], the mean velocity's over the largest such
        velocity: what a step makes of it, an impact in it above all, is carried along.

        Args:
            error: nodal vector [µm].
            small_um: the least displacement that errors are measured by [µm].
            formula: of the step.
        """
        u, size = self.state.u.x.array, self.largest_node
        sizes = [(size(u), size(error), small_um)]
        if self.inertia:
            sizes.append((size(self._deforming(u)), size(self._deforming(error)), small_um))
        if self.inertia and formula is not None:
            velocity, rate = self.state.nodal_velocity(formula), formula[0]
            sizes.append((size(self._mean(velocity)), size(self._mean(rate * error)), rate * small_um))
        largest = [*self.so_far, *[0.0] * len(sizes)]
        self._now = [max(now, before) for (now, _, _), before in zip(sizes, largest, strict=False)]
        pairs = zip(sizes, self._now, strict=True)
        return max(wrong / max(most, least) for (_, wrong, least), most in pairs)

    def keep(self) -> None:
        """Count the state that was measured last."""
        self.so_far = self._now

    def largest_node(self, values: np.ndarray) -> float:
        """Largest length of a nodal vector over all ranks, in the vector's unit. Collective."""
        squares = np.sum(values.reshape(-1, self.dofmap.index_map_bs) ** 2, axis=1)
        return self.comm.allreduce(float(np.sqrt(np.max(squares, initial=0.0))), op=MPI.MAX)

    def _mean(self, values: np.ndarray) -> np.ndarray:
        """Mean of a nodal vector. Collective."""
        index_map = self.dofmap.index_map
        total = self.comm.allreduce(values.reshape(-1, self.dofmap.index_map_bs)[: index_map.size_local].sum(axis=0))
        return np.asarray(total / index_map.size_global)

    def _deforming(self, values: np.ndarray) -> np.ndarray:
        """A nodal vector less its mean. Collective."""
        return (values.reshape(-1, self.dofmap.index_map_bs) - self._mean(values)).ravel()
