import json
import sys

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


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"format": "other", "version": 1}', "\x00"])
def test_a_broken_journal_is_said_and_made_again(tmp_path, text):
    (tmp_path / "stages").mkdir()
    (tmp_path / "stages" / "model").mkdir()
    (tmp_path / "stages" / "model" / "m.stl").write_text("the only copy")
    (tmp_path / "stages" / "journal.json").write_text(text)
    store = StageStore(tmp_path)
    assert "journal.json was damaged" in store.damage
    assert not store.holds("solid", "key")
    assert (tmp_path / "stages" / "model" / "m.stl").read_text() == "the only copy"


@pytest.mark.parametrize(
    "entry",
    [
        {},
        [],
        None,
        {"key": "k"},
        {"key": "k", "files": {}},
        {"key": 1, "files": {"a": "d"}},
        {"key": "k", "files": {"../a": "d"}},
        {"key": "k", "files": ["a"]},
    ],
)
def test_a_damaged_entry_of_the_journal_counts_for_nothing(tmp_path, entry):
    store = StageStore(tmp_path)
    write_text(store.path("one"), "1")
    store.record("one", "k", ["one"])
    path = tmp_path / "stages" / "journal.json"
    journal = json.loads(path.read_text("utf-8"))
    journal["stages"]["two"] = entry
    path.write_text(json.dumps(journal), "utf-8")
    again = StageStore(tmp_path)
    assert again.holds("one", "k")
    assert not again.holds("two", "k")
    assert "in places" in again.damage


def test_a_journal_of_another_version_is_left_alone(tmp_path):
    (tmp_path / "stages").mkdir()
    path = tmp_path / "stages" / "journal.json"
    path.write_text('{"format": "fabfold-stages", "version": 2, "stages": {}}')
    with pytest.raises(KitError, match="another version"):
        StageStore(tmp_path)


@pytest.mark.skipif(sys.platform == "win32", reason="folders cannot be locked there")
def test_two_runs_do_not_share_a_folder(tmp_path):
    one, two = StageStore(tmp_path / "kit"), StageStore(tmp_path / "kit")
    with one.locked():
        assert not (tmp_path / "kit").exists()  # nothing is made for a lock alone
        one.take()
        with one.locked():
            pass
        with pytest.raises(KitError, match="another run is at work"), two.locked():
            pass
    with two.locked():
        pass


def test_what_a_killed_run_left_is_swept(tmp_path):
    for name in (".part-abc.stl", "stages/.part-x.npz", "bodies/.part-y.stl", "bodies/mine.stl"):
        write_text(tmp_path / name, "half")
    with StageStore(tmp_path).locked():
        pass
    assert [path.name for path in tmp_path.rglob("*") if path.is_file()] == ["mine.stl"]
