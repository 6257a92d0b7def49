"""The tolerance coupon as a build123d part: a strip of hinges at several clearances.

The strip prints lying, without support, in well under an hour. One turns every flap and notes the
smallest number whose flap moves freely; the plug and a piece of the pin tell the same for fits that
do not turn and for the bores of loose pins. :func:`hinges.write_coupon` writes it for a slicer.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING

from build123d import Align, BasePartObject, Color, Mode, Part, Plane, Solid

from .coupon_plan import DEFAULT_CLEARANCES, PIN_MM, CouponBody, coupon_meshes, plan_coupon
from .exact_solids import build_half, build_shape, laid, one_part, solids_of
from .exceptions import HingeError
from .shape_meshes import MeshPart
from .shapes import HalfPlan

if TYPE_CHECKING:
    from build123d import RotationLike

__all__ = ["Coupon", "coupon_solids"]


class Coupon(BasePartObject):  # type: ignore[misc]
    """A strip of hinges, sockets and bores at several clearances, on one frame, and a plug.

    The bed is the plane z = 0, the numbers are raised on the frame along x.

    Parameters
    ----------
    clearances : sequence of float
        Clearances in mm, each only once.
    wall : float
        Thinnest wall in mm.
    pin : float
        Diameter in mm of the loose pin that its bores are for.
    rotation, align, mode
        As for every build123d part.

    Attributes
    ----------
    clearances : tuple of float
        The clearances in mm.
    names : tuple of str
        Names of the bodies, in the order of the solids.
    meshes : tuple of MeshPart
        The bodies as meshes that never take room from a clearance.

    Raises
    ------
    FitError
        If a clearance is too large for the coupon's hinges.
    HingeError
        If there are no clearances or two alike, or the pin is none of 0.5 to 6 mm.

    Examples
    --------
    >>> coupon = Coupon([0.2, 0.3])
    >>> coupon.names
    ('frame', 'flap 0.2', 'flap 0.3', 'plug')
    """

    def __init__(
        self,
        clearances: Sequence[float] = DEFAULT_CLEARANCES,
        wall: float = 0.8,
        pin: float = PIN_MM,
        rotation: RotationLike = (0, 0, 0),
        align: Align | tuple[Align, Align, Align] | None = None,
        mode: Mode = Mode.ADD,
    ) -> None:
        self.clearances = tuple(clearances)
        self._bodies = plan_coupon(self.clearances, wall, pin)
        self.names = tuple(body.name for body in self._bodies)
        super().__init__(part=self._built(), rotation=rotation, align=align, mode=mode)
        self.label = "hinge coupon"
        self.color = Color(0.2, 0.45, 0.7)

    def _built(self) -> Part:
        """Build every body."""
        return one_part(coupon_solids(self._bodies))

    @cached_property
    def meshes(self) -> tuple[MeshPart, ...]:
        """The bodies as meshes, in the order of `names`."""
        return coupon_meshes(self._bodies)


def coupon_solids(bodies: Sequence[CouponBody]) -> list[Solid]:
    """Build every body exactly.

    Parameters
    ----------
    bodies : sequence of CouponBody
        The planned bodies.

    Returns
    -------
    list of Solid
        One a body, in mm.

    Raises
    ------
    HingeError
        If a body is not one solid.
    """
    built: dict[HalfPlan, Solid] = {}
    solids = []
    for body in bodies:
        parts = [build_shape(shape) for shape in body.shapes]
        for plan, matrix in body.halves:
            if plan not in built:
                built[plan] = build_half(plan, body.name).solid()
            origin, x_dir, z_dir = (tuple(map(float, matrix[:3, k])) for k in (3, 0, 2))
            frame = Plane(origin=origin, x_dir=x_dir, z_dir=z_dir)
            parts.append(laid(built[plan], frame.location))
        whole = solids_of(parts[0].fuse(*parts[1:]) if len(parts) > 1 else parts[0])
        if len(whole) != 1:
            raise HingeError(f"coupon: {body.name} came out in {len(whole)} pieces")
        solids += whole
    return solids
