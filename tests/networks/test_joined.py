"""Matrices of a checkpoint, joined."""

import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.networks.joined import JoinedArrays

LAYERS = {"qk": ("q", "k"), "gate_up": ("gate", "up")}
A, B = np.arange(6.0).reshape(3, 2), np.arange(4.0).reshape(2, 2)


def test_they_follow_each_other_in_the_order_that_is_asked_for():
    arrays = {"a.k.weight": B, "norm": A, "a.0.q.weight": A, "a.0.k.weight": B, "a.q.weight": A}
    joined = JoinedArrays(arrays | {"weight": B}, LAYERS, source="x")
    assert sorted(joined) == ["a.0.qk.weight", "a.qk.weight", "norm", "weight"]
    assert len(joined) == 4
    for name in ("a.0.qk.weight", "a.qk.weight"):
        np.testing.assert_array_equal(joined[name], [[0, 1], [2, 3], [4, 5], [0, 1], [2, 3]])
    assert joined["norm"] is A


def test_biases_are_joined_as_well():
    arrays = {"q.bias": A[:, 0], "k.bias": B[:, 0]}
    np.testing.assert_array_equal(
        JoinedArrays(arrays, LAYERS, source="x")["qk.bias"], [0, 2, 4, 0, 2]
    )


def test_a_part_that_is_missing_is_named():
    with pytest.raises(InputError, match=r"^x: array 'a\.k\.weight' is missing$"):
        JoinedArrays({"a.q.weight": A}, LAYERS, source="x")


@pytest.mark.parametrize("other", [A.T, np.zeros(()), np.zeros(3)])
def test_parts_that_do_not_fit_are_named(other):
    joined = JoinedArrays({"a.q.weight": A, "a.k.weight": other}, LAYERS, source="x")
    with pytest.raises(InputError, match=r"^x: array 'a\.k\.weight' of shape .* does not fit"):
        joined["a.qk.weight"]
