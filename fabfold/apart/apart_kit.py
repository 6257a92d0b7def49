"""From bodies with open bores to a kit that is put together: order, pins and plates."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from fabfold.apart.pin_order import AssemblyStep, find_order
from fabfold.apart.pin_replay import PinReplay, replay_assembly
from fabfold.apart.plates import Plates, lay_out_plates
from fabfold.errors import GeometryError
from fabfold.fold.motion import Motion
from fabfold.joinery.bodies import Joinery
from fabfold.joinery.loose_pins import pin_bores, with_pins
from fabfold.printing.print_mode import PrintMode
from fabfold.progress import Progress
from fabfold.tree.fold_tree import FoldTree

__all__ = ["ApartKit", "prepare_apart"]


@dataclass(frozen=True)
class ApartKit:
    """What a kit of single bodies has besides the bodies.

    Attributes
    ----------
    steps : tuple of AssemblyStep
        The order in which it is put together.
    plates : Plates
        How the bodies are printed.
    replay : PinReplay
        What was seen when the order was played through.
    """

    steps: tuple[AssemblyStep, ...]
    plates: Plates
    replay: PinReplay

    def to_json(self) -> dict[str, Any]:
        """Ready for a JSON file."""
        return {
            "steps": [step.to_json() for step in self.steps],
            "plates": self.plates.to_json(),
            "replay": asdict(self.replay),
        }

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> ApartKit:
        """A kit from what :meth:`to_json` wrote."""
        steps = tuple(AssemblyStep.from_json(step) for step in data["steps"])
        seen = {**data["replay"], "faults": tuple(data["replay"]["faults"])}
        return cls(steps, Plates.from_json(data["plates"]), PinReplay(**seen))


def prepare_apart(
    tree: FoldTree, motion: Motion, joinery: Joinery, mode: PrintMode, progress: Progress
) -> tuple[Joinery, ApartKit]:
    """Find the order of assembly, finish the bodies for it, and lay them on plates.

    Parameters
    ----------
    tree : FoldTree
        The bodies and their hinges.
    motion : Motion
        The folding path.
    joinery : Joinery
        Bodies with open bores, from :func:`fabfold.joinery.build.build_bodies`.
    mode : PrintMode
        Printer, material and pin.
    progress : Progress
        Hears what is being done.

    Returns
    -------
    joinery : Joinery
        The bodies as they are printed, with their pins.
    kit : ApartKit
        Order and plates.

    Raises
    ------
    GeometryError
        If there is no order in which all pins can be pushed in.
    CheckError
        If a body fits no plate.
    """
    bores = pin_bores(tree, joinery)
    fit = mode.pin_fit
    progress.update(None, "order of assembly")
    steps = find_order(tree, motion, joinery, bores, fit, progress)
    ends = {step.pin: step.end for step in steps}
    joinery = with_pins(joinery, bores, [ends[i] for i in range(len(bores))], fit)
    # The search looks along a grid of lines; what is finer shows when it is played through.
    seen = replay_assembly(tree, joinery, bores, steps, fit)
    if seen.done < seen.pins:
        raise GeometryError(f"no order of assembly: {seen.faults[0]}")
    progress.update(None, "plates")
    return joinery, ApartKit(tuple(steps), lay_out_plates(joinery, bores, mode.profile), seen)
