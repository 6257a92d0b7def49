"""URDF: the bodies and the hinges that join them, for what STEP cannot carry.

Simulators (MuJoCo, PyBullet, Gazebo, RViz) read it. Each body is a link with its STL file, each
hinge a revolute joint with the range that it turns through on the path.
"""

from __future__ import annotations

from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from fabfold.files import write_text
from fabfold.fold.motion import Motion
from fabfold.joinery.bodies import Joinery
from fabfold.tree.fold_tree import FoldTree

__all__ = ["urdf_text", "write_urdf"]

#: Printed nylon, kg/mm³.
_DENSITY = 1.01e-6
_M = 1e-3


def urdf_text(joinery: Joinery, tree: FoldTree, motion: Motion, title: str) -> str:
    """The robot of a kit, in metres, with meshes in ``bodies/``.

    Parameters
    ----------
    joinery : Joinery
        The printed bodies in shape A.
    tree : FoldTree
        The bodies and their hinges.
    motion : Motion
        The folding path; it tells the range of each hinge.
    title : str
        Name of the robot.

    Returns
    -------
    str
        XML. The frame of a body lies in the middle of the hinge that carries it, with the axes of
        shape A; that of the first body in the origin.
    """
    origin = np.asarray(joinery.origin_mm)
    place = {0: np.zeros(3)}
    for hinge in tree.hinges:
        place[hinge.child] = origin + joinery.voxel_mm * np.asarray(hinge.point, dtype=float)
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f"<robot name={quoteattr(title)}>",
        # MuJoCo would look for the meshes beside the file; other readers pass this over.
        '  <mujoco><compiler strippath="false" balanceinertia="true" fusestatic="false"/></mujoco>',
    ]
    for index, body in enumerate(joinery.bodies):
        shift = _vector(-_M * place[index])
        mesh = f'<mesh filename="bodies/{body.name}.stl" scale="0.001 0.001 0.001"/>'
        corner, far = body.vertices.min(axis=0), body.vertices.max(axis=0)
        mass = _DENSITY * body.volume
        # Inertia of a block of its size: enough for a simulator to be stable.
        x, y, z = _M * (far - corner)
        moments = mass / 12.0 * np.array([y * y + z * z, x * x + z * z, x * x + y * y])
        centre = _vector(_M * ((corner + far) / 2 - place[index]))
        lines += [
            f'  <link name="{body.name}">',
            "    <inertial>",
            f'      <origin xyz="{centre}"/>',
            f'      <mass value="{mass:.6g}"/>',
            f'      <inertia ixx="{moments[0]:.6g}" ixy="0" ixz="0" iyy="{moments[1]:.6g}" '
            f'iyz="0" izz="{moments[2]:.6g}"/>',
            "    </inertial>",
            f'    <visual><origin xyz="{shift}"/><geometry>{mesh}</geometry></visual>',
            f'    <collision><origin xyz="{shift}"/><geometry>{mesh}</geometry></collision>',
            "  </link>",
        ]
    angles = np.radians(motion.angles_deg)
    for index, hinge in enumerate(tree.hinges):
        low, high = float(angles[:, index].min()), float(angles[:, index].max())
        lines += [
            f'  <joint name="{hinge.name}" type="revolute">',
            f'    <parent link="{joinery.bodies[hinge.parent].name}"/>',
            f'    <child link="{joinery.bodies[hinge.child].name}"/>',
            f'    <origin xyz="{_vector(_M * (place[hinge.child] - place[hinge.parent]))}"/>',
            f'    <axis xyz="{_vector(np.asarray(hinge.direction, dtype=float))}"/>',
            f'    <limit lower="{low:.6f}" upper="{high:.6f}" effort="1" velocity="1"/>',
            "  </joint>",
        ]
    return "\n".join([*lines, "</robot>", ""])


def _vector(values: np.ndarray) -> str:
    return " ".join(f"{value + 0.0:.9g}" for value in values)


def write_urdf(path: Path, joinery: Joinery, tree: FoldTree, motion: Motion, title: str) -> None:
    """Write :func:`urdf_text` to `path`."""
    write_text(path, urdf_text(joinery, tree, motion, title))
