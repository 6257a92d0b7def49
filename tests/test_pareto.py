"""The Pareto list: nothing in it is beaten, nothing that belongs in it is missing."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from fabfold.errors import RecipeError
from fabfold.kit.kit import Kit, open_kit
from fabfold.search.pareto import Solution, undominated
from fabfold.tree.kinematics_check import check_tree


def solution(joints, surface, kept=None):
    return Solution(None, None, 0.5, joints, surface, kept)


def beats(a, b):
    pairs = list(zip(a.costs, b.costs, strict=True))
    return all(x <= y for x, y in pairs) and any(x < y for x, y in pairs)


@pytest.mark.parametrize("wishes", [False, True])
def test_nothing_beats_what_is_listed(wishes):
    rng = np.random.default_rng(3)
    for _ in range(20):
        found = [
            solution(int(j), float(s), float(k) if wishes else None)
            for j, s, k in zip(
                rng.integers(5, 12, 30),
                rng.integers(0, 9, 30) / 2,
                rng.integers(0, 4, 30) / 4,
                strict=True,
            )
        ]
        listed = undominated(found)
        best = {s.costs for s in found if not any(beats(other, s) for other in found)}
        assert [s.costs for s in listed] == sorted(best)


@pytest.mark.slow
def test_list_of_a_kit_and_going_on_with_one(tmp_path, monkeypatch):
    # The two ends of the ladder are enough.
    monkeypatch.setattr("fabfold.search.pareto.LADDER", (0.0, 1.0))
    mesh = trimesh.creation.box((4, 2, 1))
    mesh.export(tmp_path / "bar.stl")
    options = {
        "template": "box-2x2x2",
        "rotation": (0.0, 0.0, 0.0),
        "origin": (-1.5, -0.5, 0.0),
        "pitch": 1.0,
        "effort": "quick",
    }
    kit = Kit.from_model(tmp_path / "bar.stl", folder=tmp_path / "kit", workers=1, **options)
    kit.run("pareto")
    found = kit.pareto()
    assert [s.joints for s in found] == sorted(s.joints for s in found)
    assert not any(beats(a, b) for a in found for b in found)
    for entry in found:
        assert check_tree(entry.candidate.tree) == []
        assert entry.joints == sum(edge.kind != "R" for edge in entry.candidate.tree.edges)
    content = json.loads((tmp_path / "kit" / "pareto.json").read_text(encoding="utf-8"))
    assert len(content["solutions"]) == len(found)
    for entry in content["solutions"]:
        assert (tmp_path / "kit" / entry["picture"]).read_bytes().startswith(b"\x89PNG")

    again = open_kit(str(tmp_path / "kit"), workers=1, pick=len(found))
    tree = again.fold().tree
    assert tree.to_json(1, (0, 0, 0)) == found[-1].candidate.tree.to_json(1, (0, 0, 0))
    beyond = open_kit(str(tmp_path / "kit"), workers=1, pick=len(found) + 1)
    with pytest.raises(RecipeError, match=f"has {len(found)} solutions"):
        beyond.fold()


def test_costs_count_what_is_kept_backwards():
    assert beats(solution(5, 1.0, 0.9), solution(5, 1.0, 0.2))
    assert not beats(replace(solution(5, 1.0, 0.1), joints=4), solution(5, 1.0, 0.2))
