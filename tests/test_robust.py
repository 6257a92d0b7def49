"""Faults of the file system, foreign files and refused input, as a user meets them."""

import errno
import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from fabfold.cli.app import app
from fabfold.errors import RecipeError, system_message
from fabfold.kit.kit import open_kit
from fabfold.version import __version__

ROOT = Path(__file__).parents[1]
TRAP = "open('TRAPPED', 'w').write('this file was executed')\nraise SystemExit\n"


def fabfold(*arguments, cwd):
    """Run the command as installed: the working folder is not among the places of modules."""
    code = "import sys; from fabfold.cli.app import main; main(sys.argv[1:])"
    return subprocess.run(
        [sys.executable, "-P", "-c", code, *map(str, arguments)],
        cwd=cwd,
        capture_output=True,
        encoding="utf-8",
        check=False,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )


def run_script(code, folder):
    """Run a script of Python in a folder, with the checkout among the places of modules."""
    return subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        encoding="utf-8",
        check=False,
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )


def command(*arguments):
    """The same command in this process, where it is not the process that matters."""
    return CliRunner().invoke(app, [*map(str, arguments)], catch_exceptions=False)


def contents(folder):
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def arguments_of(options):
    return [text for key, value in options.items() for text in (f"--{key}", str(value))]


@pytest.mark.slow
def test_files_in_the_working_folder_are_not_executed(bar_options, tmp_path):
    import build123d as bd

    for name in ("numpy", "random", "pickle", "types", "socket", "multiprocessing", "numba"):
        (tmp_path / f"{name}.py").write_text(TRAP)
    bd.export_step(bd.Box(40, 9.6, 9.6), tmp_path / "part.step")
    more = arguments_of({**bar_options, "template": "box-2x2x1"})
    found = fabfold("export", "part.step", "-o", "kit", "-j", "2", *more, "-q", cwd=tmp_path)
    assert found.returncode == 0, found.stderr
    assert (tmp_path / "kit" / "report.json").is_file()
    assert not (tmp_path / "TRAPPED").exists()


@pytest.mark.slow
def test_a_refused_model_changes_nothing(bar_kit, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    kit = tmp_path / "kit"
    shutil.copytree(bar_kit.folder, kit)
    before = contents(kit)
    (tmp_path / "empty.stl").write_bytes(b"")
    for source, more, code in (
        (tmp_path / "empty.stl", [], 2),
        (kit, ["--pitch", "1e9"], 3),
        (kit, ["--profile", "nope"], 2),
        (kit, ["--voxel-mm", "3"], 2),
        (kit, ["--clearance-mm", "0.1"], 2),
    ):
        result = command("voxelize", source, "-o", kit, "-q", *more)
        assert result.exit_code == code, result.stderr
        assert contents(kit) == before, (source, more)
    fresh = command("export", "empty.stl", "-q")
    assert fresh.exit_code == 2
    assert sorted(path.name for path in tmp_path.iterdir() if path.is_dir()) == ["kit"]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"profile": "nope"}, "nope"),
        ({"clearance_mm": 0.1}, "asks for gaps of 0.4 mm"),
        ({"voxel_mm": 3.0}, "smallest voxel for this clearance is 17 mm"),
        ({"clearance_mm": 5.0}, "no hinge fits"),
    ],
)
def test_what_cannot_be_printed_is_refused_before_the_search(bar, bar_options, options, words):
    with pytest.raises(RecipeError, match=words):
        open_kit(str(bar), **{**bar_options, **options}).voxelize()


@pytest.mark.slow
def test_a_kit_of_another_name_leaves_nothing_behind(bar_kit, bar, bar_options, tmp_path):
    kit = tmp_path / "kit"
    shutil.copytree(bar_kit.folder, kit)
    mine = kit / "mine.3mf"
    mine.write_text("not a file of fabfold")
    first = {path.name for path in kit.iterdir()}
    other = tmp_path / "other.stl"
    other.write_bytes(bar.read_bytes())
    open_kit(str(other), folder=kit, workers=1, **bar_options).export()
    second = {path.name for path in kit.iterdir()}
    assert {name for name in first if name.startswith("bar")}
    assert {
        name.replace("bar", "other", 1) if name.startswith("bar") else name for name in first
    } == second
    assert mine.read_text() == "not a file of fabfold"


@pytest.mark.slow
def test_exporting_again_gives_the_same_bytes(bar_kit, tmp_path):
    def files(folder):
        return {n: data for n, data in contents(folder).items() if not n.startswith("stages")}

    open_kit(str(bar_kit.folder), workers=1).export(tmp_path / "twice")
    assert files(tmp_path / "twice") == files(bar_kit.folder)


@pytest.mark.slow
def test_errors_of_the_file_system_are_one_sentence(bar, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("")
    for arguments in (
        ("voxelize", "a" * 300 + ".stl"),
        ("voxelize", bar, "-o", "file/kit"),
        ("voxelize", bar, "-o", "k" * 300),
        ("voxelize", bar, "-o", "/proc/kit"),
        ("calibrate", "--turns-freely", "0.3", "-o", tmp_path),
        ("coupon", "-o", "/proc/coupon.3mf"),
    ):
        result = command(*arguments)
        assert result.exit_code == 2, (arguments, result.stderr)
        assert "Traceback" not in result.stderr
        assert result.stderr.strip().splitlines()[-1].startswith("fabfold: ")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full on this system")
def test_an_output_that_cannot_be_written_is_told(tmp_path):
    code = "import sys; from fabfold.cli.app import main; main(sys.argv[1:])"
    with Path("/dev/full").open("w") as full:
        result = subprocess.run(
            [sys.executable, "-c", code, "list", "samples"],
            stdout=full,
            stderr=subprocess.PIPE,
            encoding="utf-8",
            check=False,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
        )
    assert result.returncode == 2
    assert result.stderr.startswith("fabfold: ")
    assert "disk is full" in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1


def test_a_terminal_that_knows_ascii_only_is_no_matter(tmp_path):
    code = "import sys; from fabfold.cli.app import main; main(sys.argv[1:])"
    result = subprocess.run(
        [sys.executable, "-c", code, "list", "templates"],
        capture_output=True,
        check=False,
        env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONIOENCODING": "ascii"},
    )
    assert result.returncode == 0, result.stderr
    assert b"box-AxBxC" in result.stdout


def test_a_system_message_says_where_what_and_what_to_do():
    error = OSError(errno.ENOSPC, "No space left on device", "kit/tree.json")
    assert system_message(error).startswith(
        "kit/tree.json: No space left on device: the disk is full"
    )
    assert system_message(OSError("odd")) == "odd"


@pytest.mark.slow
def test_a_damaged_journal_is_told(bar, bar_options, tmp_path):
    kit = tmp_path / "kit"
    open_kit(str(bar), folder=kit, **bar_options).run("voxelize")
    journal = kit / "stages" / "journal.json"
    whole = journal.read_text("utf-8")
    journal.write_text(whole[:200], "utf-8")
    result = command("voxelize", kit, "-q")
    assert result.exit_code == 0, result.stderr
    assert "note: " in result.stdout
    assert "journal.json was damaged" in result.stdout
    assert json.loads(journal.read_text("utf-8")) == json.loads(whole)


def test_a_kit_of_another_version_is_not_used_without_a_word(bar_kit, tmp_path):
    shutil.copytree(bar_kit.folder, tmp_path / "kit")
    path = tmp_path / "kit" / "kit.toml"
    path.write_text(path.read_text("utf-8").replace(f'"{__version__}"', '"0.0.9"', 1), "utf-8")
    assert "made by fabfold 0.0.9" in open_kit(str(tmp_path / "kit")).damage
    assert open_kit(str(bar_kit.folder)).damage == ""


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
def test_a_stopped_run_ends_with_130_wherever_it_was(name, tmp_path):
    # Inside an exec of a string, where Python would end by the signal itself.
    code = f"""
import os, signal
signal.signal(signal.SIGINT, signal.default_int_handler)
from fabfold.cli.app import _guarded, app, main
def hang():
    exec("os.kill(os.getpid(), signal.{name})\\nfor _ in range(10**9): pass")
app.command("hang")(_guarded(hang))
main(["hang"])
"""
    result = run_script(code, tmp_path)
    assert result.returncode == 130, result.stderr
    assert "goes on from there" in result.stderr


def test_a_stop_that_a_library_makes_an_error_of_is_a_stop(tmp_path):
    code = """
import os, signal
from fabfold.cli.app import _guarded, app, main
def wrap():
    try:
        os.kill(os.getpid(), signal.SIGTERM)
        for _ in range(10**9): pass
    except BaseException as error:
        raise RuntimeError("lost on the way") from error
app.command("wrap")(_guarded(wrap))
main(["wrap"])
"""
    result = run_script(code, tmp_path)
    assert result.returncode == 130, result.stderr
    assert "goes on from there" in result.stderr and "Traceback" not in result.stderr


def test_threads_that_wait_do_not_hold_the_studio_after_its_end():
    script = """
import threading, time
from fabfold.cli import stopping
stopping._LONGEST_END_S = 0.5
stopping.hear_stops()
stopping.hear_stops(surely=True)
threading.Thread(target=time.sleep, args=(60,)).start()
print("up", flush=True)
try:
    time.sleep(60)
except KeyboardInterrupt:
    time.sleep(60)
"""
    run = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    assert run.stdout is not None and run.stdout.readline() == "up\n"
    run.send_signal(signal.SIGTERM)
    assert run.wait(timeout=30) == 130
