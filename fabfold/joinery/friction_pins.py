"""Friction pins: loose pins that both of their bodies grip, for hinges that nothing else holds.

The bores of the body that turns on a pin are lined until they are as narrow as those of the body
that holds it. The pin then rubs when the hinge turns, and the hinge stays where it is let go.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from fabfold.joinery.barrel_sweeps import descendants
from fabfold.joinery.bodies import BodyMesh, Joinery
from fabfold.joinery.body_poses import poses_in_mm
from fabfold.joinery.booleans import union
from fabfold.joinery.cells import as_manifold
from fabfold.joinery.loose_pins import PinBore, cylinder_between
from fabfold.joinery.soundness import printable_body
from fabfold.meshes import centre_of_mass
from fabfold.tree.fold_tree import FoldTree

if TYPE_CHECKING:
    import manifold3d

__all__ = ["PinFriction", "pin_friction", "with_friction"]

Floats = NDArray[np.float64]

#: Stiffness of printed material, N/mm²: the low end of what filament and powder makers tell.
_STIFF: Final[dict[str, float]] = {"pla": 2300.0, "petg": 1500.0, "resin": 1500.0, "pa12": 1400.0}
#: Poisson's number, and the coefficient of friction of plastic on plastic.
_POISSON, _RUB = 0.35, 0.3
_GRAVITY: Final = 9.81
#: The lining reaches this far into the wall around the bore, mm.
_BITE_MM = 0.2


@dataclass(frozen=True)
class PinFriction:
    """Pins that both bodies grip.

    Attributes
    ----------
    hinges : tuple of int
        Indices of their hinges.
    drawn_mm : float
        How much wider than the pin their bores are drawn, in radius, mm.
    strain : float
        Strain that the material bears again and again, as a share of 1.
    narrower_mm : float
        How much narrower than the pin, in radius, a bore may come out until that is reached, mm.
    torque_nmm : float
        Torque against which one pin then holds, N mm.
    needed_nmm : float
        Largest torque of the weight about any of these hinges in the box, N mm: of either of its
        sides, whatever is up.
    """

    hinges: tuple[int, ...]
    drawn_mm: float
    strain: float
    narrower_mm: float
    torque_nmm: float
    needed_nmm: float

    def to_json(self) -> dict[str, Any]:
        """Ready for a JSON file."""
        return {**asdict(self), "hinges": list(self.hinges)}

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> PinFriction:
        """Friction from what :meth:`to_json` wrote."""
        return cls(**{**data, "hinges": tuple(data["hinges"])})


def pin_friction(
    tree: FoldTree,
    joinery: Joinery,
    angles_deg: Floats,
    hinges: Sequence[int],
    *,
    material: str,
    density_g_cm3: float,
    grip_mm: float,
) -> PinFriction:
    """How well pins hold that both bodies grip.

    A knuckle that is pressed on a pin is a thick ring (Lamé): the pressure that widens its bore by
    u is E u / (a ((b² + a²) / (b² - a²) + ν)), with bore radius a and barrel radius b. Over the
    length of the turning body's knuckles it rubs with a coefficient of 0.3.

    Parameters
    ----------
    tree, joinery
        The bodies with their pins.
    angles_deg : (h,) float64 array
        Angles of all hinges in the box, degrees.
    hinges : sequence of int
        Indices of the hinges that get such pins.
    material : str
        What is printed, such as ``"PLA"``; what none of its words tells counts as resin.
    density_g_cm3 : float
        Of the material.
    grip_mm : float
        How much wider than the pin the bore is drawn, in radius, mm.

    Returns
    -------
    PinFriction
        Strain, torque, and what the weight asks for at most.
    """
    from hinges.retention import STRAIN_LIMITS

    kind = next((w for w in material.lower().split() if w in _STIFF), "resin")
    strain = STRAIN_LIMITS[kind]
    a, b = joinery.pin_radius_mm, joinery.barrel_radius_mm
    narrower = strain * a
    pressure = _STIFF[kind] * narrower / (a * ((b * b + a * a) / (b * b - a * a) + _POISSON))
    length = sum(high - low for low, high in _turning_knuckles(joinery))
    torque = _RUB * pressure * 2.0 * np.pi * a * a * length
    return PinFriction(
        tuple(hinges),
        grip_mm,
        strain,
        round(narrower, 4),
        round(torque, 1),
        round(_weight_torque(tree, joinery, angles_deg, hinges, density_g_cm3), 1),
    )


def _weight_torque(
    tree: FoldTree, joinery: Joinery, angles_deg: Floats, hinges: Sequence[int], density: float
) -> float:
    """Largest torque of the weight of a side about any of these hinges, whatever is up."""
    if not hinges:
        return 0.0
    poses = poses_in_mm(tree, joinery, angles_deg)
    volume = np.array([body.volume for body in joinery.bodies])
    middles = np.array(
        [
            pose[:3, :3] @ centre_of_mass(body.vertices[body.faces]) + pose[:3, 3]
            for body, pose in zip(joinery.bodies, poses, strict=True)
        ]
    )
    carried = descendants(tree)
    torques = []
    for index in hinges:
        hinge, pose = tree.hinges[index], poses[tree.hinges[index].parent]
        point = np.asarray(joinery.origin_mm) + joinery.voxel_mm * np.asarray(hinge.point)
        axis = pose[:3, :3] @ np.asarray(hinge.direction, dtype=float)
        place = pose[:3, :3] @ point + pose[:3, 3]
        for side in (carried[index], ~carried[index]):
            share = volume * side
            arm = share @ (middles - place) / share.sum()
            across = float(np.linalg.norm(np.cross(axis, arm)))
            torques.append(share.sum() * density * 1e-6 * _GRAVITY * across)
    return float(max(torques))


def _turning_knuckles(joinery: Joinery) -> list[tuple[float, float]]:
    """Both ends of the knuckles that turn on the pin, along the axis from its middle, mm."""
    from hinges.clearance import Clearance
    from hinges.knuckles import lay_out_knuckles

    clear = Clearance(joinery.clearance_mm)
    layout = lay_out_knuckles(
        joinery.voxel_mm,
        joinery.knuckles,
        joinery.barrel_radius_mm,
        clear,
        joinery.barrel_radius_mm + joinery.clearance_mm,
    )
    return [(k.start, k.end) for k in layout.knuckles if k.owner != layout.pin_owner]


def with_friction(
    joinery: Joinery,
    bores: Sequence[PinBore],
    hinges: Sequence[int],
    grip_mm: float,
    slip_mm: float,
) -> Joinery:
    """Line the bores of some hinges so that both bodies grip the pin.

    Parameters
    ----------
    joinery : Joinery
        The bodies as they are printed, with their pins.
    bores : sequence of PinBore
        Where the pins go, one for each hinge.
    hinges : sequence of int
        Indices of the hinges.
    grip_mm, slip_mm : float
        How much wider than the pin the bores are, in radius, mm: where the pin is gripped, and
        where it turns.

    Returns
    -------
    Joinery
        With the linings; the pins of these hinges are marked as tight.
    """
    linings: dict[int, list[manifold3d.Manifold]] = {}
    for index in hinges:
        bore = bores[index]
        turning = next(body for body in bore.bodies if body != bore.owner)
        for low, high in _turning_knuckles(joinery):
            ends = bore.middle + low * bore.axis, bore.middle + high * bore.axis
            tube = cylinder_between(
                *ends, joinery.pin_radius_mm + slip_mm + _BITE_MM, outside=False
            ) - cylinder_between(
                ends[0] - bore.axis,
                ends[1] + bore.axis,
                joinery.pin_radius_mm + grip_mm,
                outside=True,
            )
            linings.setdefault(turning, []).append(tube)
    bodies = list(joinery.bodies)
    for body, tubes in sorted(linings.items()):
        mesh = bodies[body]
        solid = union([as_manifold(mesh.vertices, mesh.faces, mesh.name), *tubes])
        bodies[body] = BodyMesh(mesh.name, *printable_body(solid, mesh.name, np.zeros(3)))
    pins = tuple(replace(pin, tight=pin.tight or pin.hinge in hinges) for pin in joinery.pins)
    return replace(joinery, bodies=tuple(bodies), pins=pins)
