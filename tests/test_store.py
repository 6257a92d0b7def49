import pytest

from fabfold.errors import KitError
from fabfold.files import replacing, write_json, write_npz, write_text
from fabfold.store import StageStore, stage_key


def test_a_file_is_replaced_whole_or_not_at_all(tmp_path):
    path = tmp_path / "a.txt"
    write_text(path, "old")

    def fail_half_way():
        with replacing(path) as temporary:
            temporary.write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail_half_way()
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]


def test_npz_bytes_depend_on_the_arrays_alone(tmp_path):
    import numpy as np

    arrays = {"a": np.arange(5), "b": np.array(["x", "yz"])}
    write_npz(tmp_path / "one.npz", arrays)
    write_npz(tmp_path / "two.npz", arrays)
    assert (tmp_path / "one.npz").read_bytes() == (tmp_path / "two.npz").read_bytes()
    with np.load(tmp_path / "one.npz", allow_pickle=False) as data:
        assert (data["a"] == arrays["a"]).all()
        assert (data["b"] == arrays["b"]).all()


def test_a_stage_is_done_only_with_its_key_and_its_files(tmp_path):
    store = StageStore(tmp_path)
    write_json(store.path("x.json"), {"value": 1})
    key = stage_key("stage", 1)
    store.record("first", key, ["x.json"])

    again = StageStore(tmp_path)
    assert again.holds("first", key)
    assert again.files("first") == ["x.json"]
    assert not again.holds("first", stage_key("stage", 2))
    assert not again.holds("second", key)
    write_json(again.path("x.json"), {"value": 2})
    assert not again.holds("first", key)
    again.path("x.json").unlink()
    assert not again.holds("first", key)


def test_a_store_without_a_folder_keeps_nothing(tmp_path):
    store = StageStore(None)
    store.record("stage", "key", [])
    assert not store.holds("stage", "key")
    with pytest.raises(KitError, match="no folder"):
        store.path("x")


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"format": "other", "version": 1}'])
def test_a_broken_journal_says_what_to_do(tmp_path, text):
    (tmp_path / "stages").mkdir()
    (tmp_path / "stages" / "journal.json").write_text(text)
    with pytest.raises(KitError, match="remove the folder"):
        StageStore(tmp_path)
