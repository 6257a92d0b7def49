"""Magnet pockets and snap tongues."""

from math import atan2, cos, pi, radians, sin, tan

import pytest
from build123d import Box, BuildPart, Mode, Pos

from hinges import FitError, HingeError, Magnet, MagnetPocket, SnapDimple, SnapSpec, SnapTongue
from hinges.retention import STRAIN_LIMITS


def volume_of(shape):
    if shape is None:
        return 0.0
    return shape.volume if hasattr(shape, "volume") else sum(one.volume for one in shape)


@pytest.mark.parametrize("magnet", [Magnet(5, 2), Magnet(6, 3, "square")], ids=["round", "square"])
def test_a_pressed_magnet_lies_below_the_face_in_the_grip_of_ribs(magnet):
    pocket = MagnetPocket(magnet, mode=Mode.PRIVATE)
    assert len(pocket.solids()) == 1
    top = pocket.magnet_part.bounding_box().max.Z
    assert top == pytest.approx(-0.1)
    assert pytest.approx(-magnet.height - 0.1) == pocket.bounding_box().min.Z
    tight = MagnetPocket(magnet, room=-0.05, mode=Mode.PRIVATE)
    inside = volume_of(tight.solid().intersect(pocket.magnet_part.solid()))
    assert 0.97 * pocket.magnet_part.volume < inside < pocket.magnet_part.volume
    loose = volume_of(pocket.solid().intersect(pocket.magnet_part.solid()))
    assert loose == pytest.approx(pocket.magnet_part.volume)


def test_a_captured_magnet_is_closed_in():
    pocket = MagnetPocket(Magnet(5, 2), "captured", skin=0.6, mode=Mode.PRIVATE)
    block = Pos(0, 0, -5) * Box(12, 12, 10)
    left = block - pocket
    assert len(left.solids()[0].shells()) == 2  # the pocket is a void
    assert block.volume - left.volume == pytest.approx(pi * 2.65**2 * 2.2, rel=1e-6)
    assert pocket.pause_below == 0.6
    with pytest.raises(FitError, match="skin"):
        MagnetPocket(Magnet(5, 2), "captured", skin=0.2, mode=Mode.PRIVATE)


def test_a_pocket_cuts_in_a_builder():
    with BuildPart() as built:
        Box(20, 20, 10, align=None)
        MagnetPocket(Magnet(5, 2))
    assert built.part.volume < 4000


@pytest.mark.parametrize("wrong", [(0, 2), (5, -1), (5, 2, "hexagonal")])
def test_magnets_that_make_no_sense(wrong):
    with pytest.raises(HingeError, match="magnet"):
        Magnet(*wrong)
    with pytest.raises(HingeError, match="fit"):
        MagnetPocket(Magnet(5, 2), "glued", mode=Mode.PRIVATE)


def insertion_overlap(spec, withdrawn):
    """Volume in mm³ by which an unbent tongue, drawn out by some mm, overlaps its mortise."""
    partner = Pos(0, 0, 10 + spec.gap) * Box(20, 20, 20)
    mortise = partner - SnapDimple(spec, mode=Mode.PRIVATE)
    tongue = Pos(0, 0, -withdrawn) * SnapTongue(spec, mode=Mode.PRIVATE)
    return volume_of(tongue.solid().intersect(mortise.solid()))


def test_the_tongue_is_free_when_closed_and_bends_on_its_way():
    spec = SnapSpec()
    assert insertion_overlap(spec, 0.0) == pytest.approx(0.0, abs=1e-9)
    on_the_way = insertion_overlap(spec, 2.5)
    # what the unbent ridge takes of the mortise's wall: its height less the clearance
    ridge = spec.deflection * (0.2 + spec.deflection) * spec.width
    assert on_the_way == pytest.approx(ridge, rel=0.05)
    assert insertion_overlap(spec, spec.length + 1) == pytest.approx(0.0, abs=1e-9)


def test_strain_is_that_of_a_cantilever():
    spec = SnapSpec(length=10, thickness=1.0, catch=0.6, clearance=0.3)
    assert spec.strain == pytest.approx(1.5 * 1.0 * 0.3 / spec.ridge_at**2)
    assert STRAIN_LIMITS["pla"] == 0.008
    spec.check()
    with pytest.raises(FitError, match="strain") as caught:
        SnapTongue(SnapSpec(length=5), mode=Mode.PRIVATE)
    assert caught.value.limit == pytest.approx(0.8)
    SnapSpec(length=5, material="pp").check()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"thickness": 0.5}, "wall"),
        ({"width": 1.0}, "wall"),
        ({"catch": 0.35}, "retention"),
        ({"length": 2.5}, "retention|strain"),
        ({"material": "oak"}, "material"),
        ({"lead": 80}, "lead"),
    ],
    ids=str,
)
def test_refusals(changes, message):
    with pytest.raises(HingeError, match=message):
        SnapDimple(SnapSpec(**changes), mode=Mode.PRIVATE)


def test_solids_are_valid():
    for part in (SnapTongue(mode=Mode.PRIVATE), SnapDimple(mode=Mode.PRIVATE)):
        assert len(part.solids()) == 1
        assert part.solid().is_valid
        assert "snap" in part.joints


def bent_on_its_arc(spec: SnapSpec) -> float:
    """Strain of a tongue whose points are turned about the axis, step by step."""
    worst = 0.0
    side = -1.0 if spec.inwards else 1.0
    dimple = -spec.ridge_at + spec.catch / tan(radians(spec.lead)) + 0.1 + spec.clearance
    for step in range(2001):
        turn = atan2(spec.length, spec.arc) * step / 2000
        for height in (spec.ridge_at, spec.length):
            # The tongue hangs from the lid at (arc, 0); the mouth is the line z = 0.
            x = spec.arc * cos(turn) + height * sin(turn) - spec.arc
            z = spec.arc * sin(turn) - height * cos(turn)
            if z > 1e-9:
                continue  # still outside of the mortise
            press = x - spec.clearance
            if height == spec.ridge_at and z > dimple:
                press = side * x + spec.catch - spec.clearance
            worst = max(worst, 1.5 * spec.thickness * press / height**2)
    return worst


@pytest.mark.parametrize("arc", [25.0, 40.0, 75.0, 200.0])
@pytest.mark.parametrize("inwards", [False, True])
def test_the_strain_of_a_tongue_on_a_lid_is_that_of_its_arc(arc, inwards):
    spec = SnapSpec(length=8, arc=arc, inwards=inwards, material="pp")
    assert spec.strain == pytest.approx(bent_on_its_arc(spec), rel=0.02)
    straight = SnapSpec(length=8, material="pp").strain
    assert (spec.strain > straight) == (not inwards or spec.shift(8) > 0.5)


def test_an_arc_that_bends_too_far_is_refused():
    SnapTongue(SnapSpec(length=8))
    with pytest.raises(HingeError, match="farther from the axis"):
        SnapTongue(SnapSpec(length=8, arc=120))
    SnapTongue(SnapSpec(length=8, arc=120, inwards=True))
    with pytest.raises(HingeError, match="arc 5 mm must be above the tongue's length"):
        SnapTongue(SnapSpec(length=8, arc=5))
