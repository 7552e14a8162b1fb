"""Motions over uneven and sloped ground against integrations by scipy that know nothing of complementarity."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fesd_robot.contact import (
    CircleOnCircle,
    CircleOnSurface,
    ContactGeometry,
    ContactOptions,
    MultibodyDynamics,
    Plane,
    PointOnSurface,
    Surface,
    Wall,
    contact_of,
    contact_system,
)
from fesd_robot.fesd import FesdOptions, SimulationSettings, make_tableau, simulate
from fesd_robot.mpcc import HomotopyOptions
from fesd_robot.recovery import PhysicalMotion, recover
from fesd_robot.robot import Robot, configuration_derivative, load_robot, mass_matrix, nonlinear_effects

from .grounds import HILLS
from .motions import branch_of

DISCS = Path(__file__).parent / "models" / "discs.urdf"
GRAVITY, MASS, INERTIA, RADIUS = 9.81, 2.0, 0.04, 0.2
AUXILIARY_FORCE = 200.0
WEDGE = Plane(slope=0.5)


def simulated(
    pairs: dict[str, tuple[ContactGeometry, float]],
    q: np.ndarray,
    v: np.ndarray,
    *,
    duration: float,
    steps: int,
    form: str = "multipliers",
    elements: int = 2,
    stages: int = 3,
) -> PhysicalMotion:
    """Return the motion of the two discs without any drive, by finite elements.

    Args:
        pairs: name -> geometry and friction coefficient.
        duration: numerical time, s.
    """
    robot, tableau = load_robot(DISCS), make_tableau("radau_iia", stages)
    dynamics = _multibody_dynamics(robot)
    contacts = [
        contact_of(robot, dynamics.configuration, pair, name=name, friction=friction)
        for name, (pair, friction) in pairs.items()
    ]
    system = contact_system(
        dynamics,
        contacts,
        ContactOptions(form=form, auxiliary_force=AUXILIARY_FORCE),  # type: ignore[arg-type]
    )
    gaps = ca.Function("gaps", [dynamics.configuration], [ca.vertcat(*[contact.gap for contact in contacts])])
    initial = np.concatenate([q, v, [0.0], np.maximum(np.asarray(gaps(q).full()).ravel(), 0.0)])
    lower = np.full(initial.size, -np.inf)
    lower[-len(contacts) :] = system.gap_lower
    simulation = simulate(
        system.system,
        initial,
        np.ones((1, steps)),
        duration,
        options=FesdOptions(tableau=tableau, elements=elements),
        settings=SimulationSettings(
            homotopy=HomotopyOptions(tolerance=1e-10, sigma_factor=0.1, velocity_level_ratio=1.0), state_lower=lower
        ),
    )
    branch = branch_of(system, simulation.elements)
    return recover(simulation.elements, branch, tableau, dynamics, contacts, system, AUXILIARY_FORCE)


def _multibody_dynamics(robot: Robot) -> MultibodyDynamics:
    q, v = ca.SX.sym("q", robot.model.nq), ca.SX.sym("v", robot.model.nv)
    return MultibodyDynamics(
        configuration=q,
        velocity=v,
        control=ca.SX.sym("u", 0),
        configuration_derivative=configuration_derivative(robot, q, v),
        mass_matrix=mass_matrix(robot, q),
        force=-nonlinear_effects(robot, q, v),
        configuration_names=robot.configuration_names,
        velocity_names=robot.velocity_names,
        control_names=[],
    )


@dataclass(frozen=True)
class Slide:
    """A body that slides on z = h(x), as scipy integrates it.

    Args:
        surface: the curve of its centre.
        radius: arm of the friction that turns it, m; zero for a point.
    """

    surface: Surface
    friction: float
    radius: float = 0.0

    def _curve(self, x: float) -> tuple[float, float, float]:
        """Slope angle, curvature and dx/ds of the centre's curve, by differences of its tangent."""
        step = 1e-5
        ends = [np.asarray(self.surface.axes(np.array([x + h, 0.0, 0.0])).tangent) for h in (-step, 0.0, step)]
        angles = [float(np.arctan2(tangent[2], tangent[0])) for tangent in ends]
        return angles[1], (angles[2] - angles[0]) / (2 * step) * float(np.cos(angles[1])), float(np.cos(angles[1]))

    def _rates(self, _: float, y: np.ndarray) -> list[float]:
        """Of x, speed along the curve, angle, angular speed, while the contact slips."""
        angle, curvature, advance = self._curve(y[0])
        normal = MASS * (GRAVITY * np.cos(angle) + curvature * y[1] ** 2)
        force = -self.friction * normal * np.sign(y[1] - self.radius * y[3])
        return [
            y[1] * advance,
            -GRAVITY * np.sin(angle) + force / MASS,
            y[3],
            -self.radius * force / INERTIA,
        ]

    def after(self, duration: float, x: float, speed: float, spin: float = 0.0) -> np.ndarray:
        """State (x, speed, angle, angular speed) after sliding for a duration, s, without coming to stick."""
        solution = solve_ivp(self._rates, [0.0, duration], [x, speed, 0.0, spin], rtol=1e-10, atol=1e-12)
        assert (np.sign(solution.y[1] - self.radius * solution.y[3]) == np.sign(speed - self.radius * spin)).all()
        return np.asarray(solution.y[:, -1])


def height_of(surface: Surface, x: float, guess: float = 0.0) -> float:
    """z of a surface at x, by Newton's method."""
    z = guess
    for _ in range(50):
        point = np.array([x, 0.0, z])
        z -= float(surface.distance(point)) / float(surface.normal(point)[2])
    return z


@pytest.mark.slow
@pytest.mark.parametrize(
    ("form", "surface", "friction"),
    [
        ("multipliers", WEDGE, 0.3),
        ("steps", WEDGE, 0.3),
        ("multipliers", HILLS, 0.3),
        ("steps", HILLS, 0.3),
        ("multipliers", HILLS, 0.0),
        ("steps", WEDGE, 0.0),
    ],
)
def test_a_point_slides_as_on_a_rail(form: str, surface: Surface, friction: float) -> None:
    """Sliding over a wedge and over hills, with and without friction, the point keeps to the curve and to scipy."""
    start, speed = 0.1, 2.0
    tangent = np.asarray(surface.axes(np.array([start, 0, 0])).tangent)
    q, v = np.zeros(6), np.zeros(6)
    q[:2], v[:2] = [start, height_of(surface, start)], speed * tangent[[0, 2]]
    recovered = simulated(
        {"tip": (PointOnSurface("first", surface), friction)}, q, v, duration=0.15, steps=2, form=form
    )
    x, along, _, _ = Slide(surface, friction).after(recovered.time[-1], start, speed)
    assert recovered.configuration[-1, :2] == pytest.approx([x, height_of(surface, x)], abs=1e-5)
    assert np.hypot(*recovered.velocity[-1, :2]) == pytest.approx(along, abs=2e-5)
    assert set(recovered.mode[:, 0]) == {"slip"}


@pytest.mark.slow
@pytest.mark.parametrize("surface", [WEDGE, HILLS], ids=["wedge", "hills"])
def test_a_point_lands_on_a_slope(surface: Surface) -> None:
    """Dropped with v_t = 2 and v_n = -1 m/s, it touches down when the parabola meets the curve; v_t loses mu v_n."""
    x = 0.1
    q, v = np.zeros(6), np.zeros(6)
    q[:2] = [x, height_of(surface, x) + 0.02]
    tangent = np.asarray(surface.axes(np.array([x, 0, 0])).tangent)[[0, 2]]
    v[:2] = 2.0 * tangent - 1.0 * np.array([-tangent[1], tangent[0]])
    tip = {"tip": (PointOnSurface("first", surface), 0.3)}
    recovered = simulated(tip, q, v, duration=0.1, steps=2, elements=3, stages=2)

    def flight(time: float) -> np.ndarray:
        return np.array([q[0] + v[0] * time, 0.0, q[1] + v[1] * time - 0.5 * GRAVITY * time**2])

    event = solve_ivp(
        lambda t, y: [0.0], [0, 0.1], [0.0], events=lambda t, y: surface.distance(flight(t)), rtol=1e-12, max_step=0.01
    )
    touchdown = float(event.t_events[0][0])
    (switch,) = recovered.switches
    assert (switch.kind, switch.time) == ("touchdown", pytest.approx(touchdown, abs=3e-6))
    tangent = np.asarray(surface.axes(flight(touchdown)).tangent)[[0, 2]]
    before = np.array([v[0], v[1] - GRAVITY * touchdown])
    hit = abs(before @ [-tangent[1], tangent[0]])
    (impact,) = recovered.impacts
    assert impact.impulse[0] == pytest.approx([MASS * hit, -0.3 * MASS * hit], abs=1e-3)
    assert recovered.velocity[impact.after, :2] == pytest.approx((before @ tangent - 0.3 * hit) * tangent, abs=1e-3)
    left = Slide(surface, 0.3).after(recovered.time[-1] - touchdown, flight(touchdown)[0], before @ tangent - 0.3 * hit)
    assert recovered.configuration[-1, :2] == pytest.approx([left[0], height_of(surface, left[0])], abs=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("ground", [WEDGE, HILLS], ids=["wedge", "hills"])
def test_a_disc_slides_and_turns(ground: Surface) -> None:
    """A disc that touches down slipping is turned by friction while its centre runs on the raised curve."""
    path, start, speed = ground.raised(RADIUS), 0.1, 1.5
    tangent = np.asarray(path.axes(np.array([start, 0, 0])).tangent)
    q, v = np.zeros(6), np.zeros(6)
    q[:2], v[:2] = [start, height_of(path, start)], speed * tangent[[0, 2]]
    recovered = simulated({"rim": (CircleOnSurface("first", RADIUS, path), 0.2)}, q, v, duration=0.1, steps=2)
    x, along, turned, spin = Slide(path, 0.2, RADIUS).after(recovered.time[-1], start, speed)
    assert recovered.configuration[-1, :3] == pytest.approx([x, height_of(path, x), turned], abs=1e-5)
    assert np.hypot(*recovered.velocity[-1, :2]) == pytest.approx(along, abs=2e-5)
    assert recovered.velocity[-1, 2] == pytest.approx(spin, abs=2e-4)


def test_a_disc_rolls_down_a_wedge() -> None:
    """From rest on a rough wedge a disc rolls with g sin(slope) / (1 + I / (m r^2)) and friction I a / r^2."""
    path = WEDGE.raised(RADIUS)
    q = np.zeros(6)
    q[1] = height_of(path, 0.0)
    recovered = simulated({"rim": (CircleOnSurface("first", RADIUS, path), 0.8)}, q, np.zeros(6), duration=0.2, steps=2)
    acceleration = GRAVITY * np.sin(WEDGE.slope) / (1 + INERTIA / (MASS * RADIUS**2))
    speed = acceleration * recovered.time[-1]
    expected = [-speed * np.cos(WEDGE.slope), -speed * np.sin(WEDGE.slope), -speed / RADIUS]
    assert recovered.velocity[-1, :3] == pytest.approx(expected, abs=1e-7)
    forces = [MASS * GRAVITY * np.cos(WEDGE.slope), INERTIA * acceleration / RADIUS**2]
    assert recovered.force[-1, 0] == pytest.approx(forces, abs=1e-6)
    assert set(recovered.mode[:, 0]) == {"stick"}


@pytest.mark.parametrize("form", ["multipliers", "steps"])
def test_a_disc_rests_in_a_wedge(form: str) -> None:
    """Between a slope and a wall, both without friction, a disc rests on m g / cos(slope) and m g tan(slope)."""
    path, wall = WEDGE.raised(RADIUS), Wall(-RADIUS, "right").raised(RADIUS)
    q = np.zeros(6)
    q[1] = height_of(path, 0.0)
    pairs = {
        "slope": (CircleOnSurface("first", RADIUS, path), 0.0),
        "wall": (CircleOnSurface("first", RADIUS, wall), 0.0),
    }
    recovered = simulated(pairs, q, np.zeros(6), duration=0.1, steps=1, stages=2, form=form)
    assert recovered.configuration[-1, :3] == pytest.approx(q[:3], abs=1e-8)
    normal = [MASS * GRAVITY / np.cos(WEDGE.slope), MASS * GRAVITY * np.tan(WEDGE.slope)]
    assert recovered.force[-1] == pytest.approx(np.array([[normal[0], 0], [normal[1], 0]]), abs=1e-5)


def test_two_discs_collide() -> None:
    """Two discs without friction exchange the momentum of a plastic impact along the line of centres, and part."""
    q, v = np.zeros(6), np.zeros(6)
    q[3:5], v[0] = [np.sqrt(0.5**2 - 0.25**2) + 0.03, 0.25], 1.0
    rims = {"rims": (CircleOnCircle("first", 0.2, "second", 0.3), 0.0)}
    recovered = simulated(rims, q, v, duration=0.1, steps=1, elements=3, stages=2, form="steps")
    (impact,) = recovered.impacts
    at = recovered.configuration[impact.before]
    apart = at[[0, 1]] - at[[3, 4]]
    assert recovered.time[impact.before] == pytest.approx(0.03, abs=2e-6)
    assert np.linalg.norm(apart) == pytest.approx(0.5, abs=2e-6)
    normal = apart / np.linalg.norm(apart)
    before, after = recovered.velocity[impact.before], recovered.velocity[impact.after]
    size = -normal @ (before[:2] - before[3:5]) / (1 / 2 + 1 / 1)
    assert impact.impulse[0] == pytest.approx([size, 0], abs=3e-5)
    assert after[:2] == pytest.approx(before[:2] + size / 2 * normal, abs=3e-5)
    assert after[3:5] == pytest.approx(before[3:5] - size / 1 * normal, abs=3e-5)
    assert after[[2, 5]] == pytest.approx(0, abs=1e-9)
    assert recovered.switches[-1].kind == "takeoff"
