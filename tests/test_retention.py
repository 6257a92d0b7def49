"""Friction pins, magnets that hold the model too, and pockets that are closed while printing."""

import json
from dataclasses import replace

import numpy as np
import pytest
from joinery_models import motion_of_order, posed, strip_tree

from fabfold.apart.apart_kit import prepare_apart
from fabfold.errors import RecipeError
from fabfold.guide.advice import print_lines
from fabfold.guide.magnet_pictures import MAGNET_PIXELS, magnet_pictures
from fabfold.guide.pauses import print_pauses
from fabfold.joinery.bodies import Joinery
from fabfold.joinery.body_poses import poses_in_mm
from fabfold.joinery.box_hold import Retention, _with_poles, hinges_that_move
from fabfold.joinery.build import build_bodies
from fabfold.joinery.cells import as_manifold
from fabfold.joinery.loose_pins import cylinder_between, meshes_with_pins, pin_bores
from fabfold.joinery.magnets import MAGNETS, MagnetPair, Pocket
from fabfold.kit import keys
from fabfold.kit.holding import hold_kit, mode_of
from fabfold.kit.kit import Kit, open_kit
from fabfold.printing.print_mode import Hold, print_mode
from fabfold.printing.profiles import load_profile
from fabfold.progress import SilentProgress
from fabfold.proof.certify import certify
from fabfold.recipe.recipe import make_recipe

PLA = load_profile("fdm-pla-0.4")
ALL = Hold("3x1", friction=True, in_a=True, enclosed=True)


@pytest.fixture(scope="module")
def apart(bar_kit):
    """The bar's tree and path, and its bodies printed apart."""
    planned, mode = bar_kit.fold(), print_mode(PLA)
    joinery = build_bodies(
        planned.voxels,
        planned.tree,
        planned.motion,
        voxel_mm=20.0,
        clearance_mm=PLA.apart.clearance_mm,
        face_gap_mm=PLA.apart.face_gap_mm,
        pin=mode.loose_pin(),
    )
    made = prepare_apart(planned.tree, planned.motion, joinery, mode, SilentProgress())
    return planned.tree, planned.motion, *made


def held(apart, hold):
    tree, motion, joinery, kit = apart
    mode = print_mode(PLA, hold=hold)
    return hold_kit(tree, motion, joinery, kit, mode, SilentProgress())


@pytest.fixture(scope="module")
def rubbing(apart):
    return held(apart, Hold(friction=True))


@pytest.fixture(scope="module")
def everything(apart):
    return held(apart, ALL)


@pytest.mark.slow
def test_hinges_that_move_get_pins_that_both_bodies_grip(apart, rubbing):
    tree, motion, before, _ = apart
    joinery, kit, retention = rubbing
    assert retention.friction.hinges == tuple(hinges_that_move(tree, motion, before))
    assert {pin.hinge for pin in joinery.pins if pin.tight} == set(retention.friction.hinges)
    assert kit.replay.done == kit.replay.pins == len(tree.hinges)
    bores = pin_bores(tree, joinery)
    for pin in joinery.pins:
        bore = bores[pin.hinge]
        turning = next(body for body in bore.bodies if body != bore.owner)
        mesh = joinery.bodies[turning]
        solid = as_manifold(mesh.vertices, mesh.faces, mesh.name)
        # Around the middle of the barrel, where the turning body's knuckle is.
        ends = bore.middle - bore.axis, bore.middle + bore.axis
        free = cylinder_between(*ends, 0.99 * 0.975, outside=False)
        lined = cylinder_between(*ends, 1.05, outside=False) - cylinder_between(
            *ends, 0.99, outside=True
        )
        assert (solid ^ free).volume() < 1e-6
        assert pin.tight == ((solid ^ lined).volume() > 0.95 * lined.volume())


@pytest.mark.slow
def test_a_lining_touches_nothing_but_its_pin(apart, rubbing):
    tree, motion, _, _ = apart
    joinery = rubbing[0]
    loose = meshes_with_pins(joinery, tight=False)
    assert sum(len(faces) for _, faces in loose) < sum(
        len(faces) for _, faces in meshes_with_pins(joinery)
    )
    proof = certify(tree, motion, loose, 20.0, joinery.origin_mm, PLA.apart.min_gap_mm)
    assert proof["min_gap_mm"] >= PLA.apart.min_gap_mm


@pytest.mark.slow
def test_the_strain_is_what_the_material_bears_and_the_torque_follows(apart, rubbing):
    joinery, friction = rubbing[0], rubbing[2].friction
    assert friction.strain == 0.008
    assert friction.narrower_mm == pytest.approx(0.008 * 0.875)
    # A thick ring (Lamé) of 2300 N/mm² whose bore is widened by 0.8 %.
    a, b = 0.875, joinery.barrel_radius_mm
    pressure = 2300 * 0.008 / ((b**2 + a**2) / (b**2 - a**2) + 0.35)
    long = (20 - 2 * (b + 0.3) - 2 * 0.3) / 3
    assert friction.torque_nmm == pytest.approx(0.3 * pressure * 2 * np.pi * a**2 * long, abs=0.1)
    weight = sum(body.volume for body in joinery.bodies) * PLA.density_g_cm3 * 9.81e-6
    assert weight / 2 * 5 < friction.needed_nmm < weight * 60


@pytest.mark.slow
def test_magnets_hold_the_model_too_where_no_pocket_is(apart, everything):
    tree, motion, before, _ = apart
    joinery, _, retention = everything
    assert retention.skin_mm == 0.4
    assert {pair.shape for pair in retention.pairs} == {"A", "B"}
    assert set(retention.in_a[1]) < set(retention.in_a[0])
    for pair in retention.pairs:
        poses = poses_in_mm(tree, joinery, motion.angles_deg[0 if pair.shape == "A" else -1])
        one, other = (
            poses[body][:3, :3] @ np.array(point) + poses[body][:3, 3]
            for body, point in zip(pair.bodies, pair.points_mm, strict=True)
        )
        assert np.linalg.norm(one - other) == pytest.approx(joinery.gap_mm, abs=1e-6)
    # All pockets together take as much as each by itself: none runs into another.
    joinery, kit, retention = held(apart, replace(ALL, friction=False))
    pocket, each = Pocket(MAGNETS["3x1"], 0.4), 0.0
    for pair in retention.pairs:
        for body, point, inward in zip(pair.bodies, pair.points_mm, pair.inwards, strict=True):
            mesh = before.bodies[body]
            upwards = kit.plates.poses[body][2, :3]
            cut = pocket.cutter(np.array(point), np.array(inward), upwards)
            each += (as_manifold(mesh.vertices, mesh.faces, mesh.name) ^ cut).volume()
    lost = sum(b.volume for b in before.bodies) - sum(b.volume for b in joinery.bodies)
    assert lost == pytest.approx(each, rel=1e-3)


@pytest.mark.slow
def test_an_enclosed_magnet_lies_below_a_skin_and_goes_in_from_above(apart, everything):
    joinery, kit, retention = everything
    poses = kit.plates.poses
    upright = 0
    for pair in retention.pairs:
        for body, point, inward, pause in zip(
            pair.bodies, pair.points_mm, pair.inwards, pair.pauses_mm, strict=True
        ):
            mesh = joinery.bodies[body]
            solid = as_manifold(mesh.vertices, mesh.faces, mesh.name)
            mouth, into = np.array(point), np.array(inward)
            room = cylinder_between(mouth + 0.42 * into, mouth + 1.58 * into, 1.55, outside=False)
            assert (solid ^ room).volume() < 1e-3
            skin = cylinder_between(mouth + 0.02 * into, mouth + 0.38 * into, 1.6, outside=False)
            vent = cylinder_between(mouth - into, mouth + into, 0.35, outside=True)
            assert (solid ^ (skin - vent)).volume() > 0.98 * (skin - vent).volume()
            # Straight up from the magnet's middle nothing is in the way until the pause.
            up = poses[body][2, :3]
            middle = mouth + 1.0 * into
            height = float(up @ middle + poses[body][2, 3])
            side = np.cross(up, into)
            stands = bool(np.linalg.norm(side) > 0.5)
            upright += stands
            # Beside the vent, which may be above.
            across = side if stands else np.roll(into, 1)
            for shift in (-1.4, 0.7, 1.4):
                start = middle + shift * across
                end = start + (pause - height - 0.01) * up
                assert not solid.ray_cast(tuple(start), tuple(end))
                assert solid.ray_cast(tuple(start), tuple(end + 0.05 * up))
    assert upright


@pytest.mark.slow
def test_pauses_name_every_magnet_once_and_go_up(apart, everything):
    _, kit, retention = everything
    pauses = print_pauses(retention, kit)
    assert [(p.plate, p.z_mm) for p in pauses] == sorted((p.plate, p.z_mm) for p in pauses)
    assert sum(len(p.north) for p in pauses) == len(retention.pairs)
    assert sum(len(p.south) for p in pauses) == len(retention.pairs)
    assert print_pauses(None, kit) == []
    assert print_pauses(replace(retention, pairs=()), kit) == []


def test_in_place_pauses_count_from_the_lowest_point_of_the_kit(bar_kit):
    built = bar_kit.join()
    tree, motion, before = built.planned.tree, built.planned.motion, built.joinery
    mode = print_mode(load_profile("polyjet"), hold=Hold("3x1", enclosed=True))
    joinery, apart, retention = hold_kit(tree, motion, before, None, mode, SilentProgress())
    assert apart is None
    pauses = print_pauses(retention, None)
    assert pauses
    assert all(pause.plate is None for pause in pauses)
    low = min(body.vertices[:, 2].min() for body in before.bodies)
    for pair in retention.pairs:
        for point, inward, pause in zip(pair.points_mm, pair.inwards, pair.pauses_mm, strict=True):
            # On its rim the pocket ends a radius above its middle, lying at its upper face.
            above = {0.0: 1.6, 1.0: 1.6, -1.0: -0.4}[inward[2]]
            assert pause == pytest.approx(point[2] - low + above, abs=2e-3)
    told = print_lines(mode, joinery, pauses)
    assert sum(line.startswith("Pause at z = ") for line in told) == len(pauses)


@pytest.mark.slow
def test_retention_comes_back_from_json(everything):
    retention = everything[2]
    assert Retention.from_json(json.loads(json.dumps(retention.to_json()))) == retention


@pytest.mark.slow
def test_every_magnet_is_seen_in_a_picture(everything):
    joinery, _, retention = everything
    pictures = magnet_pictures(joinery, retention, np.eye(3))
    bodies = {body for pair in retention.pairs for body in pair.bodies}
    assert {picture.body for picture in pictures} == bodies
    assert all(picture.image.shape == (*MAGNET_PIXELS[::-1], 3) for picture in pictures)
    red = blue = 0
    for picture in pictures:
        colour = picture.image.astype(int)
        red += int(((colour[..., 0] - colour[..., 2]) > 90).sum())
        blue += int(((colour[..., 2] - colour[..., 0]) > 90).sum())
    assert min(red, blue) > 30 * len(retention.pairs)
    assert magnet_pictures(joinery, None, np.eye(3)) == []


def test_poles_are_turned_so_that_neighbours_do_not_repel():
    tree = strip_tree(4, [1])
    motion = motion_of_order(tree, [0])
    joinery = Joinery((), 20.0, (0.0, 0.0, 0.0), 0.5, 2.5, 1.5, 3)

    def pair(x, z):
        # Folded over the hinge at x = 30, y = 10, the second body lies on the first.
        return MagnetPair(
            (0, 1), ((x, 9.75, z), (60 - x, 9.75, z)), ((0.0, -1.0, 0.0), (0.0, -1.0, 0.0))
        )

    pocket = Pocket(MAGNETS["3x1"])
    two, repelling = _with_poles(tree, motion, joinery, [pair(0, 0), pair(6, 0)], pocket)
    assert [found.bodies for found in two] == [(0, 1), (1, 0)]
    assert two[1].turned() == pair(6, 0)
    assert repelling == 0
    far, repelling = _with_poles(tree, motion, joinery, [pair(0, 0), pair(20, 0)], pocket)
    assert far == [pair(0, 0), pair(20, 0)]
    assert repelling == 0
    # Of three that are near each other two are alike; their four magnets repel twice.
    three = [pair(0, 0), pair(6, 0), pair(3, 5)]
    assert _with_poles(tree, motion, joinery, three, pocket)[1] == 2


@pytest.mark.slow
def test_the_box_stays_whole_with_everything_in_it(apart, everything):
    tree, motion, _, _ = apart
    joinery = everything[0]
    for angles in (motion.angles_deg[0], motion.angles_deg[-1]):
        solids = posed(joinery, tree, angles)
        for one in range(len(solids)):
            assert len(solids[one].decompose()) == 1
            for other in range(one):
                assert (solids[one] ^ solids[other]).volume() < 1e-6


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"retention": "friction"}, "--print apart"),
        ({"retention": "magnet", "magnet_fit": "enclosed"}, "--magnet-fit glued"),
        ({"retention_in_a": True}, "--retention magnet"),
        (
            {"retention": "friction", "profile": "fdm-pla-0.4", "magnet_fit": "enclosed"},
            "--retention magnet",
        ),
    ],
)
def test_what_a_way_of_printing_cannot_hold_is_refused_with_a_remedy(options, told):
    recipe = make_recipe(model="sample:car", template="box-2x2x2", **options)
    with pytest.raises(RecipeError, match=told):
        mode_of(recipe)


@pytest.mark.slow
def test_a_kit_tells_its_pauses_and_what_friction_holds(searched, bar, bar_options, tmp_path):
    kit = Kit.from_model(
        bar, folder=searched(tmp_path / "kit"), workers=1, profile="fdm-pla-0.4",
        retention="magnet+friction", retention_in_a=True, magnet_fit="enclosed", **bar_options,
    )  # fmt: skip
    folder = kit.export()
    report = json.loads((folder / "report.json").read_text("utf-8"))
    assert report["verdict"] == "ok"
    data = json.loads((folder / "retention.json").read_text("utf-8"))
    assert data["version"] == 2
    assert {pair["shape"] for pair in data["pairs"]} == {"A", "B"}
    heights = {
        pair[side]["pause_z_mm"] for pair in data["pairs"] for side in ("north_out", "south_out")
    }
    assert heights == {pause["z_mm"] for pause in data["pauses"]}
    manual = (folder / "manual.html").read_text("utf-8")
    assert all(f"z = {height:g} mm" in manual for height in heights)
    assert "The magnets" in manual
    bill = (folder / "bom.csv").read_text("utf-8")
    assert f'"disc magnet, neodymium",{2 * len(data["pairs"])},' in bill
    assert "glue" not in bill
    held = {check["name"]: check for check in report["checks"]}
    assert held["hinges held in the model"]["figure"] > 0
    rubbing = data["friction_pins"]
    assert ([] if rubbing is None else rubbing["hinges"]) == data["moves_without"]
    assert open_kit(str(folder), workers=1).join().retention == kit.join().retention


@pytest.mark.slow
def test_a_certificate_names_the_friction_pins_that_it_leaves_out(
    searched, bar, bar_options, tmp_path
):
    kit = Kit.from_model(
        bar, folder=searched(tmp_path / "kit"), workers=1, profile="fdm-pla-0.4",
        retention="friction", **bar_options,
    )  # fmt: skip
    built = kit.join()
    names = [built.planned.tree.hinges[hinge].name for hinge in built.retention.friction.hinges]
    assert names
    assert all(name in built.planned.motion.certificate["geometry"] for name in names)
    again = open_kit(str(tmp_path / "kit"), workers=1).join()
    assert again.retention == built.retention
    assert [pin.tight for pin in again.joinery.pins] == [pin.tight for pin in built.joinery.pins]


@pytest.mark.slow
def test_blocks_are_a_kit_like_any_other(bar_kit, searched, bar, bar_options, tmp_path):
    kit = Kit.from_model(
        bar,
        folder=searched(tmp_path / "kit"),
        workers=1,
        skin="lattice",
        retention="magnet",
        **bar_options,
    )
    folder = kit.export()
    report = json.loads((folder / "report.json").read_text("utf-8"))
    assert report["verdict"] == "ok"
    assert "box_closed" not in report["summary"]
    assert report["summary"]["struts"] == 0
    assert 'skin = "lattice"' in (folder / "kit.toml").read_text("utf-8")
    # The surface is another one than the model's, and so are the bodies.
    assert keys.join_key(kit.recipe, kit.template, kit.print_mode(), kit._mark()) != keys.join_key(
        bar_kit.recipe, bar_kit.template, bar_kit.print_mode(), bar_kit._mark()
    )
