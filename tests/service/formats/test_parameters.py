"""Numbers of a model as bytes, read back as a browser would: by the header, without a library."""

import json
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

import motionenv
from service.formats.parameters import packed


def unpacked(data: bytes) -> tuple[dict[str, np.ndarray], dict]:
    """Arrays and description, as the module's docstring says that they lie."""
    (n,) = struct.unpack("<I", data[:4])
    described = json.loads(data[4 : 4 + n])
    assert (4 + n) % 8 == 0
    numbers = struct.unpack(f"<{(len(data) - 4 - n) // 8}d", data[4 + n :])
    found = {}
    for name, place in described.pop("arrays").items():
        size = int(np.prod(place["shape"], dtype=int))
        found[name] = np.array(numbers[place["offset"] :][:size]).reshape(place["shape"])
    return found, described


SOME = arrays.arrays(np.float64, arrays.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=4))


@given(st.dictionaries(st.text(max_size=5), SOME, max_size=4), st.text(max_size=9))
def test_all_that_is_packed_is_read_back(given_, about):
    found, described = unpacked(packed(given_, {"about": about}))
    assert described == {"about": about}
    assert list(found) == list(given_)
    for name, array in given_.items():
        np.testing.assert_array_equal(found[name], array)


def test_other_kinds_of_numbers_and_orders_are_the_same_numbers():
    table = np.arange(12, dtype=np.int32).reshape(3, 4)
    kinds = {"columns": np.asfortranarray(table), "part": table[:, ::2], "f4": table.astype("f4")}
    found, _ = unpacked(packed(kinds, {}))
    np.testing.assert_array_equal(found["columns"], table)
    np.testing.assert_array_equal(found["part"], table[:, ::2])
    np.testing.assert_array_equal(found["f4"], table)


@pytest.mark.parametrize("model", ["walk/fpca", "walk/eigenwalkers"])
def test_a_models_parameters_arrive_whole(model):
    given_, description = motionenv.models.parameters(motionenv.load(model))
    found, described = unpacked(packed(given_, description))
    assert described == json.loads(json.dumps(description))
    for name, array in given_.items():
        np.testing.assert_array_equal(found[name], array)
