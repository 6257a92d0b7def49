"""Sheets that fold into a box on living hinges and are held by snaps."""

from __future__ import annotations

from itertools import combinations
from math import acos, cos, degrees, radians, sin, sqrt

import pytest

pytest.importorskip("build123d")  # a newer one is tried in an environment with little else

from build123d import Align, Box, BuildPart, Compound, Mode, Part, Pos

from hinges import FitError, FoldedSheet, FoldSnap, HingeError, LivingHinge
from hinges.exact_solids import build_all
from hinges.fold_snap import Bend
from hinges.shapes import Prism
from hinges.turn_sweep import mesh_of_part

LYING = (Align.CENTER, Align.CENTER, Align.MIN)
MIDDLE = ((0.0, -20.0), (0.0, 20.0))
PLATE = Box(80, 40, 2, align=LYING)


def measured(panels: list[Part]) -> tuple[float, float]:
    """Smallest gap of all pairs of panels up to 3 mm, and their largest overlap."""
    meshes = [mesh_of_part(panel) for panel in panels]
    pairs = list(combinations(meshes, 2))
    return (
        min(one.min_gap(other, 3.0) for one, other in pairs),
        max((one ^ other).volume() for one, other in pairs),
    )


def held_pairs(sheet: FoldedSheet) -> list[tuple[int, int]]:
    """Panels between which cones are pressed shortly before all is folded."""
    meshes = [mesh_of_part(panel) for panel in sheet.bent(0.97)[0]]
    pairs = combinations(range(len(meshes)), 2)
    return [(one, other) for one, other in pairs if (meshes[one] ^ meshes[other]).volume() > 0.05]


@pytest.fixture(scope="module")
def tray() -> FoldedSheet:
    return FoldedSheet.tray(60, 50, 25, use="few")


@pytest.mark.slow
@pytest.mark.parametrize(
    "options",
    [
        {"use": "few"},
        {"angle": 60.0, "use": "few", "material": "petg"},
        {"angle": 120.0, "material": "tpu"},
        {"snap": FoldSnap(radius=2.5, length=6.0, post=1.6, catch=0.3, height=9.0)},
    ],
    ids=str,
)
def test_two_panels_fold_and_are_held(options):
    sheet = FoldedSheet(PLATE, [MIDDLE], **options)
    angle = options.get("angle", 90.0)
    assert len(sheet.flat.solids()) == 1
    assert sheet.flat.is_valid
    assert [len(panel.solids()) for panel in sheet.folded] == [1, 1]
    lower = [panel.faces().sort_by(lambda face: -face.area)[0] for panel in sheet.folded]
    normals = [face.normal_at() for face in lower]
    assert normals[0].get_angle(normals[1]) == pytest.approx(angle, abs=1e-6)
    # Folded, the cones lie in their dimples with their room; a little open, they are pressed.
    gap, shared = measured(sheet.folded)
    assert gap == pytest.approx(0.05, abs=0.01)
    assert shared == 0.0
    snap = sheet.snap
    assert snap is not None
    foot = 0.6 * snap.radius - snap.clearance
    pressed = 2.0 * 3.1416 * foot**2 * snap.catch  # no more than both cones beyond the clearance
    for share in (0.98, 0.95):
        assert 0.05 < measured(sheet.bent(share)[0])[1] < pressed
    gap, shared = measured(sheet.bent(0.6)[0])
    assert gap > 0.2
    assert shared == 0.0


def test_the_flat_sheet_is_the_plate_with_grooves_and_posts():
    bare = FoldedSheet(PLATE, [MIDDLE], use="few", snap=None)
    groove = bare.hinges[0]
    deep = 2.0 - groove.web
    assert PLATE.volume - bare.flat.volume == pytest.approx(
        40.0 * deep * (groove.land + deep), rel=1e-6
    )
    assert sum(panel.volume for panel in bare.panels) == pytest.approx(
        bare.flat.volume - 40.0 * groove.web * groove.land, rel=1e-6
    )
    snapped = FoldedSheet(PLATE, [MIDDLE], use="few")
    assert snapped.flat.volume > bare.flat.volume + 50.0
    assert pytest.approx(0.0, abs=1e-9) == snapped.flat.bounding_box().min.Z
    assert "2 panels, 2 mm thick" in repr(snapped)
    with BuildPart() as built:
        Box(80, 40, 2, align=LYING)
    assert FoldedSheet(built, [MIDDLE], use="few", snap=None).flat.volume == pytest.approx(
        bare.flat.volume
    )


def test_the_web_joins_what_it_bends_between():
    sheet = FoldedSheet(PLATE, [MIDDLE], snap=None)
    for share in (0.3, 1.0):
        panels, (web,) = sheet.bent(share)
        assert web.volume == pytest.approx(40.0 * 0.3 * sheet.hinges[0].land, rel=1e-6)
        for panel in panels:
            assert web.distance_to(panel) == pytest.approx(0.0, abs=1e-6)
    flat = sheet.bent(0.0)[0]
    assert [panel.center().X for panel in flat] == pytest.approx(
        [panel.center().X for panel in sheet.panels]
    )


def test_each_fold_has_its_angle():
    plate = Box(120, 30, 2, align=LYING)
    folds = [((-20, -15), (-20, 15)), ((20, -15), (20, 15))]
    sheet = FoldedSheet(plate, folds, angle=(60, 110), use="few", snap=None)
    assert [groove.angle for groove in sheet.hinges] == [60, 110]
    tops = sorted(panel.bounding_box().max.Z for panel in sheet.folded)
    assert tops[0] == pytest.approx(2.0)
    assert tops[1] == pytest.approx(40 * 0.866, abs=1.5)
    assert tops[2] == pytest.approx(40 * 0.94, abs=1.5)


@pytest.mark.slow
def test_a_tray_closes_at_its_sizes_and_stays(tray):
    assert len(tray.flat.solids()) == 1
    assert tray.flat.is_valid
    assert len(tray.panels) == 5
    size = Compound(children=list(tray.bent(1.0)[0])).bounding_box().size
    assert pytest.approx((60.0, 50.0, 25.0), abs=1e-6) == (size.X, size.Y, size.Z)
    gap, shared = measured(tray.folded)
    assert gap == pytest.approx(0.05, abs=0.01)
    assert shared == 0.0
    assert len(held_pairs(tray)) == 8  # four folds and four seams
    assert measured(tray.bent(0.6)[0])[1] == 0.0


@pytest.mark.slow
def test_seams_keep_half_a_clearance_off_their_plane(tray):
    bare = FoldedSheet.tray(60, 50, 25, use="few", snap=None)
    gap, shared = measured(bare.folded)
    assert gap == pytest.approx(0.0, abs=1e-3)  # without a snap the bevels lie on one another
    assert shared < 1e-3

    def reach(sheet: FoldedSheet) -> float:
        """How far the walls beside the base's long sides reach along them."""
        walls = [
            panel.bounding_box() for index, panel in enumerate(sheet.panels) if index != sheet.base
        ]
        return max(wall.max.Y for wall in walls if abs(wall.center().X) > 1.0)

    assert reach(bare) == pytest.approx(25.0)
    assert reach(tray) == pytest.approx(25.0 - 0.5 * 0.3 * 2**0.5)


@pytest.mark.slow
def test_snaps_stand_where_they_are_wanted():
    sheet = FoldedSheet(PLATE, [MIDDLE], use="few", places=(0.2, 0.8))
    posts = [one for one in sheet.flat.faces() if abs(one.center().Z - 5.0) < 4.0]
    middles = sorted({round(face.center().Y) for face in posts if face.center().Z > 4.0})
    assert min(middles) < -10
    assert max(middles) > 10
    gap, shared = measured(sheet.folded)
    assert (gap, shared) == (pytest.approx(0.05, abs=0.01), 0.0)
    with pytest.raises(HingeError, match="give shares of a line's length"):
        FoldedSheet(PLATE, [MIDDLE], places=(40.0,))


@pytest.mark.slow
def test_snaps_of_a_seam_are_counted_the_same_way_on_both_edges():
    sheet = FoldedSheet.tray(60, 50, 25, use="few", places=(0.6,))
    assert measured(sheet.folded) == (pytest.approx(0.05, abs=0.01), 0.0)
    assert len(held_pairs(sheet)) == 8


@pytest.mark.slow
def test_a_tetrahedron_whose_faces_meet_in_seams():
    side, thick, angle = 70.0, 2.0, degrees(acos(-1.0 / 3.0))
    groove = LivingHinge(10, thick, angle=angle, use="few", mode=Mode.PRIVATE)
    bend = Bend(angle, thick, groove.land, groove.web)
    mouth = 0.5 * groove.land + (thick - groove.web) * bend.lean
    assert groove.outside == pytest.approx(bend.outside)
    fold_at = side / (2.0 * sqrt(3.0)) - groove.outside
    apex, foot = fold_at - groove.outside + 0.5 * sqrt(3.0) * side, fold_at + mouth
    half, narrow = (apex - foot) / sqrt(3.0), 0.5 * side - 2.0 * mouth - 3.0

    def spun(x: float, y: float, turn: int) -> tuple[float, float]:
        at = radians(120.0 * turn)
        return x * cos(at) - y * sin(at), x * sin(at) + y * cos(at)

    rim = [(fold_at, -narrow), (foot, -narrow), (foot, -half), (apex, 0.0)]
    rim += [(x, -y) for x, y in reversed(rim[:3])]
    turns = range(3)
    outlines = [[spun(*point, turn) for point in rim] for turn in turns]
    outlines.append([spun(fold_at, y, turn) for turn in turns for y in (-narrow, narrow)])
    plate = build_all([Prism(tuple(outline), 0.0, thick) for outline in outlines])
    folds = [tuple(spun(fold_at, y, turn) for y in (-narrow, narrow)) for turn in turns]
    seams = [
        tuple(
            (spun(foot, way * half, which), spun(apex, 0.0, which))
            for way, which in ((1.0, turn), (-1.0, turn + 1))
        )
        for turn in turns
    ]
    sheet = FoldedSheet(plate, folds, angle=angle, seams=seams, use="few")
    assert len(sheet.flat.solids()) == 1
    assert len(sheet.folded) == 4
    assert measured(sheet.folded)[1] == 0.0
    assert len(held_pairs(sheet)) == 6
    # as high as a tetrahedron, but for the tip that the bevels take
    assert max(face.bounding_box().max.Z for face in sheet.folded) == pytest.approx(
        side * sqrt(2.0 / 3.0), abs=1.0
    )


def test_lock_and_sockets_for_a_sheet_of_ones_own():
    bend = Bend(90.0, 2.0, 0.8, 0.3)
    lock, sockets = FoldSnap().parts(bend)
    assert (len(lock.solids()), len(sockets.solids())) == (1, 2)
    assert lock.bounding_box().max.X < 0.0 < sockets.bounding_box().min.X
    with pytest.raises(HingeError, match="is unknown"):
        FoldSnap().parts(bend, "gold")


def test_snaps_by_their_rules():
    bend = Bend(90.0, 2.0, 3.0, 0.3)
    snap = FoldSnap()
    rise = snap.lowest(bend, 0.015)
    assert snap.strain(rise) <= 0.015 + 1e-12
    assert bend.outside == pytest.approx(bend.radius + 0.15 - 1.5)
    for other, rule, words in (
        (FoldSnap(height=2.5), "retention", "stands in the bend"),
        (FoldSnap(height=5.0, post=3.0), "strain", "strain of a socket's post in petg"),
        (FoldSnap(catch=0.05), "retention", "how deep a cone drops"),
        (FoldSnap(radius=1.0), "retention", "the tip of a cone"),
        (FoldSnap(post=0.5), "wall", "the post of a socket"),
    ):
        with pytest.raises(FitError, match=words) as refusal:
            other.check(bend, 0.015, "petg")
        assert refusal.value.rule == rule
        assert refusal.value.advice


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: FoldedSheet(Box(80, 40, 2), [MIDDLE]), "lies at z = -1: lay it on z = 0"),
        (lambda: FoldedSheet(PLATE, []), "at least one fold line"),
        (lambda: FoldedSheet(PLATE, [(0, 1)]), "give both its ends"),
        (lambda: FoldedSheet(PLATE, [((0, 0), (0, 0))]), "has no length"),
        (lambda: FoldedSheet(PLATE, [((0, -20), (0, 10))]), "part the plate into 1 panels, not"),
        (
            lambda: FoldedSheet(PLATE, [MIDDLE, ((-40, 0), (40, 0))], use="few"),
            "into 4 panels, not into 3: .* none may cross",
        ),
        (lambda: FoldedSheet(PLATE, [MIDDLE], angle=(90, 90)), "2 angles for 1 folds"),
        (lambda: FoldedSheet(PLATE, [MIDDLE], angle="x"), "give a finite number"),
        (
            lambda: FoldedSheet(Box(9, 40, 2, align=LYING), [MIDDLE], use="few"),
            r"a snap stands .* mm beside panel \d: it takes a panel of 8\.64 mm",
        ),
        (
            lambda: FoldedSheet(
                PLATE, [MIDDLE], use="few", seams=[(((40, -20), (40, 20)), ((-40, 20), (-40, -20)))]
            ),
            "does not meet when it is folded: .* lie .* mm apart",
        ),
        (lambda: FoldedSheet.tray(6, 6, 3), "no larger than its bends"),
        (lambda: FoldSnap(radius=0.0), "radius is 0 mm: give a length above 0"),
        (lambda: FoldedSheet(PLATE, [MIDDLE], use="few", snap=None).bent(2), "share is 2"),
    ],
)
def test_nonsense_is_refused_in_a_sentence(make, words):
    with pytest.raises(HingeError, match=words):
        make()


@pytest.mark.slow
def test_panels_that_overlap_when_folded_are_refused():
    cross = Box(120, 36, 2, align=LYING) + Box(36, 120, 2, align=LYING)
    for x in (-1, 1):
        cross += Pos(40 * x, 0) * Box(40, 60, 2, align=LYING)
    folds = [((18 * x, -18), (18 * x, 18)) for x in (-1, 1)]
    folds += [((-18, 18 * y), (18, 18 * y)) for y in (-1, 1)]
    with pytest.raises(HingeError, match=r"folded, panels .* overlap by .* as a seam"):
        FoldedSheet(cross, folds, use="few", snap=None)
