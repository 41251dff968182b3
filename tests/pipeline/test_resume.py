import numpy as np

from jaxphys.pipeline.resume import Checkpoint, fingerprint

ARRAYS = {"a": np.arange(6, dtype=np.float32).reshape(2, 3), "b": np.int32(4)}


def test_newest_checkpoint_comes_back_exactly(tmp_path):
    checkpoint = Checkpoint(tmp_path, "a" * 64)
    assert checkpoint.frame() is None
    checkpoint.save(3, ARRAYS)
    checkpoint.save(12, {**ARRAYS, "b": np.int32(5)})
    assert checkpoint.frame() == 12
    found = checkpoint.load(12)
    assert found["b"] == 5 and found["a"].dtype == np.float32
    assert np.array_equal(found["a"], ARRAYS["a"])
    assert len(list((tmp_path / "checkpoint").iterdir())) == 1
    checkpoint.remove()
    assert checkpoint.frame() is None


def test_checkpoints_of_another_run_are_not_used(tmp_path):
    Checkpoint(tmp_path, "a" * 64).save(3, ARRAYS)
    assert Checkpoint(tmp_path, "b" * 64).frame() is None


def test_unfinished_checkpoints_are_not_used(tmp_path):
    checkpoint = Checkpoint(tmp_path, "a" * 64)
    checkpoint.save(3, ARRAYS)
    (tmp_path / "checkpoint" / f"{'a' * 16}-000009.orbax-checkpoint-tmp-1").mkdir()
    assert checkpoint.frame() == 3


def test_fingerprint_sees_every_number_shape_and_type():
    same = fingerprint(b"x", ARRAYS)
    assert same == fingerprint(b"x", {k: np.array(v) for k, v in ARRAYS.items()})
    changed = [
        fingerprint(b"y", ARRAYS),
        fingerprint(b"x", {**ARRAYS, "b": np.int32(5)}),
        fingerprint(b"x", {**ARRAYS, "b": np.int64(4)}),
        fingerprint(b"x", {**ARRAYS, "a": ARRAYS["a"].T}),
    ]
    assert len({same, *changed}) == 5
