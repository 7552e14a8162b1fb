"""A leg on a vertical slide, as a URDF file whose knee is written in many ways, and a task of it."""

from __future__ import annotations

from pathlib import Path


def leg(knee: str, kind: str = "revolute", *, axis: str = "0 1 0", hip: str = "") -> str:
    """Return a leg that slides up and down; its knee has the given elements, its hip a <limit> of its own if given."""

    def body(length: float, mass: float) -> str:
        return (
            f'<inertial><origin xyz="0 0 {-length / 2}"/><mass value="{mass}"/>'
            '<inertia ixx="0.008" ixy="0" ixz="0" iyy="0.008" iyz="0" izz="0.001"/></inertial>'
        )

    hip = hip or '<limit lower="-2" upper="2" velocity="20" effort="40"/>'
    return (
        '<robot name="leg"><link name="base"/>'
        f'<link name="trunk">{body(0, 4)}</link><link name="thigh">{body(0.3, 1)}</link>'
        f'<link name="shank">{body(0.3, 0.5)}</link><link name="foot"/>'
        '<joint name="slide" type="prismatic"><parent link="base"/><child link="trunk"/><axis xyz="0 0 1"/>'
        '<limit lower="-1" upper="2" velocity="10" effort="0"/></joint>'
        f'<joint name="hip" type="revolute"><parent link="trunk"/><child link="thigh"/><axis xyz="0 1 0"/>{hip}</joint>'
        f'<joint name="knee" type="{kind}"><parent link="thigh"/><child link="shank"/><origin xyz="0 0 -0.3"/>'
        f'<axis xyz="{axis}"/>{knee}</joint>'
        '<joint name="ankle" type="fixed"><parent link="shank"/><child link="foot"/><origin xyz="0 0 -0.3"/></joint>'
        "</robot>"
    )


HEAD = (
    "name: leg\nrobot: {model: robot.urdf}\ncontacts: {foot: {frame: foot}}\nhorizon: {duration: 0.6, intervals: 12}\n"
)

STANDING = "stand_on: {contacts: [foot], adjust: [slide]}"


def task_of(folder: Path, model: str, lines: str) -> Path:
    """Write a model and a task of it, with further lines; return the path of the task."""
    (folder / "robot.urdf").write_text(model, encoding="utf-8")
    path = folder / "task.yaml"
    path.write_text(HEAD + lines, encoding="utf-8")
    return path
