"""The impact law of impulses at once, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from fesd_robot.replay.impacts import impact


class _Bodies:
    """Contact kinematics and masses, given as they are."""

    rows = 2
    impacts_at_once = True

    def __init__(self, jacobian: np.ndarray, mass: np.ndarray, friction: float, restitution: float = 0.0) -> None:
        self._jacobian, self._mass = jacobian, mass
        count = len(jacobian) // 2
        self.friction, self.restitution = np.full(count, friction), np.full(count, restitution)

    def contact_jacobian(self, q: np.ndarray) -> np.ndarray:
        """Normal and tangent of every contact in turn."""
        return self._jacobian

    def mass_matrix(self, q: np.ndarray) -> np.ndarray:
        """Of the bodies."""
        return self._mass


MASS = _Bodies(np.array([[0.0, 1.0], [1.0, 0.0]]), 2.0 * np.eye(2), 0.3, 0.5)


@pytest.mark.parametrize(("along", "after"), [(4.0, 4.0 - 0.3 * 1.5 * 2.0), (0.5, 0.0), (-4.0, 0.3 * 1.5 * 2.0 - 4.0)])
def test_a_mass_slides_on_or_stops(along: float, after: float) -> None:
    """A mass that hits at 2 m/s bounces with e; its friction takes mu (1 + e) 2 m/s at most, and stops it before."""
    result = impact(MASS, np.zeros(2), np.array([along, -2.0]), np.array([True]))  # type: ignore[arg-type]
    assert result.finished
    assert result.velocity == pytest.approx([after, 1.0], abs=1e-12)
    assert result.impulse[0] == pytest.approx([2.0 * 3.0, 2.0 * (after - along)], abs=1e-12)


def test_a_body_that_rests_takes_the_impulse_on() -> None:
    """What falls on a body at rest on the ground stops, and both contacts have the impulse m v."""
    jacobian = np.array([[1.0, 0.0], [0.0, 0.0], [-1.0, 1.0], [0.0, 0.0]])
    bodies = _Bodies(jacobian, np.diag([1.0, 3.0]), 0.0)
    result = impact(bodies, np.zeros(2), np.array([0.0, -2.0]), np.ones(2, dtype=bool))  # type: ignore[arg-type]
    assert result.velocity == pytest.approx([0.0, 0.0], abs=1e-12)
    assert result.impulse[:, 0] == pytest.approx([6.0, 6.0], abs=1e-12)
