"""The examples run as a reader runs them, and what they write is what they say."""

import contextlib
import io
import json
import os
import re
import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from fabfold import Motion, load_profile, load_template, read_recipe, sample_names

ROOT = Path(__file__).parents[1]
EXAMPLES = sorted((ROOT / "examples").glob("[0-9]*.py"))


#: What takes long in an example, and what stands in for it here: smaller boxes, plain blocks, no
#: processes for searches that are over before those have started, and in two of them bodies and
#: checks in place of all files.
STAND_INS = {
    "01_fold_a_sample": {
        '"sample:car", effort="quick"': (
            '"sample:car", template="box-2x2x1", skin="lattice", effort="quick"'
        ),
        "seed=1": "seed=1, workers=1",
    },
    "02_own_model": {'effort="quick"': 'effort="quick", workers=1'},
    "03_own_template": {
        'effort="quick"': 'effort="quick", workers=1',
        "kit.export()": 'kit.run("check")',
    },
    "04_own_printer": {
        'effort="quick"': 'effort="quick", workers=1',
        "kit.export()": 'kit.run("check")',
    },
    "06_seeds_on_a_cluster": {
        "(90.0, 20.0, 20.0)": "(40.0, 20.0, 10.0)",
        "(0, 5, 5)": "(5, 5, 0)",
        "box-3x3x4": "box-2x2x2",
    },
}


def script(name, cwd):
    """The text of an example with its stand-ins, in the folder that it is run in."""
    text = (ROOT / "examples" / f"{name}.py").read_text(encoding="utf-8")
    for original, stand_in in STAND_INS.get(name, {}).items():
        assert text.count(original) == 1, original
        text = text.replace(original, stand_in)
    path = cwd / f"{name}.py"
    path.write_text(text, encoding="utf-8")
    return path


def run(name, *arguments, cwd, code=0):
    """What an example says that a reader runs in a folder."""
    result = subprocess.run(
        [sys.executable, script(name, cwd), *map(str, arguments)],
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONIOENCODING": "utf-8"},
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    assert result.returncode == code, result.stderr
    return result.stdout + result.stderr


def run_here(name, *arguments, cwd):
    """The same in this process, for examples that start no others that would read it again."""
    said = io.StringIO()
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(said):
        patch.chdir(cwd)
        patch.setattr(sys, "argv", [name, *map(str, arguments)])
        runpy.run_path(str(script(name, cwd)), run_name="__main__")
    return said.getvalue()


def read(path):
    return json.loads(path.read_text(encoding="utf-8"))


def check_kit(folder):
    """What holds of every kit: it fits its template, and all its checks pass."""
    tree, motion = read(folder / "tree.json"), read(folder / "motion.json")
    assert len(list((folder / "bodies").glob("*.stl"))) == len(tree["bodies"])
    assert len(tree["bodies"]) == len(tree["hinges"]) + 1
    cells = {tuple(cell) for cell in tree["template"]["cells"]}
    assert {tuple(cell) for cell in tree["target"]} <= cells
    assert read(folder / "report.json")["verdict"] == "ok"
    assert motion["certificate"]["min_gap_mm"] > 0.0
    return tree, motion


@pytest.fixture(scope="module")
def car(tmp_path_factory):
    """Folder that example 01 was run in, and what it said."""
    home = tmp_path_factory.mktemp("car")
    return home, run("01_fold_a_sample", cwd=home)


def test_examples_are_numbered_and_all_in_the_table():
    assert [path.name[:2] for path in EXAMPLES] == [f"{i:02d}" for i in range(1, len(EXAMPLES) + 1)]
    table = (ROOT / "examples" / "README.md").read_text(encoding="utf-8")
    assert re.findall(r"\]\((\d\d_\w+\.py)\)", table) == [path.name for path in EXAMPLES]


@pytest.mark.slow
def test_01_folds_a_sample(car):
    home, said = car
    tree, motion = check_kit(home / "car-kit")
    assert tree["template"]["name"] == "box-2x2x1"
    assert f"{len(tree['bodies'])} bodies hang on {len(tree['hinges'])} hinges" in said
    assert f"It folds in {len(motion['keyframes']) - 1} moves" in said
    assert (home / "car-kit" / "car.3mf").is_file()


@pytest.mark.slow
def test_05_reads_a_kit_without_fabfold(car):
    home, _ = car
    source = (ROOT / "examples" / "05_read_a_kit.py").read_text(encoding="utf-8")
    assert "import fabfold" not in source
    assert "from fabfold" not in source
    said = run("05_read_a_kit", home / "car-kit", cwd=home).splitlines()
    frames = read(home / "car-kit" / "motion.json")["keyframes"]
    assert len(said) == len(frames) + 2
    sizes = [
        tuple(map(int, re.findall(r"(\d+) x (\d+) x (\d+) mm", line)[0])) for line in said[:-2]
    ]
    assert sizes[-1] == (40, 40, 20)
    assert sizes[0] != sizes[-1]
    assert "voxels end in their cells of box-2x2x1" in said[-1]


@pytest.mark.slow
def test_05_finds_a_voxel_that_ends_elsewhere(car, tmp_path):
    kit = car[0] / "car-kit"
    tree = read(kit / "tree.json")
    tree["target"][3][0] += 1
    (tmp_path / "tree.json").write_text(json.dumps(tree), encoding="utf-8")
    (tmp_path / "motion.json").write_bytes((kit / "motion.json").read_bytes())
    said = run("05_read_a_kit", tmp_path, cwd=tmp_path, code=1)
    assert "is 1.0e+00 voxel sides away" in said
    assert "does not fold into its template" in said


@pytest.mark.slow
def test_02_cuts_a_model_by_hand(tmp_path):
    said = run_here("02_own_model", cwd=tmp_path)
    tree, _ = check_kit(tmp_path / "robot-kit")
    assert "The robot is 16 voxels, 100% full." in said
    head = max(tree["source"], key=lambda cell: cell[2])
    assert head[2] == 4
    assert len(tree["target"]) == 16
    recipe = read_recipe(tmp_path / "robot-kit" / "kit.toml")
    assert (recipe.rotation, recipe.pitch) == ((0.0, 0.0, -30.0), 10.0)


@pytest.mark.slow
def test_03_folds_into_a_template_from_a_file(tmp_path):
    run_here("03_own_template", cwd=tmp_path)
    tree, _ = check_kit(tmp_path / "stairs-kit")
    stairs = load_template(str(tmp_path / "stairs.toml"))
    heights = np.zeros(stairs.shape[:2], int)
    for i, j, _ in stairs.cells:
        heights[i, j] += 1
    assert heights.tolist() == [[3, 3], [2, 2], [1, 1]]
    assert sorted(map(tuple, tree["target"])) == sorted(map(tuple, stairs.cells.tolist()))
    assert np.ptp(tree["source"], axis=0).tolist() == [11, 0, 0]


@pytest.mark.slow
def test_04_calibrates_a_printer(tmp_path):
    said = run_here("04_own_printer", cwd=tmp_path)
    home = tmp_path / "my-printer"
    profile = load_profile(str(home / "my-printer.toml"))
    assert (profile.clearance_mm, profile.min_gap_mm) == (0.4, 0.35)
    assert "clearance_mm = 0.4" in said
    check_kit(home / "bar-kit")
    motion = Motion.from_json(read(home / "bar-kit" / "motion.json"))
    assert motion.certificate["min_gap_mm"] >= 0.35
    assert (home / "coupon.3mf").is_file()


@pytest.mark.slow
def test_06_takes_the_best_of_several_seeds(tmp_path):
    said = run("06_seeds_on_a_cluster", cwd=tmp_path)
    found = {
        int(seed): float(energy) for seed, energy in re.findall(r"seed (\d): .* energy (.*)", said)
    }
    assert len(found) == 2
    (kit,) = (tmp_path / "seeds").glob("beam-kit-*")
    assert found[int(kit.name[-1])] == min(found.values())
    tree, _ = check_kit(kit)
    assert tree["energy"]["total"] == pytest.approx(min(found.values()), abs=0.0005)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["07_lidded_box_build123d", "09_phone_stand_build123d"])
def test_hinge_examples_write_step(name, tmp_path):
    run_here(name, "out", cwd=tmp_path)
    (path,) = (tmp_path / "out").iterdir()
    assert path.suffix == ".step"


def test_the_gallery_has_recipe_pictures_and_figures_of_six_kits():
    places = sorted((ROOT / "prints" / "gallery").iterdir())
    recipes = {place.name: read_recipe(place / "kit.toml") for place in places}
    assert len(recipes) == 6
    assert {recipe.model for recipe in recipes.values()} == {f"sample:{s}" for s in sample_names()}
    page = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
    ways = set()
    for place, recipe in zip(places, recipes.values(), strict=True):
        told = json.loads((place / "figures.json").read_text(encoding="utf-8"))
        part = page.split(f"## {place.name}\n")[1].split("##")[0]
        assert f"folds into {recipe.template} in {told['moves']} moves" in part
        assert f"(../prints/gallery/{place.name}/plates.png)" in part
        assert f"`{recipe.profile}`" in part
        assert told["checks_passed"][0] == told["checks_passed"][1]
        assert (place / "plates.png").stat().st_size < 300_000
        assert {path.name for path in place.iterdir()} == {"kit.toml", "plates.png", "figures.json"}
        ways.add(told["print"])
        if recipe.model == f"sample:{place.name}":
            assert f"(pictures/{place.name}.png)" in part
            assert (ROOT / "docs" / "pictures" / f"{place.name}.png").is_file()
    assert ways == {"in-place", "apart"}
