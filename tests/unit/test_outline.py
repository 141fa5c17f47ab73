"""Where along an edge the contact ends."""

import numpy as np
import pytest
from dolfinx import fem
from mpi4py import MPI

from cellmech.cell.layering import mesh_plan
from cellmech.cell.setup import Setup
from cellmech.fem.crossing import crossing_of
from cellmech.fem.outline import HALVINGS, _bisected
from cellmech.scene.files import read_scene

SCENE = read_scene({"mesh": {"size_um": 8.0}}, "test")


def test_bisection_in_one_go_is_the_one_step_by_step():
    """Also where the state changes more than once."""
    random = np.random.default_rng(0)
    left = random.random(200)
    right, changes = left + 0.125, np.sort(left + 0.125 * random.random((3, 200)), axis=0)

    def same(s):
        return np.sum(s > changes[:, None, :] if s.ndim == 2 else s > changes, axis=0) % 2 == 0

    found = _bisected(left, right, same)
    for _ in range(HALVINGS):
        middle = (left + right) / 2
        unchanged = same(middle)
        left, right = np.where(unchanged, middle, left), np.where(unchanged, right, middle)
    for one, other in zip(found, (left, right), strict=True):
        assert np.max(np.abs(one - other)) < 4e-16


class Spike:
    """A wedge narrower than the samples of an edge are apart, whose tip pokes into it; as an obstacle is."""

    length_um = 1.0

    def __init__(self, at, half_width):
        self.at, self.half_width = at, half_width

    def level_set(self, x):
        """Depth, 0 at the wedge's sides and the deepest in its middle."""
        return 1e-3 * (1 - np.abs(x[0] - self.at) / self.half_width) - 0 * x[1]

    def gradient(self, x):
        """Of length 1, so that the depth is the level set."""
        return np.zeros_like(x[0]), -np.ones_like(x[1])


@pytest.mark.parametrize("half_width", [0.01, 0.2])
def test_contact_narrower_than_the_samples_has_its_width(half_width):
    """A force of 15 Pa um was told of on a contact that was 0 wide."""
    run = Setup(SCENE, MPI.COMM_SELF, mesh_plan(SCENE)).create_run(lambda line: None)
    outline, rest = run.outline, fem.Function(run.body.space)
    x = outline.nodes(rest)
    edge = x[np.argmin(np.abs(x[:, :2, 0].mean(axis=1) - 3.0))]
    low, high = sorted(edge[:2, 0])
    samples = low + (high - low) * np.linspace(0, 1, 9)
    spike = Spike((samples[3] + samples[4]) / 2 + 1e-3 * (high - low), half_width * (samples[1] - samples[0]))
    found = outline.contact_length_x(rest, [spike], 0.0)
    twice = np.sum((x[..., 0].min(axis=1) < spike.at) & (x[..., 0].max(axis=1) > spike.at))  # below and above
    assert twice == 2 and found == pytest.approx(twice * 2 * spike.half_width, rel=1e-6)
    assert 0.5e-3 < outline.max_depth(rest, [spike]) <= 1e-3
    run.close()


def test_outline_that_crosses_itself_is_found_and_one_that_touches_its_neighbours_is_not():
    angle = np.linspace(0.0, 2 * np.pi, 41)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    closed = np.stack([circle[:-1], circle[1:]], axis=1)
    assert crossing_of(closed) is None and crossing_of(closed[:0]) is None
    angle += 0.07  # no two ends meet where it crosses
    eight = np.stack([np.sin(angle), np.sin(2 * angle)], axis=-1)
    place = crossing_of(np.stack([eight[:-1], eight[1:]], axis=1))
    assert np.hypot(*place) < 0.3
    right = closed[closed[..., 0].min(axis=1) > -1e-12]
    assert crossing_of(right, 0.0) is None
    assert crossing_of(right - [0.1, 0.0], 0.0) is not None


def test_outline_of_a_state_is_looked_at():
    run = Setup(SCENE, MPI.COMM_SELF, mesh_plan(SCENE)).create_run(lambda line: None)
    assert run.crossing() is None
    assert run.outline.crossing(run.state.u, (0,)) is None
    top = run.body.space.tabulate_dof_coordinates()[:, 1] > 9.0
    run.u.reshape(-1, 2)[top, 1] -= 25.0  # the upper half falls through the lower
    assert run.outline.crossing(run.state.u, (0,)) is not None
    assert run.crossing() is None  # nothing pulls, and nothing is looked for
    run.close()
