"""What a kit's files say of what holds it shut: ``retention.json``, the report and its checks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from fabfold.guide.pauses import print_pauses
from fabfold.joinery.box_hold import Retention
from fabfold.joinery.magnets import MagnetPair
from fabfold.kit.stages import BuiltTree
from fabfold.printing.checks import Check
from fabfold.tree.fold_tree import FoldTree

__all__ = ["retention_checks", "retention_data", "retention_summary"]


def retention_data(built: BuiltTree, retention: Retention) -> dict[str, Any]:
    """What ``retention.json`` holds.

    Parameters
    ----------
    built : BuiltTree
        The bodies and their hinges.
    retention : Retention
        What holds them.

    Returns
    -------
    dict
        Ready for JSON.
    """
    tree, names = built.planned.tree, [body.name for body in built.joinery.bodies]
    friction, size = retention.friction, retention.magnet
    return {
        "format": "fabfold-retention",
        "version": 2,
        "magnet_mm": [float(part) for part in size.split("x")] if size else None,
        "skin_mm": retention.skin_mm,
        "pairs": [_pair_data(pair, names) for pair in retention.pairs],
        "repelling": retention.repelling,
        "pauses": [
            {
                "plate": None if pause.plate is None else f"plate-{pause.plate}",
                "z_mm": pause.z_mm,
                "north_to_face": [names[body] for body in pause.north],
                "south_to_face": [names[body] for body in pause.south],
            }
            for pause in print_pauses(retention, built.apart)
        ],
        "moves_without": _named(tree, retention.free_before),
        "held_by_friction_only": _named(tree, retention.free_after),
        "model": None
        if retention.in_a is None
        else {
            "moves_without": _named(tree, retention.in_a[0]),
            "held_by_friction_only": _named(tree, retention.in_a[1]),
        },
        "friction_pins": None
        if friction is None
        else {**friction.to_json(), "hinges": _named(tree, friction.hinges)},
    }


def _pair_data(pair: MagnetPair, names: Sequence[str]) -> dict[str, Any]:
    pauses = pair.pauses_mm or (None, None)
    return {
        "shape": pair.shape,
        **{
            side: {
                "body": names[pair.bodies[pole]],
                "mouth_mm": list(pair.points_mm[pole]),
                "inwards": list(pair.inwards[pole]),
                "pause_z_mm": pauses[pole],
            }
            for pole, side in enumerate(("north_out", "south_out"))
        },
    }


def _named(tree: FoldTree, hinges: Sequence[int]) -> list[str]:
    return [tree.hinges[index].name for index in hinges]


def retention_summary(built: BuiltTree, retention: Retention) -> dict[str, Any]:
    """Figures of what holds a kit, for its report; parameters as of :func:`retention_data`."""
    tree = built.planned.tree
    return {
        "magnet_pairs": len(retention.pairs),
        "hinges_free_when_shut": _named(tree, retention.free_after),
        **(
            {}
            if retention.in_a is None
            else {"hinges_free_in_model": _named(tree, retention.in_a[1])}
        ),
        **({} if retention.friction is None else {"friction_pins": len(retention.friction.hinges)}),
        **(
            {"pauses_mm": [pause.z_mm for pause in print_pauses(retention, built.apart)]}
            if retention.skin_mm
            else {}
        ),
    }


def retention_checks(built: BuiltTree, retention: Retention) -> list[Check]:
    """How well a kit is held, for information; parameters as of :func:`retention_data`."""
    tree, total = built.planned.tree, len(built.planned.tree.hinges)
    checks = [
        _held("hinges held shut", tree, retention.free_before, retention.free_after, retention, "B")
    ]
    if retention.in_a is not None:
        checks.append(_held("hinges held in the model", tree, *retention.in_a, retention, "A"))
    friction = retention.friction
    if friction is not None and friction.hinges:
        checks.append(
            Check(
                name="friction pins",
                figure=float(len(friction.hinges)),
                limit=None,
                unit=f"of {total} hinges",
                ok=True,
                note=f"{', '.join(_named(tree, friction.hinges))}: bores drawn "
                f"{friction.drawn_mm:g} mm wider than the pin in radius. Where they print "
                f"{friction.narrower_mm:g} mm narrower than it, the strain is "
                f"{100 * friction.strain:g} %, what the material bears, and a pin holds "
                f"{friction.torque_nmm:g} N mm; the weight asks for {friction.needed_nmm:g} N mm "
                "at most",
            )
        )
    pauses = print_pauses(retention, built.apart)
    if pauses:
        told = [
            f"z = {pause.z_mm:g} mm" + ("" if pause.plate is None else f" on plate {pause.plate}")
            for pause in pauses
        ]
        checks.append(
            Check(
                name="pauses of the print for magnets",
                figure=float(len(pauses)),
                limit=None,
                unit="pauses",
                ok=True,
                note=f"pause before the first layer above {', '.join(told)}",
            )
        )
    return checks


def _held(
    name: str,
    tree: FoldTree,
    before: Sequence[int],
    after: Sequence[int],
    retention: Retention,
    shape: str,
) -> Check:
    """How many hinges do not move when a shape is shut."""
    pairs = sum(pair.shape == shape for pair in retention.pairs)
    note = f"{len(before)} hinges move when nothing holds them"
    if retention.magnet:
        note = f"{pairs} pairs of {retention.magnet} mm magnets; without them {len(before)} hinges "
        note += "move"
    if after:
        note += f". Held by friction only: {', '.join(_named(tree, after))}"
    if retention.repelling and shape == "B":
        note += f". {retention.repelling} times magnets of two pairs come near and repel"
    return Check(
        name=name,
        figure=float(len(tree.hinges) - len(after)),
        limit=None,
        unit=f"of {len(tree.hinges)} hinges",
        ok=True,
        note=note,
    )
