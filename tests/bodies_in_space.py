"""Models of bodies in space, each made of one line of numbers, and tasks with them."""

from __future__ import annotations

import itertools
from pathlib import Path

MASS = """<robot name="mass"><link name="world"/><link name="slide_x"/><link name="slide_y"/><link name="mass">
<inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="x" type="prismatic"><parent link="world"/><child link="slide_x"/><axis xyz="1 0 0"/>
<limit lower="-10" upper="10" velocity="20" effort="20"/></joint>
<joint name="y" type="prismatic"><parent link="slide_x"/><child link="slide_y"/><axis xyz="0 1 0"/>
<limit lower="-10" upper="10" velocity="20" effort="20"/></joint>
<joint name="z" type="prismatic"><parent link="slide_y"/><child link="mass"/><axis xyz="0 0 1"/>
<limit lower="-10" upper="10" velocity="20" effort="0"/></joint></robot>
"""
"""A mass of 1 kg, driven along x and y."""

BALL = """<robot name="ball"><link name="ball">
<inertial><mass value="0.5"/><inertia ixx="0.002" iyy="0.002" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><geometry><sphere radius="0.1"/></geometry></visual></link></robot>
"""
"""A solid ball of 0.5 kg and 0.1 m."""

BOX_SIDES = (0.2, 0.3, 0.16)


def box() -> str:
    """Return a box of 1 kg whose corners are frames c0 to c7."""
    x, y, z = (side / 2 for side in BOX_SIDES)
    inertia = (y * y + z * z) / 3, (x * x + z * z) / 3, (x * x + y * y) / 3
    corners = "".join(
        f"<link name='c{n}'/><joint name='c{n}' type='fixed'><parent link='box'/><child link='c{n}'/>"
        f"<origin xyz='{a * x} {b * y} {c * z}' rpy='0 0 0'/></joint>"
        for n, (a, b, c) in enumerate(itertools.product((-1, 1), repeat=3))
    )
    ixx, iyy, izz = inertia
    return (
        "<robot name='box'><link name='box'><inertial><mass value='1'/>"
        f"<inertia ixx='{ixx}' iyy='{iyy}' izz='{izz}' ixy='0' ixz='0' iyz='0'/></inertial></link>{corners}</robot>"
    )


def written(folder: Path, model: str, lines: str) -> Path:
    """Write a model and a task with it into a folder, and return the task's file.

    Args:
        model: text of the URDF file, which the task calls model.urdf.
        lines: of the task.
    """
    (folder / "model.urdf").write_text(model, encoding="utf-8")
    file = folder / "task.yaml"
    file.write_text(f"name: in_space\n{lines}", encoding="utf-8")
    return file
