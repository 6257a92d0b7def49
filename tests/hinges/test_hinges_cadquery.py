"""Hinges in CadQuery."""

import importlib

import pytest
from hinge_environment import needs_cadquery

from hinges import HingeError

pytestmark = needs_cadquery


@pytest.fixture(scope="module")
def cq():
    return importlib.import_module("cadquery")


@pytest.fixture(scope="module")
def plugin():
    return importlib.import_module("hinges.cadquery")


@pytest.fixture
def body(cq, plugin):
    """Make a box of 19.7 mm below y = 0, with its middle at a given x."""
    return lambda x: cq.Workplane().box(19.7, 19.7, 19.7).translate((x, -10, 0))


def test_methods_work_at_every_point_of_the_stack(cq, plugin):
    made = cq.Workplane("XZ").pushPoints([(0, 0), (60, 0), (0, 60)]).singleHinge(20, clearance=0.3)
    assert made.solids().size() == 6
    made = cq.Workplane().rarray(50, 50, 2, 2).doubleHinge(20, clearance=0.3)
    assert made.solids().size() == 12
    apart = cq.Workplane().pushPoints([(0, 0), (60, 0)]).singleHinge(20, combine=False)
    assert apart.size() == 2


@pytest.mark.slow
def test_bodies_keep_the_clearance(body):
    parent = body(-10).hingeParent(20, clearance=0.3)
    child = body(10).hingeChild(20, clearance=0.3)
    assert parent.solids().size() == child.solids().size() == 1
    assert parent.val().isValid()
    # The barrel, on the axis; CadQuery measures on triangles where a shape has them already.
    assert parent.val().BoundingBox().xmax == pytest.approx(2.5, abs=0.02)
    assert child.val().BoundingBox().ymax == pytest.approx(2.5, abs=0.02)
    assert parent.val().distance(child.val()) == pytest.approx(0.3, abs=1e-6)
    assert parent.intersect(child).solids().size() == 0
    for angle in (60, 180):
        opened = child.rotate((0, 0, 0), (0, 0, 1), angle)
        assert parent.val().distance(opened.val()) == pytest.approx(0.3, abs=1e-6)


def test_two_hinges_on_one_body(cq, plugin):
    long = cq.Workplane().box(19.7, 19.7, 80).translate((-10, -10, 0))
    both = long.pushPoints([cq.Location((0, 0, -25)), cq.Location((0, 0, 25))])
    made = both.hingeParent(20, clearance=0.3)
    assert made.solids().size() == 1
    one = long.hingeParent(20, clearance=0.3)
    change = one.val().Volume() - long.val().Volume()
    assert made.val().Volume() - long.val().Volume() == pytest.approx(2.0 * change, rel=1e-6)


def test_halves_and_cutters(body):
    cut = body(-10).cutHinge("parent", 20, clearance=0.3)
    fitted = cut.hingeHalf("parent", 20, clearance=0.3)
    direct = body(-10).hingeParent(20, clearance=0.3)
    assert fitted.val().Volume() == pytest.approx(direct.val().Volume(), rel=1e-9)
    with pytest.raises(HingeError, match="side"):
        body(-10).cutHinge("left", 20)


def test_plain_functions_for_invoke_and_apply(cq, plugin, body):
    parent = body(-10).invoke(plugin.parent_of(20, clearance=0.3))
    child = body(10).invoke(plugin.child_of(20, clearance=0.3))
    assert parent.val().distance(child.val()) == pytest.approx(0.3, abs=1e-6)
    made = cq.Workplane().pushPoints([(0, 0), (40, 0)]).apply(plugin.hinge_at(20, clearance=0.3))
    assert made.solids().size() == 4


def test_shapes_pass_both_ways_without_a_copy(cq, plugin):
    from build123d import Box

    part = Box(1, 2, 3)
    shape = plugin.to_cadquery(part)
    assert shape.Volume() == pytest.approx(6)
    assert shape.wrapped.IsSame(part.solid().wrapped)
    back = plugin.from_cadquery(cq.Workplane(obj=shape))
    assert back.solid().wrapped.IsSame(shape.wrapped)
    assert plugin.from_cadquery(shape).volume == pytest.approx(6)
    with pytest.raises(HingeError, match="no solid"):
        plugin.from_cadquery(cq.Workplane().rect(1, 1))


def test_a_body_out_of_reach_is_refused(body):
    with pytest.raises(HingeError, match="pieces instead of 1"):
        body(200).hingeParent(20)


def test_no_name_is_overridden(monkeypatch, cq, plugin):
    def mine(self):
        return "mine"

    monkeypatch.setattr(cq.Workplane, "singleHinge", mine)
    importlib.reload(plugin)
    assert cq.Workplane().singleHinge() == "mine"
    assert set(plugin.METHODS) >= {"singleHinge", "doubleHinge", "hingeParent", "hingeChild"}


def lidded(cq):
    box = cq.Workplane().box(60, 39.7, 36).translate((0, -20, 0))
    lid = cq.Workplane().box(60, 39.7, 36).translate((0, 20, 0))
    box = box.edges(">Y and >Z").hingeParent(outwards=(0, 0, 1), clearance=0.3)
    return box, lid.edges("<Y and >Z").hingeChild(outwards=(0, 0, 1), clearance=0.3)


@pytest.mark.slow
def test_a_hinge_lies_along_an_edge(cq, plugin):
    from build123d import Box, Pos

    from hinges import SingleHinge, hinge_location

    box, lid = lidded(cq)
    want = SingleHinge(60, clearance=0.3).fit(
        Pos(0, -20, 0) * Box(60, 39.7, 36),
        Pos(0, 20, 0) * Box(60, 39.7, 36),
        hinge_location((0, 0, 18.15), (1, 0, 0), (0, 0, 1)),
    )
    for made, other in zip((box, lid), want, strict=True):
        assert made.val().isValid()
        assert made.solids().size() == 1
        bounds = made.val().BoundingBox()
        assert bounds.zmax == pytest.approx(other.bounding_box().max.Z, abs=1e-3)
        assert bounds.xlen == pytest.approx(60, abs=1e-3)
    assert box.val().distance(lid.val()) == pytest.approx(0.3, abs=1e-6)


@pytest.mark.parametrize(("angle", "top"), [(0, 180), (180, 0)])
def test_an_assembly_closes_by_constraints(cq, plugin, angle, top):
    box, lid = lidded(cq)
    far = cq.Location(cq.Vector(100, 50, 20), cq.Vector(1, 1, 0), 40)
    whole = cq.Assembly().add(box, name="box").add(lid, name="lid", loc=far)
    whole.constrain("box", "Fixed")
    whole.constrain("box?hinge", "lid?hinge", "Point")
    whole.constrain("box?hinge", "lid?hinge", "Axis", param=0)
    whole.constrain("box@faces@<Z", "lid@faces@<Z", "Axis", param=180 - top)
    whole.solve()
    placed = lid.val().moved(whole.children[1].loc)
    bounds = placed.BoundingBox()
    if angle == 0:
        assert (bounds.ymin, bounds.zmin) == pytest.approx((-3.0, -18), abs=0.01)
    else:
        assert bounds.zmax == pytest.approx(18.3 + 36, abs=0.01)
    assert box.val().intersect(placed).Volume() == pytest.approx(0.0, abs=1e-6)


def test_edges_without_a_direction_are_refused(cq, plugin):
    box = cq.Workplane().box(60, 39.7, 36)
    with pytest.raises(HingeError, match=r"needs the direction out of both bodies"):
        box.edges(">Y and >Z").hingeParent(60)
    with pytest.raises(HingeError, match="no face at the edge looks in the direction"):
        box.edges(">Y and >Z").hingeParent(60, outwards=(1, 0, 0))
    with pytest.raises(HingeError, match="give the length"):
        box.hingeParent()
