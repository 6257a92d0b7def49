"""Thin models: what is thickened and what is not, bosses for hinges, and the automatic steps."""

from dataclasses import replace

import manifold3d
import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree
from typer.testing import CliRunner
from voxel_cases import material_voxels

from fabfold.cli.app import app
from fabfold.errors import NoVoxelsError, RecipeError
from fabfold.kit import keys
from fabfold.kit.kit import Kit
from fabfold.lattice.shipped import load_template
from fabfold.meshes import is_closed
from fabfold.recipe.recipe import make_recipe
from fabfold.solid.closed_solid import Solid
from fabfold.solid.convert import to_manifold, to_mesh
from fabfold.solid.crossing import crossing_triangles
from fabfold.solid.round_solid import round_solid
from fabfold.solid.thicken import inner_balls, thickened
from fabfold.voxels.features import features
from fabfold.voxels.thickening import STEPS, cut_thick, scarce_hinges
from fabfold.voxels.voxel_files import load_voxels, save_voxels

BOX = load_template("box-2x2x2")


def box(*bounds):
    low, high = np.array(bounds[:3], dtype=float), np.array(bounds[3:], dtype=float)
    return manifold3d.Manifold.cube(tuple(high - low)).translate(tuple(low))


def solid_of(*parts):
    vertices, faces = to_mesh(manifold3d.Manifold.batch_boolean(list(parts), manifold3d.OpType.Add))
    return Solid("thin", vertices, faces.astype(np.int32))


def lollipop():
    """A cube of 20 with a square rod of 2 on top."""
    return solid_of(box(-10, -10, 0, 10, 10, 20), box(-1, -1, 19, 1, 1, 60))


def bars():
    """Two voxels with a square bar through the middle of the face between them."""
    material = np.zeros((2, 20, 20, 20), dtype=bool)
    material[:, :, 7:13, 7:13] = True
    return material_voxels([(0, 0, 0), (1, 0, 0)], material)


@pytest.mark.parametrize(("degrees", "tilt"), [(35, 0.3), (17, 0.95), (20, 0.26), (18, 0.97)])
def test_the_solid_about_struts_that_meet_is_smooth_and_does_not_cross_itself(degrees, tilt):
    along = np.arange(0, 30, 0.2)[:, None]
    cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    struts = np.array(
        [
            [1, 0, 0],
            [cosine, sine * np.cos(tilt), sine * np.sin(tilt)],
            [cosine, -sine * np.sin(tilt), sine * np.cos(tilt)],
        ]
    )
    centres = np.concatenate([along * strut for strut in struts])
    made = round_solid(centres, 1.0)
    vertices, faces = to_mesh(made)
    assert len(crossing_triangles(vertices, faces)) == 0
    assert len(faces) < 4000
    # Between the points of a strut, a tenth apart, the surface of their balls is 0.005 deep.
    away, _ = cKDTree(centres).query(vertices)
    assert away.min() > 0.88
    assert np.abs(away - 1.0).mean() < 0.03
    # Narrow slits, where struts part, are bridged.
    assert np.quantile(away, 0.98) < 1.11


def test_balls_between_two_faces_have_half_their_distance_as_radius():
    plate = solid_of(box(0, 0, 0, 40, 30, 2))
    balls = inner_balls(plate.vertices, plate.faces, 3.0)
    x, y, _ = balls.points.T
    middle = (np.minimum(x, 40 - x) > 3) & (np.minimum(y, 30 - y) > 3)
    assert middle.sum() > 1000
    assert balls.radii[middle] == pytest.approx(1.0, abs=0.01)
    assert balls.centres[middle, 2] == pytest.approx(1.0, abs=0.01)
    assert (balls.radii <= 3.0).all()


@pytest.mark.slow
def test_balls_in_a_round_rod_lie_on_its_axis():
    rod = manifold3d.Manifold.cylinder(30, 2, 2, 48)
    balls = inner_balls(*(np.asarray(a) for a in to_mesh(rod)), 5.0)
    inside = (balls.points[:, 2] > 5) & (balls.points[:, 2] < 25)
    assert np.median(balls.radii[inside]) == pytest.approx(2.0, rel=0.1)  # of 48 facets


def test_a_thin_rod_grows_and_the_thick_part_keeps_its_surface():
    model = lollipop()
    made = thickened(model, 6.0)
    assert is_closed(made.solid.faces)
    body = to_manifold(made.solid.vertices, made.solid.faces)
    assert body.status() == manifold3d.Error.NoError
    assert len(body.decompose()) == 1
    # Nothing is taken away.
    old = to_manifold(model.vertices, model.faces)
    assert (old - body).volume() < 1e-3 * old.volume()
    # Far from the rod the cube is as it was, to the corners.
    below = box(-30, -30, -10, 30, 30, 16)
    assert ((body ^ below) - old).volume() < 1e-3
    # Half-way up, the rod is a disc of the wanted diameter.
    section = body.slice(40.0)
    assert section.area() == pytest.approx(np.pi * 9, rel=0.12)
    assert made.least == pytest.approx(2.0, abs=0.4)
    assert 0 < made.share < 0.5


@pytest.mark.slow
def test_a_plate_gets_the_thickness_that_is_wanted():
    made = thickened(solid_of(box(0, 0, 0, 60, 50, 1)), 4.0)
    body = to_manifold(made.solid.vertices, made.solid.faces)
    core = body ^ box(5, 5, -10, 55, 45, 10)
    _, _, low, _, _, high = core.bounding_box()
    assert high - low == pytest.approx(4.0, abs=0.1)
    assert core.volume() == pytest.approx(50 * 40 * 4, rel=0.03)
    assert made.least == pytest.approx(1.0, abs=0.1)


@pytest.mark.slow
def test_a_turned_model_grows_alike_to_a_thousandth():
    model = lollipop()
    turn = trimesh.transformations.rotation_matrix(0.9, (1, 0.4, -0.7))[:3, :3]
    turned = thickened(replace(model, vertices=model.vertices @ turn.T), 6.0)
    assert turned.solid.volume == pytest.approx(thickened(model, 6.0).solid.volume, rel=2e-3)


def test_what_is_thick_enough_stays_the_same_object():
    cube = solid_of(box(0, 0, 0, 20, 20, 20))
    assert thickened(cube, 8.0).solid is cube


@pytest.mark.slow
def test_thickening_gives_the_same_bytes_again():
    one, other = thickened(lollipop(), 5.0).solid, thickened(lollipop(), 5.0).solid
    assert np.array_equal(one.vertices, other.vertices)
    assert np.array_equal(one.faces, other.faces)


@pytest.mark.slow
def test_a_hollow_that_closes_is_filled():
    parts = [box(0, 0, 0, 20, 20, 1), box(0, 0, 5, 20, 20, 6)]
    parts += [box(0, 0, 0, 1, 20, 6), box(19, 0, 0, 20, 20, 6), box(0, 0, 0, 20, 1, 6)]
    parts += [box(0, 19, 0, 20, 20, 2)]  # a box with a slot under its lid
    made = thickened(solid_of(*parts), 5.5)
    pieces = to_manifold(made.solid.vertices, made.solid.faces).decompose()
    assert [piece.volume() > 0 for piece in pieces] == [True]


def test_bosses_let_hinges_stand_at_every_edge_of_a_contact():
    voxels = bars()
    assert scarce_hinges(voxels)
    assert not features(voxels).hinge.any()
    found = features(replace(voxels, bosses=True))
    assert found.rigid.all()
    assert found.hinge.all()
    assert not found.double.any()
    apart = voxels.subvoxels.copy()
    apart[1, 0] = False
    assert not features(replace(voxels, subvoxels=apart, bosses=True)).hinge.any()


def full():
    """Eight full voxels in a cube."""
    cells = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=np.int32)
    return replace(
        bars(), cells=cells, subvoxels=np.ones((8, 20, 20, 20), dtype=bool), fill=np.ones(8)
    )


def test_full_voxels_have_edges_enough():
    assert not scarce_hinges(full())


def test_bosses_are_kept_in_files(tmp_path):
    for bosses in (False, True):
        save_voxels(tmp_path / "v.npz", replace(bars(), bosses=bosses))
        assert load_voxels(tmp_path / "v.npz").bosses is bosses


@pytest.mark.slow
def test_the_first_step_that_can_be_cut_is_kept():
    model = lollipop()
    tried = []

    def cut(solid):
        tried.append(solid)
        if len(tried) < 3:
            raise NoVoxelsError("too thin")
        return [bars()]

    done = cut_thick(model, BOX, cut, pitch=20.0)
    assert tried[0] is model
    assert done.solid is tried[2]
    assert done.wanted == STEPS[1]
    assert done.solid.volume > tried[1].volume > model.volume
    assert done.options[0].bosses
    grown, bosses = replace(done, wanted=0.3, least=0.04).notes(20.0)
    assert grown.startswith("thickened by 5.2 mm at 20 mm voxels: the model was too thin")
    assert "0.8 mm" in grown
    assert "bosses" in bosses


def test_a_model_that_can_be_cut_is_left_alone():
    model = lollipop()
    voxels = full()
    done = cut_thick(model, BOX, lambda solid: [voxels])
    assert done.solid is model
    assert done.options[0] is voxels
    assert done.notes(20.0) == ()


@pytest.mark.slow
def test_the_refusal_of_the_model_is_told_where_no_step_helps():
    def cut(solid):
        raise NoVoxelsError("no placement of the grid fits")

    with pytest.raises(NoVoxelsError, match=r"no placement .* thickened to 50 % of a voxel"):
        cut_thick(lollipop(), BOX, cut, pitch=20.0)


def test_more_than_a_voxel_is_refused():
    with pytest.raises(RecipeError, match="at most the side of a voxel"):
        cut_thick(lollipop(), BOX, lambda solid: [bars()], thicken=1.5)


@pytest.mark.parametrize("value", ["thick", 0, -1, 20.5, float("nan"), True])
def test_a_wrong_thickness_is_told_in_plain_words(value):
    with pytest.raises(RecipeError, match="auto, off, or a thickness in mm"):
        make_recipe(model="sample:car", template="box-3x4x4", thicken=value)


def test_thickness_is_a_share_of_the_printed_voxel():
    recipe = make_recipe(model="sample:car", template="box-3x4x4", thicken=3, voxel_mm=15)
    assert recipe.thicken == 3.0
    assert recipe.thickness == pytest.approx(0.2)
    assert make_recipe(model="sample:car", template="box-3x4x4").thickness is None


def test_voxels_depend_on_the_thickness_and_not_on_how_it_is_said():
    def key(**options):
        recipe = make_recipe(model="sample:car", template="box-3x4x4", **options)
        return keys.voxels_key(recipe, load_template("box-3x4x4"))

    assert len({key(), key(thicken="off"), key(thicken=3), key(thicken=4)}) == 4
    assert key(thicken=3) == key(thicken=1.5, voxel_mm=10)
    assert key() == key(voxel_mm=10)


def wheel(folder):
    """A wheel of wires, far too thin for its size."""
    angles = np.linspace(0, 2 * np.pi, 13)
    rim = np.stack([40 * np.cos(angles), 40 * np.sin(angles), 0 * angles], axis=1)
    ball = manifold3d.Manifold.sphere(1.2, 12)
    bars = [(rim[i], rim[i + 1]) for i in range(12)] + [
        (0 * rim[0], rim[i]) for i in range(0, 12, 3)
    ]
    parts = [
        manifold3d.Manifold.batch_hull([ball.translate(tuple(a)), ball.translate(tuple(b))])
        for a, b in bars
    ]
    import trimesh

    vertices, faces = to_mesh(manifold3d.Manifold.batch_boolean(parts, manifold3d.OpType.Add))
    path = folder / "wheel.stl"
    trimesh.Trimesh(vertices, faces, process=False).export(path)
    return path


@pytest.mark.slow
def test_the_command_tells_by_how_much_and_off_refuses(tmp_path):
    model = str(wheel(tmp_path))
    run = lambda *more: CliRunner().invoke(  # noqa: E731
        app, ["voxelize", model, "-t", "box-2x3x4", "-o", str(tmp_path / "kit"), "-q", *more]
    )
    off = run("--thicken", "off")
    assert off.exit_code == NoVoxelsError.exit_code
    done = run("--thicken", "7")
    assert done.exit_code == 0
    assert "thickened by" in done.stdout
    assert "at least 7.0 mm now" in done.stdout
    again = Kit.from_model(model, folder=tmp_path / "kit", template="box-2x3x4", thicken=7.0)
    assert again.cut_solid().volume > 2 * again.solid().volume
    assert "thickened by" in again.cut_solid().notes[-2]


@pytest.mark.slow
def test_a_thin_plate_folds(tmp_path):
    import trimesh

    plate = solid_of(box(0, 0, 0, 50, 50, 1))
    model = tmp_path / "plate.stl"
    trimesh.Trimesh(plate.vertices, plate.faces, process=False).export(model)
    kit = Kit.from_model(
        model, template="box-2x2x4", effort="quick", folder=tmp_path / "kit", workers=1
    )
    assert all(check.ok for check in kit.check())
    assert any("bosses" in note for note in kit.cut_solid().notes)
