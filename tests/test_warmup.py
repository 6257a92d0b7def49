import pytest

from fabfold.search.seeds import run_seed
from fabfold.search.warmup import warm_up_job
from fabfold.tree.catalogue import JOINT_SETS, JointSet
from fabfold.tree.kinematics_check import check_tree


@pytest.mark.slow
@pytest.mark.parametrize("joints", JOINT_SETS)
def test_the_strip_folds_whatever_the_seed(joints: JointSet) -> None:
    for seed in range(3):
        result = run_seed(warm_up_job(joints), seed, lambda _: None, lambda: False)
        assert not result.failed, result.why
        assert result.candidates
        assert check_tree(result.candidates[0].tree) == []
