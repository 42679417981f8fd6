"""Which arrays are loaded, and which are not even looked at; `tests/mocap/test_npz.py` has the damaged files."""

import numpy as np
import pytest

from motionenv.errors import FormatError
from motionenv.mocap.readers.npz_arrays import load_arrays


def test_only_wanted_arrays_are_loaded_and_objects_never(tmp_path):
    path = tmp_path / "a.npz"
    np.savez(path, trans=np.arange(6.0).reshape(2, 3), labels=np.array([{"a": 1}], dtype=object))
    arrays, names = load_arrays(path.read_bytes(), path, {"trans", "poses"})
    assert set(arrays) == {"trans"}
    assert set(names) == {"trans", "labels"}
    np.testing.assert_array_equal(arrays["trans"], [[0, 1, 2], [3, 4, 5]])
    with pytest.raises(FormatError, match=r"labels\.npy: has Python objects, which are never loaded"):
        load_arrays(path.read_bytes(), path, {"labels"})


@pytest.mark.parametrize("raw", [b"x" * 300, b"PK\3\4" + bytes(300)])
def test_other_files_are_refused_in_our_words(raw):
    with pytest.raises(FormatError, match="^a.npz: isn't an NPZ file, or is damaged$"):
        load_arrays(raw, "a.npz", {"trans"})
