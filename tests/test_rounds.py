"""Rounds of the search in a kit: stopped and gone on, and with a budget in seconds."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from stage_listener import StageListener

from fabfold.errors import NoFoldError
from fabfold.files import write_json
from fabfold.kit.kit import Kit, open_kit
from fabfold.search.rounds import SEED_STRIDE
from fabfold.search.run import Budget
from fabfold.search.schedule import SEEDS_PER_ROUND, schedule
from fabfold.tree.bound import closed_share
from fabfold.tree.kinematics_check import check_tree


def seeds_of(kit):
    folder = kit.folder / "stages"
    return {path.name: path.read_bytes() for path in sorted(folder.glob("seed-*.json"))}


def stages_of(kit):
    return json.loads((kit.folder / "stages" / "journal.json").read_text("utf-8"))["stages"]


def content(kit):
    return [json.loads(data) for data in seeds_of(kit).values()]


class StopAtBetter(StageListener):
    """Interrupts the search once a better tree is known while a seed runs."""

    def update(self, share, message=""):
        if self.name.startswith("fit") and "best" in message:
            raise KeyboardInterrupt


@pytest.fixture
def voxelized(bar_kit, tmp_path):
    """Folder of the bar's kit as it was before its search."""
    folder = tmp_path / "kit"
    shutil.copytree(bar_kit.folder, folder)
    path = folder / "stages" / "journal.json"
    journal = json.loads(path.read_text(encoding="utf-8"))
    journal["stages"] = {stage: journal["stages"][stage] for stage in ("solid", "voxelize")}
    write_json(path, journal)
    for seed in (folder / "stages").glob("seed-*.json"):
        seed.unlink()
    return folder


@pytest.fixture
def stopped(voxelized):
    kit = open_kit(str(voxelized), workers=1)
    kit.listener = StopAtBetter()
    with pytest.raises(KeyboardInterrupt):
        kit.fit()
    return kit


@pytest.mark.slow
def test_interrupted_the_best_so_far_is_kept_and_going_on_makes_the_same(stopped, bar_kit):
    (kept,) = content(stopped)
    assert kept["cut"] == 0.0
    assert len(kept["candidates"]) == 1
    again = open_kit(str(stopped.folder), workers=1)
    again.fit()
    assert seeds_of(again) == seeds_of(bar_kit)
    searched, exported = stages_of(again), stages_of(bar_kit)
    assert set(exported) - set(searched) == {"fold", "join", "check"}
    assert searched == {stage: exported[stage] for stage in searched}


def test_no_more_time_takes_the_best_so_far(stopped):
    (kept,) = content(stopped)
    again = open_kit(str(stopped.folder), seconds=0)
    (best,) = again.fit()
    assert best.path.tolist() == kept["candidates"][0]["path"]
    assert check_tree(best.tree) == []
    again.fold()
    assert content(again) == [kept]


@pytest.mark.slow
def test_a_budget_goes_through_rounds_and_the_best_of_all_wins(bar_kit, voxelized, monkeypatch):
    # The clock of this test ticks once a look, so that the run is over after some seeds.
    class Counting(Budget):
        looks = 0

        @property
        def share(self):
            type(self).looks += 1
            return 0.0 if self.seconds is None else min(1.0, type(self).looks / 2000)

        def restart(self):
            type(self).looks = 0

    monkeypatch.setattr("fabfold.search.rounds.Budget", Counting)
    kit = open_kit(str(voxelized), workers=1, seconds=30)
    found = kit.fit()
    kept = content(kit)
    energies = [c["tree"]["energy"]["total"] for seed in kept for c in seed["candidates"]]
    assert found[0].energy["total"] == pytest.approx(min(energies))
    cut = [seed["cut"] for seed in kept]
    assert set(cut) <= {None, 30}
    assert 30 in cut, "the seed that ran when the time was over"

    # Without a budget the seeds that were cut run to their end, and the answer is as ever.
    again = open_kit(str(kit.folder), workers=1)
    again.fit()
    assert seeds_of(bar_kit).items() <= seeds_of(again).items()


@pytest.mark.slow
def test_more_time_goes_on_and_the_same_time_does_not_repeat(bar_kit, monkeypatch, tmp_path):
    kit = open_kit(str(bar_kit.folder), folder=tmp_path / "more", workers=1, seconds=0)
    with pytest.raises(NoFoldError, match="nothing folds yet after 0 s"):
        kit.fit()
    ran = []

    def run_seeds(_pool, tasks, _hear, _over):
        ran.extend(seed for (seed, _), _ in zip(tasks, range(6), strict=False))

    monkeypatch.setattr("fabfold.search.rounds.run_seeds", run_seeds)
    before = content(bar_kit)
    shutil.copytree(bar_kit.folder, tmp_path / "searched")
    more = open_kit(str(tmp_path / "searched"), workers=1, seconds=60)
    best = more.fit()[0]
    first = SEED_STRIDE * bar_kit.recipe.seed
    assert len(before) > 4
    assert min(ran) == first + SEEDS_PER_ROUND, "rounds that ran to their end are not run again"
    energies = [c["tree"]["energy"]["total"] for seed in before for c in seed["candidates"]]
    np.testing.assert_allclose(best.energy["total"], min(energies))


@pytest.mark.slow
def test_a_round_looks_at_roomy_voxelizations_first_and_goes_on_where_it_pays(tmp_path):
    path = tmp_path / "block.stl"
    trimesh.creation.box((60.0, 40.0, 20.0)).export(path)
    folder = tmp_path / "kit"
    kit = Kit.from_model(
        path, template="box-3x3x3", effort="quick", seed=3, workers=1, folder=folder
    )
    sizes = [len(voxels) for voxels in kit.voxelize()]
    assert len(set(sizes)) > 1
    rounds = kit._rounds()
    first = SEED_STRIDE * kit.recipe.seed
    found = next(rounds.found())
    assert len(rounds.voxels(first)) == min(sizes)
    roomy, closing, *_ = schedule("quick", 0)
    order = rounds.problems.closing_order(rounds.problems.plain)
    assert sorted(order) == list(range(len(sizes)))
    best = max(rounds.problems.at_most(option) for option in order)
    assert rounds.problems.at_most(order[0]) == best
    for k in range(closing.seeds):
        voxels = rounds.voxels(first + roomy.seeds + k)
        assert voxels is rounds.problems.options[order[k % min(closing.options, len(order))]]
    # What a seed finds joins the voxels that it was given, and no box is closed further than the
    # bound of its voxels.
    for voxels, candidate in found:
        assert voxels is rounds.voxels(candidate.seed)
        assert np.array_equal(candidate.tree.source, voxels.cells)
        option = [other is voxels for other in rounds.problems.options].index(True)
        assert closed_share(candidate.tree) <= rounds.problems.at_most(option) + 1e-9
    energies = [candidate.energy["total"] for _, candidate in found]
    assert energies == sorted(energies)

    # What was found is enough for a share that it reaches; more than the bound is refused at once.
    most = max(closed_share(candidate.tree) for _, candidate in found)
    enough = open_kit(str(folder), workers=1, closed=most - 1e-6)
    assert closed_share(enough.fit()[0].tree) >= most - 1e-6
    assert best < 1
    too_much = open_kit(str(folder), workers=1, closed=1.0)
    with pytest.raises(NoFoldError, match=f"no box of box-3x3x3 .* further than to {best:.2f}"):
        too_much.fit()


@pytest.mark.slow
def test_the_fullest_voxelizations_of_a_large_template_come_last(tmp_path):
    path = tmp_path / "block.stl"
    trimesh.creation.box((80.0, 50.0, 40.0)).export(path)
    folder = tmp_path / "kit"
    kit = Kit.from_model(path, template="box-5x5x5", seed=1, workers=1, folder=folder)
    kit.voxelize()
    problems = kit._rounds().problems
    sizes = [len(voxels) for voxels in problems.options[: len(problems.plain)]]
    fullest = [option for option, size in enumerate(sizes) if size >= max(sizes) - 2]
    assert 0 < len(fullest) < len(sizes)
    order = problems.closing_order(problems.plain)
    assert sorted(order[-len(fullest) :]) == fullest
    # Nor do they promise more than those on which nothing was tried or found yet.
    found = {order[0]: 15.0, order[1]: float("inf")}
    assert problems.promising_order(problems.plain, found)[0] not in fullest
    assert order[0] == problems.promising_order(problems.plain, {order[0]: 1.0})[0]

    # Whoever wants a closed box, or looks further, gets those that could close it best.
    for changes in ({"closed": 0.9}, {"effort": "thorough"}):
        wanted = open_kit(str(folder), workers=1, **changes)._rounds().problems
        best = wanted.closing_order(wanted.plain)[0]
        assert wanted.at_most(best) == max(map(wanted.at_most, wanted.plain))


def test_less_is_tried_on_a_large_template():
    for effort, fewer in (("quick", False), ("normal", True)):
        usual, large = (schedule(effort, 0, large=large) for large in (False, True))
        assert usual[0] == large[0]  # the guarantee
        seeds, kicks = (
            [sum(of(rung) for rung in rungs) for rungs in (large, usual)]
            for of in (lambda rung: rung.seeds, lambda rung: rung.seeds * rung.effort.kicks)
        )
        assert (seeds[0] < seeds[1]) == fewer
        assert (kicks[0] <= kicks[1] / 2) == fewer
        # As long as the others, but for the kicks, and with one start each, made with more care.
        few, many = ({replace(r.effort, kicks=0) for r in rungs} for rungs in (large, usual))
        assert few - {large[0].effort} == {
            replace(
                effort,
                restarts=1,
                swaps=30000,
                swap_heats=(0.25, 0.03),
                settling=40,
                settle_heats=(0.15, 0.05),
            )
            for effort in many - {usual[0].effort}
        }
    assert schedule("thorough", 0, large=True) == schedule("thorough", 0)


@pytest.mark.parametrize("effort", ["quick", "normal", "thorough"])
def test_further_joints_come_in_with_the_best_trees_and_kicks_follow(effort):
    rungs = schedule(effort, 0)
    best = [rung.takes == "best" for rung in rungs]
    assert [rung.every_joint for rung in rungs] == best == sorted(best)
    first, second, *_ = (rung for rung in rungs if rung.takes == "best")
    assert first.effort.kicks == 0
    assert second.effort.kicks > 0
    # The first is no end, also where it gains nothing; the second is.
    assert not first.is_last(5.0, 5.0)
    assert second.is_last(5.0, 5.0)
    assert not second.is_last(5.0, 4.9)


@pytest.mark.slow
def test_double_hinges_are_let_in_where_they_pay(tmp_path):
    """A model whose box closes further with them; the search itself is that of single hinges."""
    import trimesh

    path = tmp_path / "ball.stl"
    ball = trimesh.creation.icosphere(subdivisions=3)
    ball.apply_scale((30.0, 26.0, 22.0))
    ball.export(path)
    options = {"template": "box-3x3x3", "effort": "quick", "seed": 1, "workers": 1}
    kits = {
        joints: Kit.from_model(path, folder=tmp_path / joints, joints=joints, **options)
        for joints in ("S", "auto")
    }
    single, auto = (kit.fit()[0] for kit in kits.values())
    assert single.tree.joints["D"] == 0
    assert auto.tree.joints["D"] > 0
    assert auto.energy["total"] < single.energy["total"]
    seeds = [set(kit._rounds()._held(0)) for kit in kits.values()]
    assert seeds[0] == seeds[1]
    held = [kit._rounds()._held(0) for kit in kits.values()]
    first = min(held[0])
    for seed in range(first, first + 5):  # the rungs before the best trees
        assert [c.tree.joints for c in held[0][seed].candidates] == [
            c.tree.joints for c in held[1][seed].candidates
        ]
    # What singles found is taken as it is, when the joints change.
    again = Kit.from_model(path, folder=tmp_path / "S", joints="auto", **options)
    assert again.fit()[0].energy == auto.energy
