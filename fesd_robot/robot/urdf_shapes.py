"""Shapes of a URDF file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import coal
import pinocchio as pin

from fesd_robot.robot.mesh_files import check_meshes, find_damaged, is_mesh
from fesd_robot.robot.urdf_elements import check_elements
from fesd_robot.robot.xml_file import read_xml, xml_text

_ELEMENTS = {pin.GeometryType.VISUAL: "visual", pin.GeometryType.COLLISION: "collision"}


def urdf_shapes(path: Path, model: pin.Model, kind: pin.GeometryType, directories: Sequence[Path]) -> pin.GeometryModel:
    """Return the shapes of a file on the bodies of its model.

    Args:
        path: the file.
        model: its robot.
        kind: what is drawn, or what may collide.
        directories: where addresses of meshes begin, in the order in which they are looked for.

    Raises:
        RobotError: if a mesh is missing or unreadable; names its link.
    """
    document = read_xml(path)
    check_elements(path, document)
    check_meshes(path, document, _ELEMENTS[kind], directories)
    loader = coal.CachedMeshLoader(coal.NODE_TYPE.BV_OBBRSS)  # legs share their meshes
    packages = [str(directory) for directory in directories]
    try:
        shapes = pin.buildGeomFromUrdfString(model, xml_text(document), kind, package_dirs=packages, mesh_loader=loader)
    except Exception:
        find_damaged(path, document, _ELEMENTS[kind], directories)
        raise
    if not all(is_mesh(shape.geometry) for shape in shapes.geometryObjects):
        find_damaged(path, document, _ELEMENTS[kind], directories)
    return shapes
