"""Faults while a kit is made, or after: the next run ends as an undisturbed one does."""

from __future__ import annotations

import itertools
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from test_robust import arguments_of, command, contents, fabfold

from fabfold.kit.kit import Kit, open_kit

pytestmark = pytest.mark.slow


def cut_off(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def flipped(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 16
    path.write_bytes(data)


def assert_same(folder: Path, wanted: Path) -> None:
    found, want = contents(folder), contents(wanted)
    assert sorted(found) == sorted(want)
    assert [name for name in want if found[name] != want[name]] == []


@pytest.mark.parametrize("fault", [cut_off, flipped, Path.unlink], ids=lambda fault: fault.__name__)
def test_stage_files_that_are_damaged_are_made_again(
    fault: Any, bar_kit: Kit, tmp_path: Path
) -> None:
    """One file of the search, one of the bodies and one that is delivered, each in the same way."""
    folder = tmp_path / "kit"
    shutil.copytree(bar_kit.folder, folder)
    for name in ("stages/fold.json", "stages/made-bodies.npz", "bar.3mf"):
        fault(folder / name)
    open_kit(str(folder), workers=1).export()
    assert_same(folder, bar_kit.folder)


def test_a_kit_that_was_moved_goes_on(bar_kit: Kit, tmp_path: Path) -> None:
    shutil.copytree(bar_kit.folder, tmp_path / "one")
    (tmp_path / "far" / "away").mkdir(parents=True)
    (tmp_path / "one").rename(tmp_path / "far" / "away" / "two")
    folder = tmp_path / "far" / "away" / "two"
    (folder / "fold.glb").unlink()
    done = command("export", folder, "-q")
    assert done.exit_code == 0, done.stderr
    assert_same(folder, bar_kit.folder)


def test_a_clock_that_jumps_and_another_number_of_workers_do_not_matter(
    bar_kit: Kit, tmp_path: Path, monkeypatch: Any
) -> None:
    jumps = itertools.cycle([0.0, -86_400.0, 86_400.0 * 365])
    real = time.time
    monkeypatch.setattr(time, "time", lambda: real() + next(jumps))
    open_kit(str(bar_kit.folder / "kit.toml"), folder=tmp_path / "kit", workers=2).export()
    assert_same(tmp_path / "kit", bar_kit.folder)


def test_two_runs_in_one_folder_do_not_mix(
    bar: Path, bar_options: dict[str, Any], bar_kit: Kit, tmp_path: Path
) -> None:
    call = [
        "fold",
        str(bar),
        "-o",
        str(tmp_path / "kit"),
        "-j",
        "1",
        *arguments_of(bar_options),
    ]
    first = subprocess.Popen(
        [sys.executable, "-m", "fabfold", *call], stderr=subprocess.PIPE, encoding="utf-8"
    )
    while not (tmp_path / "kit" / "stages").is_dir():
        assert first.poll() is None, first.stderr.read()
        time.sleep(0.05)
    second = fabfold(*call, cwd=tmp_path)
    assert first.poll() is None, "the first run was over too soon for this test"
    assert second.returncode == 2
    assert "another run is at work in this folder" in second.stderr
    _, said = first.communicate()
    assert first.returncode == 0, said
    found, want = contents(tmp_path / "kit" / "stages"), contents(bar_kit.folder / "stages")
    assert "fold.json" in found
    assert [name for name in found if name != "journal.json" and found[name] != want[name]] == []


@contextmanager
def small_disk(folder: Path, size: str) -> Iterator[None]:
    """A file system of that size at `folder`; only root may have one."""
    folder.mkdir()
    done = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(folder)],
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        pytest.skip(f"no small disk can be made here: {done.stderr.strip()}")
    try:
        yield
    finally:
        subprocess.run(["umount", str(folder)], check=True)


@pytest.mark.skipif(sys.platform != "linux" or os.getuid() != 0, reason="needs root on Linux")
@pytest.mark.parametrize("share", [0.1, 0.9])
def test_a_full_disk_is_told_and_made_good(
    share: float,
    bar: Path,
    bar_options: dict[str, Any],
    bar_kit: Kit,
    searched: Callable[[Path], Path],
    tmp_path: Path,
) -> None:
    """It is full while the search writes its first files, or while the last ones are delivered."""
    disk = tmp_path / "disk"
    call = ["export", str(bar), "-o", str(disk / "kit"), "-q", "-j", "1"]
    whole = sum(len(data) for data in contents(bar_kit.folder).values())
    with small_disk(disk, f"{int(share * whole / 1024)}k"):
        if share > 0.5:
            searched(disk / "kit")
        done = fabfold(*call, *arguments_of(bar_options), cwd=tmp_path)
        assert done.returncode == 2, done.stderr
        assert "the disk is full" in done.stderr
        assert len(done.stderr.strip().splitlines()) == 1, done.stderr
        assert not list(disk.rglob(".part-*"))
        subprocess.run(["mount", "-o", "remount,size=100m", str(disk)], check=True)
        done = command(*call, *arguments_of(bar_options))
        assert done.exit_code == 0, done.stderr
        assert_same(disk / "kit", bar_kit.folder)


@pytest.mark.skipif(sys.platform != "linux" or os.getuid() != 0, reason="needs root on Linux")
def test_a_place_that_can_only_be_read_is_told(bar: Path, bar_kit: Kit, tmp_path: Path) -> None:
    disk = tmp_path / "disk"
    with small_disk(disk, "100m"):
        shutil.copytree(bar_kit.folder, disk / "kit")
        before = contents(disk)
        subprocess.run(["mount", "-o", "remount,ro", str(disk)], check=True)
        done = command("export", disk / "kit", "--voxel-mm", 30, "-q")
        assert done.exit_code == 2, done.stderr
        assert "can only be read" in done.stderr
        done = command("check", disk / "kit")
        assert done.exit_code == 0, done.stderr
        assert contents(disk) == before
