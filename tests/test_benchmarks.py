"""The commands that print the figures of the documentation run."""

import ast
import importlib
import json
import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[1] / "benchmarks"


def run(name, *arguments):
    """Run a benchmark to its end; what it printed."""
    done = subprocess.run(
        [sys.executable, str(FOLDER / name), *map(str, arguments)],
        check=False,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.py")), ids=lambda path: path.stem)
def test_a_benchmark_imports_what_is_there(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if not isinstance(node, ast.ImportFrom) or not node.module:
            continue
        if node.module.partition(".")[0] not in ("fabfold", "hinges"):
            continue
        module = importlib.import_module(node.module)
        for alias in node.names:
            if not hasattr(module, alias.name):
                importlib.import_module(f"{node.module}.{alias.name}")


@pytest.mark.slow
def test_growth_tells_when_a_small_box_folds(tmp_path):
    page = tmp_path / "growth.md"
    run("growth.py", "--sides", 3, "--budget", 20, "--workers", 1, "--out", page)
    (row,) = json.loads(page.with_suffix(".json").read_text("utf-8"))["rows"]
    assert max(row["voxelize"]["voxels"]) <= 27
    assert row["tree"]["hinges"] > 0 and row["tree"]["moves"] >= row["tree"]["hinges"]
    assert "| 27 |" in page.read_text(encoding="utf-8")


@pytest.mark.slow
def test_ablation_compares_variants_of_the_search(tmp_path):
    page = tmp_path / "ablation.md"
    parts = ("several sizes", "no guide", "breadth first")
    run(
        "ablation.py", "--models", "sample car", "--seeds", 1, "--seconds", 3, "--parts", *parts,
        "--work", tmp_path, "--out", page,
    )  # fmt: skip
    (by_part,) = json.loads(page.with_suffix(".json").read_text("utf-8"))["runs"].values()
    assert set(by_part) == set(parts)
    assert by_part["several sizes"][0]["events"]  # something folds
    assert by_part["breadth first"][0]["roots"] == 20


@pytest.mark.slow
def test_every_solid_counts_what_becomes_a_kit(tmp_path):
    page = tmp_path / "every.md"
    run("every_solid.py", "sample car", "--seeds", 1, "--workers", 1, "--out", page)
    row = json.loads(page.with_suffix(".json").read_text("utf-8"))["rows"]["sample car"]["1"]
    assert row["failed"] == [] and row["gap_mm"] >= 0.3
    assert row["closed"] <= row["at_most"]
    assert "| sample car | box-3x4x4 | 1 of 1 |" in page.read_text(encoding="utf-8")


@pytest.mark.slow
def test_energies_measures_one_search():
    row = json.loads(run("energies.py", "--effort", "quick", "--one", "sample:car", "box-3x4x4"))
    assert row["energy"] == row["curve"][-1][1]
    assert row["closed"] <= row["at_most"] and row["search_s"] > 0


def test_of_two_runs_that_make_the_same_kit_the_faster_is_shown(monkeypatch):
    monkeypatch.syspath_prepend(str(FOLDER))
    kept = importlib.import_module("paper_table")._kept
    fast = {"code": "a", "search": 2, "exit": 0, "verify": "passes", "cpu": 70.0}
    fast["summary"] = {"bodies": 20}
    slow = {**fast, "cpu": 90.0}
    assert kept(None, slow) is slow
    assert kept(fast, slow) == fast
    assert kept(slow, fast) == fast
    # Other code, another kit, or one that fails, is shown however long it takes.
    others = [{"summary": {"bodies": 21}}, {"exit": 1}, {"verify": "died"}, {"search": 3}]
    for other in (*others, {"code": "b"}):
        assert kept(fast, {**slow, **other}) == {**slow, **other}
    # The comparison with 0.1 is a run of its own, and the last one counts.
    assert kept({**fast, "before": {"cpu": 1.0}}, slow) == {**fast, "before": {"cpu": 1.0}}
    assert kept(fast, {**slow, "before": {"cpu": 2.0}}) == {**fast, "before": {"cpu": 2.0}}
