"""What a manual says of what is in the box, of printing, and of putting together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from fabfold.guide.wording import listed, part_number
from fabfold.joinery.bodies import Joinery
from fabfold.joinery.pin_kinds import PINS
from fabfold.printing.print_mode import PrintMode
from fabfold.tree.fold_tree import FoldTree

if TYPE_CHECKING:
    from fabfold.apart.apart_kit import ApartKit
    from fabfold.guide.pauses import PrintPause
    from fabfold.joinery.box_hold import Retention

__all__ = ["WAY_BACK", "assembly_lines", "content_lines", "print_lines"]

#: What the last page says.
WAY_BACK = (
    "To unfold the box, follow the steps from the last to the first, and turn each arrow round. "
    "Never force a hinge: if it does not turn, the step before it is not done to its end."
)


def content_lines(
    joinery: Joinery, tree: FoldTree, mode: PrintMode, retention: Retention | None
) -> list[str]:
    """What is in the box, a line each.

    Parameters
    ----------
    joinery : Joinery
        The printed bodies and pins.
    tree : FoldTree
        The bodies and hinges.
    mode : PrintMode
        How it is printed.
    retention : Retention or None
        The magnets and friction pins, where there are any.
    """
    links = sum(not len(body.voxels) for body in tree.bodies)
    plates = f", {links} of them link plates" if links else ""
    lines = [f"{len(tree.bodies)} printed parts{plates}, {len(tree.hinges)} hinges"]
    lines[0] += "" if mode.apart else " that are printed in place, already joined"
    if joinery.pins:
        total = sum(pin.length_mm for pin in joinery.pins)
        kind = PINS[mode.pin]
        if kind.screw:
            lines.append(
                f"{len(joinery.pins)} screws {kind.screw} × {joinery.pins[0].length_mm:g} mm with "
                f"a cylinder head, and a {kind.tool}"
            )
        else:
            lines.append(
                f"{len(joinery.pins)} pins of {kind.what}, {total / 10:.0f} cm in all "
                "(lengths in bom.csv)"
            )
    if retention is not None and retention.pairs:
        fit = "laid in while the print pauses" if retention.skin_mm else "glued in"
        lines.append(f"{2 * len(retention.pairs)} magnets of {retention.magnet} mm, {fit}")
    if retention is not None and retention.friction is not None and retention.friction.hinges:
        lines.append(
            f"friction pins: {len(retention.friction.hinges)} of the pins; both of their parts "
            "grip them, so that these hinges stay where they are let go"
        )
    size = joinery.voxel_mm
    shape = " × ".join(f"{side * size:g}" for side in tree.template.shape)
    lines.append(f"closed, it measures {shape} mm")
    return lines


def print_lines(mode: PrintMode, joinery: Joinery, pauses: Sequence[PrintPause] = ()) -> list[str]:
    """How to print it, a line each.

    Parameters
    ----------
    mode : PrintMode
        How it is printed, with its profile.
    joinery : Joinery
        The bodies, with their clearance.
    pauses : sequence of PrintPause
        At which heights magnets are laid in.
    """
    profile = mode.profile
    lines = [
        f"Profile {profile.name}: {profile.process}, {profile.material or 'any material'}; the "
        f"hinges have a clearance of {joinery.clearance_mm:g} mm.",
        "Never scale the files in the slicer: gaps would grow or close. Make the kit again with "
        "another --voxel-mm or --box-mm.",
    ]
    if profile.nozzle_mm is not None:
        lines += [
            "Slice gap closing radius: 0.049 mm at most. Beam interlocking: off. Elephant foot "
            "compensation: on.",
        ]
    if mode.apart:
        lines.append(
            "Print the plates as they lie. Supports only from the plate, and only for the parts "
            "that the report names; none inside bores."
        )
        lines.append("A brim where the report names a part that stands on little.")
    else:
        lines.append(
            "Print it as it lies, as one object. Let it cool, free it from powder or support, and "
            "turn every hinge once to and fro."
        )
        if mode.pose != "a":
            lines.append(
                "It does not come out as the model: the report names the move of the path after "
                "which it is printed. Go the steps backwards from there to the model."
            )
    return lines + [_pause_line(pause) for pause in pauses]


def _pause_line(pause: PrintPause) -> str:
    """One pause: where, and which magnets are laid in."""
    start = "Pause" if pause.plate is None else f"Plate {pause.plate}: pause"
    laid = [
        f"{pole} pole towards the face with the small hole in part "
        + listed([part_number(body) for body in bodies])
        for pole, bodies in (("north", pause.north), ("south", pause.south))
        if bodies
    ]
    return (
        f"{start} at z = {pause.z_mm:g} mm, before the first layer above it, and lay magnets "
        f"in: {'; '.join(laid)}."
    )


def assembly_lines(joinery: Joinery, kit: ApartKit | None) -> list[str]:
    """How the parts are put together, a line a pin.

    Parameters
    ----------
    joinery : Joinery
        The bodies with their pins.
    kit : ApartKit or None
        The order of assembly; None where it is printed in place.
    """
    if kit is None:
        return []
    lines = []
    for step in kit.steps:
        pin = joinery.pins[step.pin]
        rests = listed([part_number(body) for body in step.sides[0]])
        comes = listed([part_number(body) for body in step.sides[1]])
        owner = part_number(pin.owner)
        if pin.thread_mm > 0:
            lines.append(
                f"Bring {comes} to {rests}, and drive in a screw of {pin.length_mm:g} mm until its "
                f"head lies on part {owner}; then a quarter turn back, so that the hinge turns "
                "freely."
            )
        else:
            lines.append(
                f"Bring {comes} to {rests}, and push in a {'friction pin' if pin.tight else 'pin'} "
                f"of {pin.length_mm:.1f} mm until it stands in part {owner}."
            )
    return lines
