"""A flat plate that folds into a box: living hinges in its fold lines, and snaps that hold them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property
from itertools import combinations
from math import acos, degrees
from typing import Any, Final, Literal

from build123d import (
    BuildPart,
    Location,
    Mode,
    Part,
    Pos,
    Rot,
    Solid,
    Vector,
    Vertex,
)

from .clearance import millimetres, number
from .exact_solids import build_shape, one_part, solids_of
from .exceptions import HingeError
from .fold_lines import (
    FoldLine,
    Line,
    bevel,
    frame_of,
    line_words,
    read_line,
    web_strip,
)
from .fold_snap import ACROSS_LAYERS, Bend, FoldSnap
from .living_hinge import LivingHinge
from .shapes import Shape
from .tray_net import tray_net
from .turn_sweep import mesh_of_part

__all__ = ["FoldedSheet"]

#: How far from a line panels are looked for, in mm.
_BESIDE: Final = 0.05
#: How far the two lines of a seam may lie apart when they are folded, in mm.
_MEET: Final = 0.05
#: What panels may share, in mm³: they are measured on meshes.
_NOTHING: Final = 1e-2


class FoldedSheet:
    """A flat plate with fold lines, made to fold and to stay folded.

    The plate lies on z = 0 and is printed so. It folds upwards, so that its upper faces come to lie
    inside. Each fold gets a living hinge and, at its middle, a snap that holds its angle; each seam
    gets a bevel and a snap.

    Parameters
    ----------
    plate : Part, Solid or BuildPart
        The flat plate, as thick everywhere as its bounds are high near its folds.
    folds : sequence of ((x, y), (x, y))
        Both ends of the middle of each fold line, in mm, on the edges of the plate.
    angle : float or sequence of float
        How far it folds, degrees; one for all, or one for each.
    snap : FoldSnap or None
        The snap at each fold and seam; None for none.
    places : sequence of float
        Where snaps stand along each fold and seam, as shares of its length from its first end.
    seams : sequence of (line, line)
        Pairs of edges of two panels that meet when it is folded. Each is given as a fold is, at the
        lower face. The first gets the lock. When folded the lines must lie on one another.
    web, material, use, land, nozzle
        As of :class:`hinges.LivingHinge`.

    Attributes
    ----------
    flat : Part
        The sheet to print, one solid.
    thickness : float
        Thickness of the plate in mm.
    base : int
        Number of the panel that stays where it is: the one with most folds, or else the largest.
    panels : list of Part
        The flat panels, without the webs between them.
    folded : list of Part
        The same when all is folded.

    Raises
    ------
    FitError
        If a web or a snap cannot bear its bending, or a snap does not hold.
    HingeError
        If the lines do not part the plate into one more panels than there are folds, a snap stands
        beside its panel, panels overlap when folded, or the lines of a seam do not meet.

    Examples
    --------
    >>> from build123d import Box
    >>> tray = FoldedSheet(Box(60, 30, 2).moved(Pos(0, 0, 1)), [((0, -15), (0, 15))], use="few")
    >>> len(tray.flat.solids()), len(tray.folded)
    (1, 2)
    """

    def __init__(
        self,
        plate: Part | Solid | BuildPart,
        folds: Iterable[Line],
        *,
        angle: float | Sequence[float] = 90.0,
        snap: FoldSnap | None = FoldSnap(),  # noqa: B008 - it is frozen
        places: Sequence[float] = (0.5,),
        seams: Iterable[tuple[Line, Line]] = (),
        web: float = 0.3,
        material: str = "pp",
        use: Literal["again", "few"] = "again",
        land: float | None = None,
        nozzle: float = 0.4,
    ) -> None:
        body = _plate(plate)
        self.snap, self.material = snap, material
        self.places = tuple(number(place, "a place of a snap") for place in places)
        if any(not 0.0 <= place <= 1.0 for place in self.places):
            raise HingeError(f"places are {places!r}: give shares of a line's length, 0 to 1")
        self.thickness = float(body.bounding_box().max.Z)
        lines = [read_line(fold) for fold in folds]
        if not lines:
            raise HingeError("a folded sheet needs at least one fold line")
        angles = _angles(angle, len(lines))
        grooves = []
        for (start, end), each in zip(lines, angles, strict=True):
            groove = LivingHinge(
                (end - start).length,
                self.thickness,
                angle=each,
                web=web,
                material=material,
                use=use,
                land=land,
                nozzle=nozzle,
                mode=Mode.PRIVATE,
            )
            grooves.append((frame_of(start, end), groove))
        self.strain = ACROSS_LAYERS * grooves[0][1].life.again
        self.hinges = [groove for _, groove in grooves]
        cut = [frame * solid for frame, groove in grooves for solid in groove.solids()]
        bare = solids_of(solids_of(body)[0].cut(*cut))
        strips = [
            frame * build_shape(web_strip(groove.land, groove.web, groove.length))
            for frame, groove in grooves
        ]
        apart = [piece for solid in bare for piece in solids_of(solid.cut(*strips))]
        if len(apart) != len(lines) + 1:
            raise HingeError(
                f"the {len(lines)} folds part the plate into {len(apart)} panels, not into "
                f"{len(lines) + 1}: each must run from edge to edge of the plate, and none may "
                "cross another"
            )
        self._folds = [
            FoldLine(
                frame,
                Bend(groove.angle, self.thickness, groove.land, groove.web),
                groove.length,
                self._sides(apart, frame, 0.5 * groove.land, f"fold {number_}"),
            )
            for number_, (frame, groove) in enumerate(grooves, start=1)
        ]
        joined = [panel for fold in self._folds for panel in fold.panels]
        self.base = max(
            range(len(apart)), key=lambda index: (joined.count(index), float(apart[index].volume))
        )
        self._order = self._joined()
        self.poses = self._posed(1.0)
        added: list[list[Shape | Any]] = [[] for _ in apart]
        removed: list[list[Any]] = [[] for _ in apart]
        for fold in self._folds:
            for frame in self._along(fold.frame, fold.length):
                self._hold(apart, (frame, frame), fold.panels, fold.bend, added, removed)
        for one, other in seams:
            self._seam(apart, read_line(one), read_line(other), added, removed)
        self.panels = [
            self._panel(solid, added[index], removed[index], index)
            for index, solid in enumerate(apart)
        ]
        webs = [
            piece
            for solid in bare
            for strip in strips
            for piece in solids_of(solid.intersect(strip))
        ]
        self.flat = one_part(solids_of(webs[0].fuse(*webs[1:], *_all_solids(self.panels))))
        self.flat.label = "folded sheet"
        if len(self.flat.solids()) != 1:
            raise HingeError(f"the sheet came out in {len(self.flat.solids())} pieces, not in one")
        self._require_room()

    @classmethod
    def tray(
        cls,
        width: float | str,
        depth: float | str,
        height: float | str,
        thickness: float | str = 2.0,
        **options: Any,
    ) -> FoldedSheet:
        """Lay out a box that is open above: a base, four walls, and seams at its corners.

        Parameters
        ----------
        width, depth, height : float or str
            Outer sizes of the folded box in mm.
        thickness : float or str
            Thickness of the plate in mm.
        **options
            Everything of :class:`FoldedSheet` but `folds`, `angle` and `seams`.

        Returns
        -------
        FoldedSheet
            The sheet.

        Raises
        ------
        FitError
            As the class raises it.
        HingeError
            As the class raises it, or if a wall is no higher than its bend.
        """
        sizes = [millimetres(size, "a size of a tray") for size in (width, depth, height)]
        thick = millimetres(thickness, "thickness")
        known = ("web", "material", "use", "land", "nozzle")
        groove = LivingHinge(
            1.0, thick, mode=Mode.PRIVATE, **{key: options[key] for key in known if key in options}
        )
        bend = Bend(groove.angle, thick, groove.land, groove.web)
        plate, folds, seams = tray_net((sizes[0], sizes[1], sizes[2]), bend)
        return cls(plate, folds, seams=seams, **options)

    def __repr__(self) -> str:
        """What it folds into."""
        return (
            f"FoldedSheet of {len(self.panels)} panels, {self.thickness:g} mm thick, in "
            f"{self.material}"
        )

    @cached_property
    def folded(self) -> list[Part]:
        """The panels when all is folded."""
        return self.bent(1.0)[0]

    def bent(self, share: float) -> tuple[list[Part], list[Part]]:
        """Fold the sheet a part of the way.

        Parameters
        ----------
        share : float
            How far every fold is turned, as a share of its angle: 0 for flat, 1 for folded.

        Returns
        -------
        panels, webs : list of Part
            Panels and bent webs in their places, the base where it was.

        Raises
        ------
        HingeError
            If the share is outside 0 to 1.
        """
        if not 0.0 <= number(share, "share") <= 1.0:
            raise HingeError(f"share is {share:g}: give 0 for flat to 1 for folded")
        poses = self._posed(share)
        panels = [panel.moved(pose) for panel, pose in zip(self.panels, poses, strict=True)]
        webs = [
            fold.web(max(share, 1e-3)).moved(poses[one] * frame)
            for fold, one, _, frame in self._order
        ]
        return panels, webs

    @staticmethod
    def _sides(apart: Sequence[Any], frame: Location, half: float, name: str) -> tuple[int, int]:
        """The panels on both sides of a line."""
        found = []
        for side in (-1.0, 1.0):
            point = (frame * Pos(side * (half + _BESIDE), _BESIDE)).position
            near = [solid.distance_to(Vertex(*point)) for solid in apart]
            index = min(range(len(apart)), key=near.__getitem__)
            if near[index] > _BESIDE:
                raise HingeError(f"{name} has no panel beside its middle: it must lie in the plate")
            found.append(index)
        return found[0], found[1]

    def _joined(self) -> list[tuple[FoldLine, int, int, Location]]:
        """The folds from the base outwards: inner and outer panel, frame with the inner at -x."""
        reached, waiting, order = {self.base}, list(self._folds), []
        while waiting:
            fold = next((f for f in waiting if any(p in reached for p in f.panels)), None)
            if fold is None or all(panel in reached for panel in fold.panels):
                raise HingeError("the folds do not join the panels one after the other")
            waiting.remove(fold)
            inner = 0 if fold.panels[0] in reached else 1
            frame = fold.frame if inner == 0 else fold.frame * Rot(0, 180, 0)
            order.append((fold, fold.panels[inner], fold.panels[1 - inner], frame))
            reached.add(fold.panels[1 - inner])
        return order

    def _posed(self, share: float) -> list[Location]:
        """Where each panel comes to lie, panel by panel from the base outwards."""
        poses = {self.base: Location()}
        for fold, one, other, frame in self._order:
            poses[other] = poses[one] * frame * fold.turned(share) * frame.inverse()
        return [poses[index] for index in range(len(poses))]

    def _along(self, frame: Location, length: float) -> list[Location]:
        """The frame moved to each place along its line."""
        return [frame * Pos(0, 0, (place - 0.5) * length) for place in self.places]

    def _hold(
        self,
        apart: Sequence[Any],
        frames: tuple[Location, Location],
        panels: tuple[int, int],
        bend: Bend,
        added: list[list[Any]],
        removed: list[list[Any]],
    ) -> None:
        """Plan the snap between two panels: the lock in the first frame, sockets in the other."""
        if self.snap is None:
            return
        self.snap.check(bend, self.strain, self.material)
        rise = self.snap.rise(bend, self.strain)
        lock, sockets = self.snap.lock(bend, rise), self.snap.sockets(bend, rise)
        for panel, frame, corners in zip(panels, frames, self.snap.feet(bend, rise), strict=True):
            off = max(
                apart[panel].distance_to(Vertex(*(frame * Pos(*corner)).position))
                for corner in corners
            )
            if off > _BESIDE:
                raise HingeError(
                    f"a snap stands {off:.3g} mm beside panel {panel + 1}: it takes a panel of "
                    f"{bend.aside(self.thickness + rise) + self.snap.radius:.3g} mm from the fold; "
                    "use a wider one, a smaller height or a material that bends more sharply"
                )
        added[panels[0]] += [frames[0] * build_shape(shape) for shape in lock]
        added[panels[1]] += [frames[1] * build_shape(shape) for shape in sockets]
        dimples = self.snap.dimples(bend, rise)
        removed[panels[1]] += [frames[1] * build_shape(shape) for shape in dimples]

    def _seam(
        self,
        apart: Sequence[Any],
        one: tuple[Vector, Vector],
        other: tuple[Vector, Vector],
        added: list[list[Any]],
        removed: list[list[Any]],
    ) -> None:
        """Plan a seam: where two edges meet, how they are bevelled, and their snap."""
        frames, panels = [], []
        for line, outwards in ((one, True), (other, False)):
            frame = frame_of(*line)
            sides = []
            for turn in (0.0, 180.0):
                turned = frame * Rot(0, turn, 0)
                point = (turned * Pos(-_BESIDE, _BESIDE)).position
                near = [float(solid.distance_to(Vertex(*point))) for solid in apart]
                sides.append((min(near), near.index(min(near)), turned))
            _, index, turned = min(sides, key=lambda side: side[0])
            if min(side[0] for side in sides) > self.thickness:
                raise HingeError(f"no panel has an edge at the seam {line_words(line)}")
            frames.append(turned if outwards else turned * Rot(0, 180, 0))
            panels.append(index)
        placed = [self.poses[index] * frame for index, frame in zip(panels, frames, strict=True)]
        middles = [place.position for place in placed]
        apart_by = (middles[0] - middles[1]).length
        ups = [(place * Pos(0, 1, 0)).position - place.position for place in placed]
        alongs = [(place * Pos(0, 0, 1)).position - place.position for place in placed]
        off = 1.0 - abs(alongs[0].dot(alongs[1]))
        if panels[0] == panels[1] or apart_by > _MEET or off > 1e-4:
            raise HingeError(
                f"the seam {line_words(one)} and {line_words(other)} does not meet when it is "
                f"folded: the middles of its lines lie {apart_by:.3g} mm apart"
            )
        angle = degrees(acos(max(-1.0, min(1.0, ups[0].dot(ups[1])))))
        if angle < 1.0:
            raise HingeError(
                f"the panels at the seam {line_words(one)} lie in one plane: nothing holds"
            )
        bend = Bend(angle, self.thickness)
        half = 0.5 * (self.snap.clearance if self.snap else 0.0)
        for index, frame, side in zip(panels, frames, (1.0, -1.0), strict=True):
            length = max((line[1] - line[0]).length for line in (one, other))
            removed[index].append(frame * build_shape(bevel(bend, half, length, side)))
        # Both lines are gone along the same way round, as they lie on one another when folded.
        with_line = (frames[0] * Pos(0, 0, 1)).position - frames[0].position
        first = 1.0 if with_line.dot(one[1] - one[0]) > 0.0 else -1.0
        second = first if alongs[0].dot(alongs[1]) > 0.0 else -first
        length = min((line[1] - line[0]).length for line in (one, other))
        for pair in zip(
            self._along(frames[0], first * length),
            self._along(frames[1], second * length),
            strict=True,
        ):
            self._hold(apart, pair, (panels[0], panels[1]), bend, added, removed)

    def _panel(self, solid: Any, added: list[Any], removed: list[Any], index: int) -> Part:
        """One panel with what stands on it."""
        whole = solids_of(solid.fuse(*added)) if added else [solid]
        made = (
            [piece for one in whole for piece in solids_of(one.cut(*removed))] if removed else whole
        )
        if len(made) != 1:
            raise HingeError(
                f"panel {index + 1} came out in {len(made)} pieces: its seams cut it apart"
            )
        part = one_part(made)
        part.label = f"panel {index + 1}"
        return part

    def _require_room(self) -> None:
        """Refuse panels that overlap when they are folded."""
        meshes = [mesh_of_part(panel) for panel in self.folded]
        for one, other in combinations(range(len(meshes)), 2):
            shared = float((meshes[one] ^ meshes[other]).volume())
            if shared > _NOTHING:
                raise HingeError(
                    f"folded, panels {one + 1} and {other + 1} overlap by {shared:.3g} mm³: trim "
                    "the plate where they meet, give the edges as a seam, or move their snaps "
                    "apart with a smaller height"
                )


def _all_solids(parts: Iterable[Part]) -> list[Any]:
    return [solid for part in parts for solid in part.solids()]


def _plate(plate: Any) -> Any:
    """Read a plate: one solid that lies on z = 0."""
    body = plate.part if isinstance(plate, BuildPart) else plate
    if not hasattr(body, "solids") or len(body.solids()) != 1:
        raise HingeError("a folded sheet is made of a plate of one solid: a Part or a Solid")
    low = float(body.bounding_box().min.Z)
    if abs(low) > 1e-6:
        raise HingeError(f"the plate lies at z = {low:g}: lay it on z = 0, as it is printed")
    return body


def _angles(angle: Any, count: int) -> list[float]:
    """One angle a fold."""
    if not isinstance(angle, (tuple, list)):
        return [number(angle, "angle")] * count
    if len(angle) != count:
        raise HingeError(f"{len(angle)} angles for {count} folds: give one, or one for each")
    return [number(each, "angle") for each in angle]
