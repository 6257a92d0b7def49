"""Living hinges by the strain of their web, balls in sockets by the gap that they keep."""

from math import pi, radians, sin

import pytest
from build123d import Align, Axis, Box, Location, Part

from hinges import BallSocket, FitError, HingeError, LivingHinge
from hinges.living_hinge import FLEX_LIVES

FLAT = (Align.CENTER, Align.MIN, Align.CENTER)


def test_the_groove_leaves_the_web_and_leans_by_half_the_angle():
    fold = LivingHinge(40, 3.0, angle=90, web=0.4, material="pp", land=12.0)
    plate = Box(60, 3, 40, align=FLAT)
    cut = Part() + plate - fold
    assert len(cut.solids()) == 1
    mouth = 12.0 + 2 * (3.0 - 0.4)  # tan 45° = 1
    assert plate.volume - cut.volume == pytest.approx(
        40 * (3.0 - 0.4) * (12.0 + mouth) / 2, rel=1e-6
    )
    floor = cut.faces().filter_by(Axis.Y).sort_by(Axis.Y)
    heights = sorted({round(face.center().Y, 6) for face in floor})
    assert heights == [0.0, 0.4, 3.0]


@pytest.mark.parametrize("material", FLEX_LIVES)
@pytest.mark.parametrize("use", ["again", "few"])
def test_the_land_is_as_long_as_the_material_asks(material, use):
    fold = LivingHinge(30, 2.0, angle=120, web=0.3, material=material, use=use)
    bears = FLEX_LIVES[material].again if use == "again" else FLEX_LIVES[material].few
    assert fold.strain == pytest.approx(0.3 * radians(120) / (2 * fold.land))
    assert fold.strain <= bears * (1 + 1e-9)
    assert fold.land >= 0.8
    if fold.land > 0.8001:
        assert fold.strain == pytest.approx(bears)
    # The web is an arc of its land, and the groove's sides stand side by side in the end.
    assert fold.radius * radians(120) == pytest.approx(fold.land)
    assert fold.gap == pytest.approx(2 * (fold.radius - 0.15) * sin(radians(60)))
    assert fold.gap > 0


def test_a_land_that_is_too_short_is_told_with_the_right_one():
    with pytest.raises(FitError, match=r"strain of the web in pla.*land of 29\.45 mm"):
        LivingHinge(30, 2.0, angle=90, web=0.3, material="pla", land=5.0)
    few = LivingHinge(30, 2.0, angle=90, web=0.3, material="pla", use="few", land=6.0)
    assert "a few folds" in few.life.words


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"angle": 0}, "folds by 1 to 169"),
        ({"angle": 180}, "folds by 1 to 169"),
        ({"web": 0.05}, "at least one layer"),
        ({"web": 1.0}, "thicker plate"),
        ({"material": "gold"}, "use one of pla"),
        ({"use": "often"}, "'again' or 'few'"),
        ({"land": -1.0}, "above 0"),
        ({"angle": float("nan")}, "angle"),
    ],
)
def test_living_hinges_that_make_no_sense_are_refused(options, told):
    with pytest.raises(HingeError, match=told):
        LivingHinge(30, 2.0, **options)


@pytest.mark.parametrize("swing", [0.0, 15.0, 25.0])
def test_a_ball_keeps_its_clearance_up_to_the_swing(swing):
    joint = BallSocket(6, clearance=0.3, swing=swing)
    ball, socket = joint.ball, joint.socket
    assert len(ball.solids()) == len(socket.solids()) == 1
    for angle in {0.0, swing / 2, swing}:
        leaning = Location((0, 0, 0), (angle, 0, 30)) * ball
        assert leaning.distance_to(socket) == pytest.approx(0.3, abs=2e-3)
    past = Location((0, 0, 0), (swing + 8.0, 0, 0)) * ball
    assert past.distance_to(socket) < 0.05


def test_the_mouth_holds_the_ball():
    joint = BallSocket(6, clearance=0.3, swing=25)
    assert joint.retention == pytest.approx(6 - joint.mouth)
    assert joint.retention > 0.3
    # Pulled out along its axis, the ball meets the rim.
    pulled = Location((0, 0, 4.0)) * joint.ball
    assert (pulled & joint.socket).volume > 1.0
    assert joint.most_swing > 25
    assert BallSocket(6, clearance=0.3, swing=joint.most_swing - 0.01).retention == pytest.approx(
        0.36, abs=0.01
    )
    with pytest.raises(FitError, match=r"swing no more than \d+ degrees"):
        BallSocket(6, clearance=0.3, swing=joint.most_swing + 1)


def test_joints_connect_and_swing():
    joint = BallSocket(5, clearance=0.25, swing=20)
    ball, socket = joint.ball, joint.socket
    socket.location = Location((10, 20, 30))
    socket.joints["socket"].connect_to(ball.joints["ball"], angles=(15, 0, 0))
    assert ball.bounding_box().max.Z > 30
    assert ball.distance_to(socket) == pytest.approx(0.25, abs=2e-3)


def test_slots_cut_the_rim_into_fingers():
    whole, cut = (BallSocket(6, clearance=0.2, swing=20, slots=n).socket for n in (0, 4))
    assert cut.volume < whole.volume
    assert len(cut.solids()) == 1
    joint = BallSocket(6, clearance=0.2, swing=20, slots=4)
    assert joint.strain == pytest.approx(joint.retention / joint.mouth)


def test_the_ball_is_what_it_says():
    joint = BallSocket(5, clearance=0.25, swing=10, neck=2, reach=12)
    sphere = 4 / 3 * pi * 5**3
    assert joint.ball.volume > sphere
    assert pytest.approx(12) == joint.ball.bounding_box().max.Z
    assert "BallSocket(5, clearance=0.25, swing=10" in repr(joint)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"radius": -1}, "above 0"),
        ({"swing": 90}, "0 to 90"),
        ({"neck": 7}, "below that of the ball"),
        ({"neck": 0.2}, "thicker neck"),
        ({"reach": 3}, "must leave the ball"),
        ({"slots": 1}, "at least 2"),
        ({"clearance": "wide"}, "cannot be read"),
        ({"swing": float("nan")}, "swing"),
    ],
)
def test_balls_that_make_no_sense_are_refused(options, told):
    keywords = {"radius": 6, "clearance": 0.3, **options}
    with pytest.raises(HingeError, match=told):
        BallSocket(keywords.pop("radius"), **keywords)
