"""NumPy's arrays as JSON, read back by the standard library."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from service.formats import dumps

KINDS = st.sampled_from([np.float64, np.float32, np.int64, np.uint8, np.bool_])


@given(KINDS.flatmap(lambda kind: arrays.arrays(kind, arrays.array_shapes(max_dims=3, max_side=4))))
def test_any_array_is_read_back_as_its_numbers(array):
    for given_ in (array, array.T, array[::-1], np.asfortranarray(array)):
        told = np.array(json.loads(dumps({"a": given_}))["a"], dtype=float).reshape(given_.shape)
        wanted = given_.astype(float)
        np.testing.assert_allclose(told, np.where(np.isfinite(wanted), wanted, np.nan), rtol=1e-6)


def test_gaps_are_null_and_scalars_are_plain():
    value = {"gap": np.array([1.5, np.nan, np.inf]), "one": np.float32(0.5), "n": np.int16(3), "none": None}
    assert json.loads(dumps(value)) == {"gap": [1.5, None, None], "one": 0.5, "n": 3, "none": None}
    assert json.loads(dumps(np.arange(6).reshape(2, 3)[:, ::2])) == [[0, 2], [3, 5]]


def test_what_is_no_number_is_refused():
    with pytest.raises(TypeError, match="not JSON serializable: object"):
        dumps({"a": object()})
