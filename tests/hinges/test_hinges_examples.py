"""The examples of hinges run, and what they make is sound."""

import re
from itertools import combinations
from pathlib import Path

import pytest
from hinge_environment import needs_cadquery
from hinge_examples import load

ROOT = Path(__file__).parents[2]


BLOCKS = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "hinges.md").read_text("utf-8"), re.S)


def apart(one, other):
    return one.solid().shells()[0].distance_to(other.solid().shells()[0])


@pytest.fixture(scope="module")
def lidded_box():
    return load("07_lidded_box_build123d").main()


@pytest.mark.slow
def test_lidded_box_opens_and_closes(lidded_box):
    box, lid = lidded_box
    assert len(box.solids()) == len(lid.solids()) == 1
    for angle in (0, 60, 120, 180):
        box.joints["hinge"].connect_to(lid.joints["hinge"], angle=angle)
        assert apart(box, lid) == pytest.approx(0.3, abs=1e-5)
    assert pytest.approx(36.3) == lid.bounding_box().max.Z


@pytest.mark.slow
@needs_cadquery
def test_the_same_box_in_cadquery(lidded_box):
    box, lid = load("08_lidded_box_cadquery").main()
    one, other = lidded_box
    assert box.val().Volume() == pytest.approx(one.volume, rel=1e-6)
    assert lid.val().Volume() == pytest.approx(other.volume, rel=1e-6)
    assert box.val().distance(lid.val()) == pytest.approx(0.3, abs=1e-6)


@pytest.mark.slow
def test_phone_stand_leans_and_folds():
    module = load("09_phone_stand_build123d")
    base, back, link, lip = bodies = module.main()
    assert all(len(body.solids()) == 1 for body in bodies)
    for one, other in combinations(bodies, 2):
        assert apart(one, other) >= 0.3 - 1e-5
    base.joints["back"].connect_to(back.joints["back"], angle=60)
    assert apart(base, back) == pytest.approx(0.3, abs=1e-5)
    base.joints["back"].connect_to(back.joints["back"], angle=module.LEAN)
    assert apart(base, back) == pytest.approx(0.0, abs=1e-5)  # on its stop
    base.joints["link"].connect_to(link.joints["parent"], angle=180)
    link.joints["child"].connect_to(lip.joints["link"], angle=0)
    assert pytest.approx(0.15) == lip.bounding_box().min.Z  # on the base
    assert apart(base, lip) >= 0.3 - 1e-5
    base.joints["link"].connect_to(link.joints["parent"], angle=0)
    link.joints["child"].connect_to(lip.joints["link"], angle=180)
    assert lip.center().Z < -module.THICK  # under it
    assert apart(base, lip) >= 0.3 - 1e-5


@pytest.mark.slow
def test_coupon_with_clearances_of_ones_own(capsys):
    coupon = load("10_tolerance_coupon").main()
    assert len(coupon.solids()) == 5  # the frame, a flap for each clearance, the plug
    assert "0.30 mm: plays 0.42 mm across" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.parametrize(
    "block",
    [pytest.param(b, marks=needs_cadquery if "cadquery" in b else ()) for b in BLOCKS],
    ids=lambda block: block.splitlines()[-1][:30],
)
def test_blocks_of_the_page_run(block, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = {}
    exec(block, names)
    halves = [names[n] for n in ("box", "lid") if n in names]
    for half in halves:
        assert len(half.solids().vals() if hasattr(half, "vals") else half.solids()) == 1
