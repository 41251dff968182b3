import ml_dtypes
import numpy as np
import pytest

from jaxphys.core import finite

FLOATS = (np.float16, ml_dtypes.bfloat16, np.float32, np.float64)


@pytest.mark.parametrize("dtype", FLOATS)
@pytest.mark.parametrize("bad", [np.nan, -np.nan, np.inf, -np.inf])
def test_one_number_that_is_none_is_found_anywhere(dtype, bad, monkeypatch):
    monkeypatch.setattr(finite, "_AT_ONCE", 7)
    # The largest and the smallest that the type has are numbers all the same.
    limit = ml_dtypes.finfo(dtype)
    good = np.array([limit.max, limit.min, limit.smallest_subnormal, 0, -0.0] * 4, dtype)
    assert finite.all_finite(good) and finite.all_finite(good.reshape(4, 5).T)
    for place in range(good.size):
        spoiled = good.copy()
        spoiled[place] = bad
        assert not finite.all_finite(spoiled.reshape(4, 5).T)


def test_whole_numbers_and_nothing_are_finite():
    assert finite.all_finite(np.array([2**63 - 1, -1])) and finite.all_finite(np.array([True]))
    assert finite.all_finite(np.zeros((0, 3), np.float32))
    assert finite.all_finite(np.float32(1)[None][0:1].reshape(())[None])
    assert not finite.all_finite(np.array(np.inf))
