"""The studio without a browser: its gate, its steps, and what its parts work out."""

from __future__ import annotations

import http.client
import json
import shutil
from contextlib import contextmanager

import numpy as np
import pytest
import trimesh

from fabfold.errors import ModelError, NoFoldError, RecipeError
from fabfold.joinery.sizes import hinge_size
from fabfold.kit.figure_pictures import bodies_named
from fabfold.kit.kit import open_kit
from fabfold.lattice.rotations import rotation_of_degrees
from fabfold.physics.actions import Match, Unfold, Wait
from fabfold.recipe.start import set_up_project
from fabfold.solid.closed_solid import Solid
from fabfold.studio.fold_panel import angles_at
from fabfold.studio.gate import Gate, quiet_stop, start_server
from fabfold.studio.grid_panel import ModelView, grid_fill
from fabfold.studio.kit_scene import KitScene, cube_meshes
from fabfold.studio.page_tasks import escaped
from fabfold.studio.serve import serve
from fabfold.studio.size_panel import hinge_outlook
from fabfold.studio.steps import StudioSteps, with_folder
from fabfold.studio.wish_panel import sphere_text


@pytest.fixture
def kit(bar_kit, tmp_path):
    """A copy of the bar's kit, to be changed."""
    folder = tmp_path / "bar-kit"
    shutil.copytree(bar_kit.folder, folder)
    return folder


# The gate -----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def gate():
    gate = Gate()
    server = start_server(gate, 0)
    yield gate
    quiet_stop(server)


def asked(gate, path="/", **headers):
    connection = http.client.HTTPConnection("127.0.0.1", gate.port, timeout=10)
    connection.request("GET", path, headers={k.replace("_", "-"): v for k, v in headers.items()})
    answer = connection.getresponse()
    body = answer.read()
    connection.close()
    return answer.status, answer.headers, body


def test_only_who_has_the_key_gets_the_page(gate):
    cookie = f"fabfold-{gate.port}={gate.token}"
    status, headers, body = asked(gate, f"/?token={gate.token}")
    assert status == 200
    assert b"<!doctype html>" in body[:100].lower()
    assert f"{cookie};" in headers["Set-Cookie"]
    assert "SameSite=Strict" in headers["Set-Cookie"]
    assert "HttpOnly" in headers["Set-Cookie"]
    policy = headers["Content-Security-Policy"]
    assert "http:" not in policy
    assert "https:" not in policy
    assert asked(gate, Cookie=cookie)[0] == 200
    for path, more in (
        ("/", {}),
        ("/?token=", {}),
        (f"/?token={gate.token}x", {}),
        ("/", {"Cookie": f"fabfold-{gate.port}=guess"}),
        ("/", {"Cookie": f"fabfold-{gate.port + 1}={gate.token}"}),
    ):
        status, _, body = asked(gate, path, **more)
        assert status == 403
        assert b"open the address that fabfold studio printed" in body


def test_other_hosts_and_pages_are_refused(gate):
    cookie = f"fabfold-{gate.port}={gate.token}"
    for host in ("evil.example", f"evil.example:{gate.port}", "127.0.0.1:1", ""):
        assert asked(gate, Cookie=cookie, Host=host)[0] in (400, 403)
    for origin in ("http://evil.example", "null", f"https://127.0.0.1:{gate.port}"):
        assert asked(gate, Cookie=cookie, Origin=origin)[0] == 403
    for host in ("127.0.0.1", "localhost"):
        good = f"{host}:{gate.port}"
        assert asked(gate, Cookie=cookie, Host=good, Origin=f"http://{good}")[0] == 200


def test_the_socket_asks_for_the_key_too(gate):
    from websockets.exceptions import InvalidStatus
    from websockets.sync.client import connect

    address = f"ws://127.0.0.1:{gate.port}/"
    with pytest.raises(InvalidStatus) as refused:
        connect(address, open_timeout=10)
    assert refused.value.response.status_code == 403
    cookie = {"Cookie": f"fabfold-{gate.port}={gate.token}"}
    with pytest.raises(InvalidStatus):
        connect(address, additional_headers=cookie, origin="http://evil.example")
    with connect(address, additional_headers=cookie, origin=f"http://127.0.0.1:{gate.port}"):
        pass


def test_it_listens_to_this_machine_alone(gate):
    import socket

    own = socket.gethostbyname(socket.gethostname())
    if own.startswith("127."):
        pytest.skip("this machine has no address of its own")
    with pytest.raises(OSError, match=r"refused|unreachable|timed out"):
        socket.create_connection((own, gate.port), timeout=2)


# Steps --------------------------------------------------------------------------------------------


def test_steps_are_kept_undone_and_found_again(kit):
    steps = StudioSteps(set_up_project(str(kit), None, {}))
    first = steps.recipe
    steps.change("larger", voxel_mm=25.0)
    steps.change("a region", protect=(sphere_text(np.array([1.0, 2, 3]), 4.5),))
    assert steps.recipe.protect == ("sphere(1,2,3,4.5)",)
    assert steps.undo()
    assert steps.recipe.voxel_mm == 25.0
    assert steps.recipe.protect == ()
    again = StudioSteps(set_up_project(str(kit), None, {}))
    assert [step.title for step in again.steps] == ["opened", "larger", "a region"]
    assert again.recipe == steps.recipe
    # A recipe that was changed elsewhere is the newest step.
    text = (kit / "kit.toml").read_text(encoding="utf-8")
    (kit / "kit.toml").write_text(text.replace("seed = 1 ", "seed = 7 "), encoding="utf-8")
    elsewhere = StudioSteps(set_up_project(str(kit), None, {}))
    assert elsewhere.recipe.seed == 7
    assert elsewhere.undo()
    assert elsewhere.recipe.voxel_mm == 25.0
    (kit / "kit.toml").write_text(text, encoding="utf-8")
    assert steps.redo()
    assert not steps.redo()
    assert steps.undo()
    assert steps.undo()
    assert not steps.undo()
    assert steps.recipe == first
    steps.change("smaller", voxel_mm=15.0)
    assert [step.title for step in steps.steps] == ["opened", "smaller"]


def test_a_wrong_value_changes_nothing(kit):
    steps = StudioSteps(set_up_project(str(kit), None, {}))
    with pytest.raises(RecipeError, match="voxel_mm"):
        steps.change("nonsense", voxel_mm=-1.0)
    assert len(steps.steps) == 1
    steps.change("nothing", voxel_mm=steps.recipe.voxel_mm)
    assert len(steps.steps) == 1


def test_damaged_steps_are_left_aside(kit):
    steps = StudioSteps(set_up_project(str(kit), None, {}))
    steps.change("larger", voxel_mm=25.0)
    for text in ("", "{", "[]", '{"format": "fabfold-studio", "version": 1, "steps": [{}]}'):
        steps.path.write_text(text, encoding="utf-8")
        again = StudioSteps(set_up_project(str(kit), None, {}))
        assert len(again.steps) == 1
    other = json.dumps({"format": "fabfold-studio", "version": 2, "place": 0, "steps": []})
    steps.path.write_text(other, encoding="utf-8")
    assert len(StudioSteps(set_up_project(str(kit), None, {})).steps) == 1


def test_a_model_gets_a_folder_of_its_name(bar):
    start = with_folder(set_up_project(str(bar), None, {}))
    assert start.folder is not None
    assert start.folder.name == "bar-kit"
    with pytest.raises(ModelError):
        serve("nothing.stl")


@pytest.mark.slow
def test_a_search_that_is_stopped_leaves_its_best(kit):
    with studio(kit) as opened:
        worked(opened)
        page = opened.page
        opened.steps.change("another seed", seed=5)
        page._refresh()
        shown = []
        better = page._show_better

        def first_one(found):
            better(found)
            shown.append(found[1])
            page.tasks.stop()

        page._show_better = first_one
        page.tasks.start("Search", page.search)
        worked(opened)
        assert page.tasks._line.content == "Search: done."
        assert len(shown) >= 1
        best = min(candidate.energy["total"] for candidate in shown)
        tree = opened.steps.kit().fold().tree
        assert tree.energy["total"] <= best + 1e-9
        assert page.fold.motion is not None
        # It goes on from there: bodies are made of that tree.
        page.tasks.start("Bodies", page._build_only)
        worked(opened)
        assert page.fold.motion.certificate["min_gap_mm"] > 0.4
        # Pressed again, it searches on from what was found: to the end this time.
        assert opened.steps.kit().seconds == 0.0
        page._show_better = better
        page.tasks.start("Search", page.search)
        worked(opened)
        assert page.tasks._line.content == "Search: done."
        assert opened.steps.kit().seconds is None
        assert opened.steps.kit().fold().tree.energy["total"] <= tree.energy["total"] + 1e-9


@pytest.mark.slow
def test_forces_of_a_session_are_kept_and_undone(kit):
    steps = StudioSteps(set_up_project(str(kit), None, {}))
    before = steps.kit().fold().motion
    steps.fold_by_forces([Unfold(steps=2000), Match(steps=1500)])
    assert steps.recipe.method == "physics"
    kept = list((kit / "stages" / "actions").glob("session-*.json"))
    assert len(kept) == 1
    assert steps.recipe.actions == kept[0].name
    forced = steps.kit().fold().motion
    assert np.allclose(forced.angles_deg[-1], before.angles_deg[-1])
    assert steps.kit().recipe.to_toml() == (kit / "kit.toml").read_text(encoding="utf-8")
    # The recipe that is now in the kit makes the same again.
    assert open_kit(str(kit)).fold().motion.moves == forced.moves
    assert steps.undo()
    assert steps.kit().fold().motion.moves == before.moves


# What the parts work out --------------------------------------------------------------------------


def box_solid(sides):
    mesh = trimesh.creation.box(sides)
    return Solid("box", np.array(mesh.vertices), np.array(mesh.faces, dtype=np.int32))


def test_cells_of_a_grid_and_their_fill():
    solid = box_solid((4.0, 2.0, 2.0))
    cells, fill = grid_fill(solid, np.eye(3), np.array([0.5, 0.5, 0.5]), 1.0)
    assert len(cells) == 16
    assert np.allclose(fill, 1.0)
    assert cells.min(axis=0).tolist() == [-2, -1, -1]
    # Half a cell aside, the cells at both ends are half full.
    cells, fill = grid_fill(solid, np.eye(3), np.array([0.0, 0.5, 0.5]), 1.0)
    assert len(cells) == 20
    assert sorted(fill.tolist()) == [0.5] * 8 + [1.0] * 12
    turned = rotation_of_degrees((0.0, 0.0, 30.0))
    cells, fill = grid_fill(solid, turned, np.zeros(3), 0.5)
    assert fill.sum() * 0.5**3 == pytest.approx(16.0, rel=0.01)
    assert len(grid_fill(solid, np.eye(3), np.zeros(3), 1e-3)[0]) == 0


@contextmanager
def served():
    gate = Gate()
    server = start_server(gate, 0)
    try:
        yield server
    finally:
        quiet_stop(server)


def test_a_click_meets_the_model_and_the_voxel(bar_kit):
    tree = bar_kit.fold().tree
    with served() as server:
        view = ModelView(server)
        view.show(box_solid((4.0, 2.0, 2.0)), visible=True)
        start = view.to_scene(np.array([1.0, -9.0, 0.5]))
        hit = view.hit(start, np.array([0.0, 1.0, 0.0]))
        assert hit == pytest.approx([1.0, -1.0, 0.5])
        assert view.hit(start, np.array([0.0, -1.0, 0.0])) is None
        assert view.from_scene(view.to_scene(hit)) == pytest.approx(hit)
        scene = KitScene(server)
        scene.show(tree, cube_meshes(tree))
        poses = tree.body_poses(tree.fold_angles)
        scene.pose(tree.fold_angles)
        for body, part in enumerate(tree.bodies):
            for voxel in part.voxels:
                middle = poses[body][:3, :3] @ tree.source[voxel] + poses[body][:3, 3]
                middle = middle - tree.source.mean(axis=0)
                along = np.array([0.3, 0.5, 0.81])
                seen = scene.voxel_at(body, middle - 0.1 * along, along)
                assert seen == voxel
        scene.pick([0])
        assert scene.picked == {0}


def test_the_timeline_stands_between_keyframes(bar_kit):
    motion = bar_kit.fold().motion
    last = len(motion.moves) - 1
    assert np.allclose(angles_at(motion, 0.0), motion.angles_deg[0])
    assert np.allclose(angles_at(motion, float(last)), motion.angles_deg[-1])
    assert np.allclose(angles_at(motion, last + 5.0), motion.angles_deg[-1])
    half = angles_at(motion, 0.5)
    assert np.allclose(half, motion.angles_deg[:2].mean(axis=0))


def test_size_and_printer_are_told_before_anything_is_built():
    small = hinge_outlook(20.0, None, "mjf-pa12", "1.75", 48.0)
    size = hinge_size(20.0, 0.5)
    assert small.barrel_mm == 2 * size.barrel_radius_mm
    assert small.grams == pytest.approx(48 * 8 * 1.01)
    assert small.hours is None
    tight = hinge_outlook(20.0, 0.42, "mjf-pa12", "1.75", 48.0)
    assert tight.shift_mm < small.shift_mm
    assert tight.tilt_deg < small.tilt_deg
    apart = hinge_outlook(20.0, None, "fdm-pla-0.4", "1.75", 48.0)
    assert apart.hours is not None
    assert 5 < apart.hours < 20
    with pytest.raises(RecipeError, match="smallest voxel"):
        hinge_outlook(5.0, None, "mjf-pa12", "1.75", 48.0)


def test_bodies_in_a_text():
    names = ["body-00", "body-01", "link-00"]
    assert bodies_named("body-01 and link-00 touch; body-99 does not", names) == [1, 2]
    assert bodies_named("nothing", names) == []


def test_texts_mean_nothing_to_the_page():
    assert escaped("<b>*x*</b> [a](b)") == "&lt;b&gt;\\*x\\*&lt;/b&gt; \\[a\\](b)"


# The page's work, without a browser ---------------------------------------------------------------


@contextmanager
def studio(source):
    opened = serve(str(source))
    try:
        yield opened
    finally:
        opened.close()


def worked(opened):
    """Do what is in the queue."""
    opened.page.tasks._queue.put(None)
    opened.page.tasks.run()


@pytest.mark.slow
def test_a_kit_opens_with_its_bodies_and_goes_on(kit):
    with studio(kit) as opened:
        worked(opened)
        page = opened.page
        assert page.fold.motion is not None
        assert page.fold.motion.certificate["min_gap_mm"] > 0.4
        page.fold.set_moment(1.5)
        assert page.fold.moment == 1.5
        assert np.allclose(page.scene.angles_deg, angles_at(page.fold.motion, 1.5))
        # A change of the recipe leaves no kit on the page; undo brings it back.
        page.change("painted", protect=("sphere(0,0,0,3)",))
        worked(opened)
        assert page.fold.motion is None
        page._go("undo")
        worked(opened)
        assert page.fold.motion is not None


def test_what_fails_is_said_and_the_page_goes_on(kit):
    with studio(kit) as opened:
        worked(opened)
        page = opened.page

        def fails():
            raise NoFoldError("it does not fold")

        page.tasks.start("Try", fails)
        page.tasks.start("Unfold", page.forces._required)
        worked(opened)
        assert "press Begin first" in page.tasks._line.content
        page.change("nonsense", voxel_mm=-1.0)
        assert "voxel" in page.tasks._line.content
        worked(opened)
        assert page.fold.motion is not None


def test_a_stop_ends_work_at_its_next_word(kit):
    with studio(kit) as opened:
        worked(opened)
        tasks = opened.page.tasks
        told = []

        def long():
            for number in range(5):
                told.append(number)
                if number == 2:
                    tasks.stop()
                tasks.tell(number / 5, "working")

        tasks.start("Long", long)
        worked(opened)
        assert told == [0, 1, 2]
        assert "stopped" in tasks._line.content


def test_a_drag_pulls_and_is_recorded(kit):
    with studio(kit) as opened:
        worked(opened)
        forces = opened.page.forces
        opened.page.tasks.start("Begin", forces._begin)
        worked(opened)
        scene = forces._scenes["A"]
        tree = scene.tree
        body = len(tree.bodies) - 1
        voxel = tree.bodies[body].voxels[-1]
        start = tree.source[voxel] - tree.source.mean(axis=0) + scene.shift + [0.1, 0.2, 0.0]
        assert scene.nearest_voxel(body, start) == voxel
        dragged = forces._dragged("A")
        dragged(body, start, start + np.array([0.0, 1.0, 0.5]), False)
        forces._take_drag(forces.unfolding)
        forces.unfolding.do(Wait(steps=50))
        dragged(body, start, start + np.array([0.0, 100.0, 0.0]), False)
        forces._take_drag(forces.unfolding)
        dragged(body, start, start, True)
        worked(opened)
        forces._take_drag(forces.unfolding)
        actions = forces.unfolding.actions
        pushes = [action for action in actions if action.do == "push"]
        assert [push.voxel for push in pushes] == [voxel] * 3
        assert pushes[0].force == (0.0, 40.0, 20.0)
        assert pushes[1].force == (0.0, 250.0, 0.0)
        assert pushes[2].force == (0.0, 0.0, 0.0)


@pytest.mark.slow
def test_forces_from_the_page_make_the_kits_path(kit):
    with studio(kit) as opened:
        worked(opened)
        page = opened.page
        page.tasks.start("Begin", page.forces._begin)
        page.forces._force("unfold")
        worked(opened)
        page.forces.choose("A", 0)
        page.forces._help("pin")
        page.forces._help("carve")
        worked(opened)
        assert [a.do for a in page.forces.unfolding.actions] == ["unfold", "pin", "carve"]
        page.tasks.start("Undo", page.forces._undo)
        page.tasks.start("Undo", page.forces._undo)
        worked(opened)
        page.forces._force("match")
        worked(opened)
        assert [a.do for a in page.forces.unfolding.actions] == ["unfold", "match"]
        assert page.forces.unfolding.met
        page.tasks.start("Use", page.forces._take)
        worked(opened)
        assert page.tasks._line.content == "Use: done."
        assert opened.steps.recipe.method == "physics"
        assert page.fold.motion is not None
        assert [turned.do for turned in page.forces.unfolding.actions] == ["unfold", "match"]
