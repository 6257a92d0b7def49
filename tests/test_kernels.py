"""Kernels are compiled once, by processes of their own, and never where they are there."""

import shutil

import pytest
from numba.core import config

from fabfold.fold.shortcut import shorten
from fabfold.progress import SilentProgress
from fabfold.search import kernels
from fabfold.search.kernels import HALVES, KernelCompiler, compile_half, kernel_stamp
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


@pytest.mark.parametrize("half", HALVES)
def test_a_half_calls_the_kernels_of_its_side(half):
    compile_half(half)
    called = {"tree": reassign_leaves, "fold": shorten}[half]
    assert called.signatures
