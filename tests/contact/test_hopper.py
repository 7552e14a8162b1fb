"""The hopper's contact in exact numbers: inverse inertia, resting force, rate of the clock, drop."""

from __future__ import annotations

from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from fesd_robot.fesd import FesdOptions, Simulation, SimulationSettings, make_tableau, simulate
from fesd_robot.mpcc import HomotopyOptions
from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.recovery import PhysicalMotion, recover
from fesd_robot.task import load_task

from .motions import branch_of

TASK = Path(__file__).parents[2] / "tasks" / "published_hopper_one_jump.yaml"
INVERSE_INERTIA = 10.909090909090909
RESTING_FORCE = 0.89925
CLOCK_RATE = 0.99108764435810970
AUXILIARY_FORCE = 100.0
SOLVER = HomotopyOptions(tolerance=1e-9, max_iterations=200)


def _motion(form: str, *overrides: str) -> MotionProblem:
    return formulate(load_task(TASK, ["method.grid=uniform", f"method.formulation={{type: {form}}}", *overrides]))


@pytest.fixture(scope="module", params=["multipliers", "steps"])
def motion(request: pytest.FixtureRequest) -> MotionProblem:
    return _motion(request.param)


def _standing(height: float = 0.5, clock: float = 0.0, fall: float = 0.0) -> np.ndarray:
    """Upright with a leg of 0.5 m at a height of the body, falling at a speed: q, v, t, p."""
    return np.array([0, height, 0, 0.5, 0, -fall, 0, 0, clock, height - 0.5])


def _run(
    motion: MotionProblem, start: np.ndarray, duration: float, steps: int, elements: int, force: float = 0.0
) -> tuple[Simulation, PhysicalMotion]:
    tableau = make_tableau("radau_iia", 2)
    lower = np.full(len(start), -np.inf)
    lower[-1] = motion.contact_system.gap_lower
    simulation = simulate(
        motion.contact_system.system,
        start,
        np.tile([[0.0], [force], [1.0]], (1, steps)),
        duration,
        options=FesdOptions(tableau=tableau, elements=elements, step_freedom=elements - 1),
        parameters=np.zeros(motion.ocp.system.parameters.numel()),
        settings=SimulationSettings(homotopy=SOLVER, state_lower=lower),
    )
    system, elements = motion.contact_system, simulation.elements
    branch = branch_of(system, elements)
    physical = recover(elements, branch, tableau, motion.dynamics, motion.contacts, system, AUXILIARY_FORCE)
    return simulation, physical


def test_inverse_inertia_and_resting_force(motion: MotionProblem) -> None:
    """D = J_n M⁻¹ J_nᵀ = 120/11, and the leg at rest is carried by λ_n = -φ/D = 0.89925 N."""
    (contact,) = motion.contacts
    dynamics = motion.dynamics
    inverse = ca.inv(dynamics.mass_matrix)
    arguments = [dynamics.configuration, dynamics.velocity, dynamics.control]
    inertia = ca.mtimes([contact.normal.T, inverse, contact.normal])
    acceleration = ca.mtimes([contact.normal.T, inverse, dynamics.force])
    inverse_inertia, phi = (
        float(value)
        for value in ca.Function("contact", arguments, [inertia, acceleration])(
            _standing()[:4], np.zeros(4), np.zeros(2)
        )
    )
    assert inverse_inertia == pytest.approx(INVERSE_INERTIA, rel=1e-14)
    assert phi == pytest.approx(-9.81, rel=1e-14)
    assert -phi / inverse_inertia == pytest.approx(RESTING_FORCE, rel=1e-14)
    assert motion.auxiliary_force == AUXILIARY_FORCE
    push = inverse_inertia * AUXILIARY_FORCE
    assert push / (push - phi) == pytest.approx(CLOCK_RATE, rel=1e-14)


def test_directions_at_an_angle(motion: MotionProblem) -> None:
    """n = (0, 1, r sin θ, -cos θ) and t = (1, 0, r cos θ, sin θ); M⁻¹ couples them by sin θ cos θ (r²/0.275 - 10)."""
    (contact,) = motion.contacts
    dynamics = motion.dynamics
    pitch, leg = 0.4, 0.35
    sin, cos = np.sin(pitch), np.cos(pitch)
    function = ca.Function(
        "contact",
        [dynamics.configuration],
        [contact.normal, contact.tangents, ca.inv(dynamics.mass_matrix), contact.gap],
    )
    normal, tangent, inverse, gap = (np.asarray(value.full()) for value in function([3, 1, pitch, leg]))
    assert normal.ravel() == pytest.approx([0, 1, leg * sin, -cos])
    assert tangent.ravel() == pytest.approx([1, 0, leg * cos, sin])
    assert gap.item() == pytest.approx(1 - leg * cos)
    assert (normal.T @ inverse @ tangent).item() == pytest.approx(sin * cos * (leg**2 / 0.275 - 10))


@pytest.mark.parametrize("split", [0.0, 0.5, 1.0])
def test_stance_is_a_sliding_mode(split: float) -> None:
    """The multiplier β = 1 - γ keeps the foot's normal velocity at zero; the clock runs at γ = 0.991087644358."""
    motion = _motion("multipliers")
    parts = motion.contact_system.system
    beta = 1 - CLOCK_RATE
    right = ca.Function("f", parts.arguments, [ca.solve(parts.mass_matrix, parts.right_hand_side)])
    multipliers = [beta * split, beta * (1 - split), CLOCK_RATE]
    p = np.zeros(motion.ocp.system.parameters.numel())
    rate = np.asarray(right(_standing(), [0, 0, 1], multipliers, p)).ravel()
    assert rate[5] - rate[7] == pytest.approx(0, abs=1e-13)  # J_n v' with J_n = (0, 1, 0, -1)
    assert rate[8] == pytest.approx(CLOCK_RATE, rel=1e-14)


def test_standing_still(motion: MotionProblem) -> None:
    """Without controls the body sinks on its leg: true clock rate to 1e-8, normal force 0.89925 N, foot at rest."""
    simulation, physical = _run(motion, _standing(), 0.1, 2, 2)
    assert physical.time[-1] / 0.1 == pytest.approx(CLOCK_RATE, abs=1e-8)
    assert physical.force[:, 0, 0] == pytest.approx(RESTING_FORCE, abs=1e-5)
    assert physical.force[:, 0, 1] == pytest.approx(0, abs=1e-5)
    assert set(physical.mode.ravel()) == {"stick"}
    assert (physical.impacts, physical.switches) == ([], [])
    # Body and leg together: 1.2 kg fall with the 1.1 kg body's weight minus the foot's force.
    t = physical.time[-1]
    drop = 0.5 * (9.81 - RESTING_FORCE / 1.1) * t**2
    assert simulation.states[-1][:4] == pytest.approx([0, 0.5 - drop, 0, 0.5 - drop], abs=1e-8)


def test_lifting_off(motion: MotionProblem) -> None:
    """Pulling the leg in with more than 1.0791 N lifts the foot at once; with less it stays."""
    for force, mode in ((-1.2, "flight"), (-0.9, "stick")):
        _, physical = _run(motion, _standing(), 0.05, 1, 2, force)
        assert set(physical.mode[1:].ravel()) == {mode}
        if mode == "stick":
            left = RESTING_FORCE * (1 + force / 1.0791)
            assert physical.force[1:, 0, 0] == pytest.approx(left, abs=1e-5)


IMPACT_TIME = 0.20192751093846089
IMPULSE = 0.18158331421141096


@pytest.mark.parametrize(("friction", "since"), [(0.0, 0.0), (0.45, 0.19)])
def test_drop(friction: float, since: float) -> None:
    """Dropped from 0.7 m: impact at 0.2019275 s, impulse 0.1815833 N s, then leg and body sink together.

    A vertical impact uses no friction, so its last moments are the same with it.
    """
    start = _standing(0.7 - 0.5 * 9.81 * since**2, since, 9.81 * since)
    steps = 5 if since == 0 else 1
    _, physical = _run(_motion("steps", f"ground.friction={friction}"), start, 0.05 * steps, steps, 3)
    (impact,) = physical.impacts
    assert physical.time[[impact.before, impact.after]] == pytest.approx(IMPACT_TIME, abs=5e-8)
    assert impact.impulse == pytest.approx(np.array([[IMPULSE, 0]]), abs=5e-8)
    assert physical.velocity[impact.before] == pytest.approx([0, -1.98090888230630134, 0, 0], abs=5e-7)
    after = -IMPULSE / 0.1  # the leg's 0.1 kg take the impulse; body and leg then move together
    assert physical.velocity[impact.after] == pytest.approx([0, after, 0, after], abs=5e-7)
    (switch,) = physical.switches
    assert (switch.kind, switch.contact) == ("touchdown", 0)
    assert switch.time == pytest.approx(IMPACT_TIME, abs=5e-8)
    assert physical.theta_sum_error <= 1e-12
    end = physical.time[-1]
    stance = end - IMPACT_TIME
    drop = after * stance - 0.5 * (9.81 - RESTING_FORCE / 1.1) * stance**2
    landing = 0.7 - 0.5 * 9.81 * IMPACT_TIME**2
    assert physical.configuration[-1] == pytest.approx([0, landing + drop, 0, 0.5 + drop], abs=5e-7)
    assert physical.force[-1, 0, 0] == pytest.approx(RESTING_FORCE, abs=1e-5)
