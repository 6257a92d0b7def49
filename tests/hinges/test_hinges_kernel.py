"""What is said about a broken CAD environment."""

import pytest

from hinges import KernelError
from hinges import kernel as kernel_module


def test_an_overwritten_kernel_is_named_with_its_cure(monkeypatch):
    versions = {"cadquery-ocp": "7.8.1.1", "cadquery-ocp-novtk": "8.0.1"}
    monkeypatch.setattr(kernel_module, "_version", versions.get)
    with pytest.raises(KernelError, match="overwritten") as caught:
        kernel_module.check_kernel()
    for hint in ("pip install", "build123d==0.10", "cadquery==2.7", "pip uninstall"):
        assert hint in str(caught.value)


def test_a_missing_cadquery_is_named(monkeypatch):
    monkeypatch.setattr(kernel_module, "find_spec", lambda name: None)
    with pytest.raises(KernelError, match="CadQuery is not installed"):
        kernel_module.check_kernel(cadquery=True)
