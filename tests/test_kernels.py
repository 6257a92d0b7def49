"""Kernels are compiled once, by processes of their own, and never where they are there."""

import os
import shutil

import pytest
from numba.core import config

from fabfold.fold.shortcut import shorten
from fabfold.progress import SilentProgress
from fabfold.proof.bvh import build_tree
from fabfold.proof.gap import prove_pairs
from fabfold.search import kernels
from fabfold.search.kernels import (
    HALVES,
    KernelCompiler,
    compile_half,
    forget_stale_kernels,
    kernel_stamp,
)
from fabfold.tree.large_neighbourhood import repair
from fabfold.tree.leaf_assignment import reassign_leaves


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path))
    return tmp_path


def compile_with(program, monkeypatch):
    monkeypatch.setattr(kernels.sys, "executable", shutil.which(program))
    compiler = KernelCompiler()
    compiler.start()
    started = len(compiler._running)
    compiler.wait(SilentProgress())
    assert compiler._running == []
    return started


def test_what_is_compiled_is_not_compiled_again(cache, monkeypatch):
    assert kernel_stamp().parent == cache
    assert compile_with("true", monkeypatch) == len(HALVES)
    assert kernel_stamp().exists()
    assert compile_with("true", monkeypatch) == 0


def test_a_process_that_fails_leaves_no_stamp(cache, monkeypatch):
    assert compile_with("false", monkeypatch) == len(HALVES)
    assert list(cache.iterdir()) == []


def test_another_source_wants_kernels_of_its_own(cache, monkeypatch, tmp_path):
    before = kernel_stamp()
    monkeypatch.setattr(kernels, "_PACKAGES", ("tree",))
    assert kernel_stamp() != before


def test_kernels_that_are_older_than_a_source_are_forgotten(tmp_path):
    written = {
        "lattice/segments.py": 300,
        "lattice/sweep.py": 100,
        "lattice/__pycache__/sweep.fill-9.py311.nbi": 200,  # calls what is newer
        "lattice/__pycache__/sweep.fill-9.py311.1.nbc": 200,
        "proof/gap.py": 100,
        "proof/__pycache__/gap.prove-3.py311.nbi": 400,
        "recipe/__pycache__/other.nbi": 50,
        "recipe/recipe.py": 500,  # has no kernels
    }
    for name, when in written.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
        os.utime(path, (when, when))
    assert forget_stale_kernels(tmp_path) == 1
    left = {path.name for path in tmp_path.glob("*/__pycache__/*.nbi")}
    assert left == {"gap.prove-3.py311.nbi", "other.nbi"}
    assert forget_stale_kernels(tmp_path) == 0


def test_kernels_in_a_folder_of_the_users_own_are_left_alone(cache, monkeypatch):
    monkeypatch.setattr(kernels, "forget_stale_kernels", lambda _root: pytest.fail("asked"))
    assert compile_with("true", monkeypatch) == len(HALVES)


@pytest.mark.parametrize("half", HALVES)
def test_a_half_calls_the_kernels_of_its_side(half):
    compile_half(half)
    called = {"tree": (reassign_leaves, repair, prove_pairs, build_tree), "fold": (shorten,)}[half]
    assert all(kernel.signatures for kernel in called)
