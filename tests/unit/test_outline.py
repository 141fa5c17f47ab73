"""Where along an edge the contact ends."""

import numpy as np

from cellmech.outline import HALVINGS, _bisected


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
