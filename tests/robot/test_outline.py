"""Points and circles of shapes in the x-z plane: what can touch, wherever the body is turned."""

from __future__ import annotations

import coal
import numpy as np
import pinocchio as pin
import pytest

from fesd_robot.errors import RobotError
from fesd_robot.robot.model_file import Shape
from fesd_robot.robot.outline import touching_outlines

DOWN = np.array([0.0, 0.0, -1.0])
ALONG_X, ALONG_Y = pin.utils.rotate("y", np.pi / 2), pin.utils.rotate("x", np.pi / 2)


def _shape(geometry, turn=None, place=(0.0, 0.0, 0.0)) -> Shape:
    placement = pin.SE3(np.eye(3) if turn is None else turn, np.array(place))
    return Shape("shape", "body", placement, geometry, np.ones(4), touches=True, visible=True, friction=0.7)


def _tilted(angle: float) -> pin.SE3:
    return pin.SE3(pin.utils.rotate("y", angle), np.array([0.3, 0.0, 0.5]))


def _touching(shapes: list[Shape], body: pin.SE3, towards: np.ndarray = DOWN) -> list[list[float]]:
    """World x, z and radius of what can touch."""
    found = touching_outlines(shapes, body, towards)
    return [[*body.act(one.place)[[0, 2]], one.radius] for one in found]


def test_a_box_stands_on_its_lower_corners():
    """From the back to the front, two points, each with the friction of its shape."""
    found = touching_outlines([_shape(coal.Box(0.4, 0.3, 0.2))], pin.SE3.Identity(), DOWN)
    assert [(*one.place.round(12)[[0, 2]], one.radius, one.friction) for one in found] == [
        (-0.2, -0.1, 0.0, 0.7),
        (0.2, -0.1, 0.0, 0.7),
    ]


@pytest.mark.parametrize("angle", [0.3, -0.3])
def test_a_tilted_box_still_stands_on_the_same_corners(angle):
    """The corners are those of the side that is nearer to the ground."""
    found = touching_outlines([_shape(coal.Box(0.4, 0.3, 0.2))], _tilted(angle), DOWN)
    lowest = {(-0.2, -0.1), (0.2, -0.1)}
    assert lowest <= {tuple(one.place.round(12)[[0, 2]]) for one in found}


def test_a_box_leans_on_a_wall_with_its_side():
    """Towards +x the corners of the right side can touch, from below to above."""
    found = _touching([_shape(coal.Box(0.4, 0.3, 0.2))], pin.SE3.Identity(), np.array([1.0, 0.0, 0.0]))
    assert found == pytest.approx(np.array([[0.2, -0.1, 0.0], [0.2, 0.1, 0.0]]))


def test_capsules_touch_with_their_ends():
    """Lying along x with both, across with one circle, and upright with the lower end only."""
    capsule = coal.Capsule(0.05, 0.4)
    body = pin.SE3.Identity()
    assert _touching([_shape(capsule, ALONG_X)], body) == pytest.approx(np.array([[-0.2, 0, 0.05], [0.2, 0, 0.05]]))
    assert _touching([_shape(capsule, ALONG_Y)], body) == pytest.approx(np.array([[0, 0, 0.05]]))
    assert _touching([_shape(capsule)], body) == pytest.approx(np.array([[0, -0.2, 0.05]]))


def test_cylinders_touch_with_rims_or_roll():
    """An upright cylinder stands on its rim, a point at the back and one in front; one across is a wheel."""
    cylinder = coal.Cylinder(0.1, 0.6)
    upright = _touching([_shape(cylinder)], pin.SE3.Identity())
    assert upright == pytest.approx(np.array([[-0.1, -0.3, 0], [0.1, -0.3, 0]]))
    assert _touching([_shape(cylinder, ALONG_Y)], pin.SE3.Identity()) == pytest.approx(np.array([[0, 0, 0.1]]))


def test_what_lies_inside_cannot_touch():
    """Of all shapes of a body together only the outermost count, and two at the same place are one."""
    ball = _shape(coal.Sphere(0.1))
    small = _shape(coal.Sphere(0.02), place=(0.0, 0.0, 0.05))
    assert _touching([ball, small, ball], pin.SE3.Identity()) == pytest.approx(np.array([[0, 0, 0.1]]))


@pytest.mark.parametrize(
    ("shape", "words"),
    [
        (_shape(coal.Capsule(0.1, 0.2), pin.utils.rotate("x", 0.5)), "at a slant to the x-z plane"),
        (_shape(coal.Box(0.1, 0.2, 0.3), pin.utils.rotate("z", 0.5)), "at a slant to the x-z plane"),
        (_shape(coal.Ellipsoid(0.1, 0.2, 0.3)), "an? ellipsoid, expected a sphere, capsule, cylinder or box"),
    ],
)
def test_other_shapes_are_refused(shape, words):
    """A shape whose outline is neither points nor circles is named, with what to write instead."""
    with pytest.raises(RobotError, match=words) as caught:
        touching_outlines([shape], pin.SE3.Identity(), DOWN)
    assert "'frame' and 'offset'" in str(caught.value)
