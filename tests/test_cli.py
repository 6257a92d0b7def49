"""The command line as a user meets it: exit codes, sentences, quickness."""

import shutil
import subprocess
import sys

import pytest
from typer.testing import CliRunner

from fabfold.cli.app import app

HEAVY = (
    "build123d",
    "cadquery",
    "OCP",
    "mujoco",
    "pymeshlab",
    "trimesh",
    "numba",
    "scipy",
    "lib3mf",
)


@pytest.fixture
def fabfold(tmp_path, monkeypatch):
    """Runs a command in an empty folder; what escapes from it fails the test."""
    monkeypatch.chdir(tmp_path)
    return lambda *arguments: CliRunner().invoke(app, arguments, catch_exceptions=False)


def test_help_imports_no_cad_package():
    code = (
        "import sys\n"
        "from fabfold.cli.app import main\n"
        "try:\n    main(['--help'])\n"
        "except SystemExit as stop:\n    assert not stop.code\n"
        f"loaded = sorted(set(sys.modules) & set({HEAVY!r}))\n"
        "print('LOADED', loaded, file=sys.stderr)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, encoding="utf-8", check=True
    )
    assert "export" in done.stdout
    assert "LOADED []" in done.stderr


def test_as_a_module_it_ends_with_the_code_and_the_sentence_of_the_error(tmp_path):
    command = [sys.executable, "-m", "fabfold", "export", "gone.stl"]
    done = subprocess.run(command, capture_output=True, encoding="utf-8", cwd=tmp_path, check=False)
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert "gone.stl" in done.stderr


def test_every_stage_is_a_command(fabfold):
    text = fabfold("--help").stdout
    for command in ("voxelize", "fit", "fold", "join", "check", "export", "list"):
        assert f"  {command} " in text


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["export", "gone.stl"], ["gone.stl", "no such file"]),
        (["export", "sample:unicorn"], ["unicorn", "car"]),
        (["export", "sample:car", "--template", "pyramid"], ["pyramid", "box-AxBxC"]),
        (["export", "sample:car", "--voxel-mm", "-3"], ["voxel_mm"]),
        (["export", "sample:car", "--rotation", "1,2"], ["rotation", "three numbers"]),
        (
            ["export", "sample:car", "-t", "nope", "--voxel-mm=-1", "--origin", "x"],
            ["nope", "voxel_mm", "origin", "three numbers"],
        ),
        (["export", "sample:car", "--effort", "heroic"], ["effort", "thorough"]),
        (["export", "sample:car", "--profile", "clay"], ["clay"]),
        (["export", "."], ["kit.toml"]),
        (["list", "dragons"], ["dragons", "samples"]),
        (["expor"], ["expor"]),
    ],
)
def test_bad_usage_is_one_sentence_and_exit_code_2(fabfold, tmp_path, arguments, words):
    done = fabfold(*arguments)
    assert done.exit_code == 2, done.stderr
    for word in words:
        assert word in done.stderr
    assert not list(tmp_path.rglob("*.json")), "nothing is half written"


def test_a_broken_model_is_refused_with_exit_code_2(fabfold, tmp_path):
    (tmp_path / "broken.stl").write_bytes(b"")
    done = fabfold("export", "broken.stl")
    assert done.exit_code == 2
    assert "broken.stl" in done.stderr


def test_a_folder_with_other_things_is_left_alone(fabfold, tmp_path):
    (tmp_path / "photos").mkdir()
    (tmp_path / "photos" / "cat.jpg").write_text("meow")
    done = fabfold("export", "sample:car", "-o", "photos")
    assert done.exit_code == 2
    assert "photos" in done.stderr
    assert [p.name for p in (tmp_path / "photos").iterdir()] == ["cat.jpg"]


@pytest.mark.parametrize("what", ["samples", "templates", "profiles"])
def test_lists(fabfold, what):
    done = fabfold("list", what)
    assert done.exit_code == 0, done.stderr
    assert {"samples": "sample:car", "templates": "box-AxBxC", "profiles": "mjf-pa12"}[what] in (
        done.stdout
    )


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--scheduler", "localhost"], ["--scheduler", "tcp://host:8786", "localhost"]),
        (["--workers", "0"], ["--workers 0"]),
        (["--time", "-1"], ["--time"]),
        (["--time", "soon"], ["--time", "number"]),
    ],
)
def test_wrong_ways_to_run_the_search_are_one_sentence_and_exit_code_2(
    fabfold, bar, tmp_path, options, words
):
    shutil.copy(bar, tmp_path)
    done = fabfold("fit", "bar.stl", "-t", "box-2x2x2", *options)
    assert done.exit_code == 2, done.stderr
    for word in words:
        assert word in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["bar.stl"], "nothing is half written"


def test_the_size_of_the_box_sets_the_voxel(tmp_path):
    from fabfold.errors import RecipeError
    from fabfold.kit.kit import open_kit

    assert open_kit("sample:car", box_mm=60.0).recipe.voxel_mm == 15.0
    assert open_kit("sample:car", scale=0.75).recipe.voxel_mm == 15.0
    for wrong in ({"box_mm": 0.0}, {"scale": -1.0}, {"box_mm": 60.0, "scale": 2.0}):
        with pytest.raises(RecipeError, match="--"):
            open_kit("sample:car", **wrong)
    with pytest.raises(RecipeError, match="--voxel-mm sets the size too"):
        open_kit("sample:car", voxel_mm=20.0, box_mm=60.0)
