"""Cycles in files against the same cycles in memory."""

import pickle
from itertools import pairwise

import numpy as np
import pytest

from motionenv.cycles import StoredCycles
from motionenv.errors import MotionError

CYCLES = np.random.default_rng(0).standard_normal((23, 6, 3))


@pytest.fixture
def files(tmp_path):
    """Ten cycles, one, none, and twelve in single precision."""
    bounds, paths = (0, 10, 11, 11, 23), []
    for i, (start, stop) in enumerate(pairwise(bounds)):
        paths.append(tmp_path / f"{i}.npy")
        np.save(paths[-1], CYCLES[start:stop].astype(np.float32 if i == 3 else np.float64))
    return paths


@pytest.mark.parametrize("step", [1, 2, 7, 40])
@pytest.mark.parametrize(("start", "stop"), [(0, None), (9, 12), (10, 11), (3, 5), (22, 99), (5, 5)])
def test_slices_are_those_of_one_array(files, start, stop, step):
    stored = pickle.loads(pickle.dumps(StoredCycles(files, "abc").values))
    assert stored.shape == CYCLES.shape
    found = stored[start:stop:step]
    assert found.dtype == np.float64
    np.testing.assert_allclose(found, CYCLES[start:stop:step], rtol=1e-7)


def test_a_memory_map_or_a_part_of_one_is_read_where_it_lies(files):
    whole = np.load(files[0], mmap_mode="r")
    np.testing.assert_array_equal(StoredCycles([whole[4:9][1:]], "abc").values[1:], CYCLES[6:9])


def test_labels_are_those_of_all_files(files):
    stored = StoredCycles(files, ("a", "b", "c"), subject=range(23))
    assert stored.subject == tuple(str(i) for i in range(23))
    assert StoredCycles(files, "abc").subject == ("",) * 23


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda files: StoredCycles([], "abc"), "at least one .npy file"),
        (lambda files: StoredCycles(["nowhere.npy"], "abc"), "nowhere.npy is no .npy file of cycles: .*No such file"),
        (lambda files: StoredCycles([__file__], "abc"), "is no .npy file of cycles"),
        (lambda files: StoredCycles(files, "ab"), r"must hold cycles \(n, 6, 2\).*got \(10, 6, 3\)"),
        (lambda files: StoredCycles(files, "abc", subject="xy"), "subject must hold 23 labels, got 2"),
        (lambda files: StoredCycles([files[0].with_name("ints.npy")], "abc"), "must hold float32 or float64.*got int"),
        (lambda files: StoredCycles([files[0].with_name("more.npz")], "abc"), "not an archive"),
    ],
)
def test_what_is_no_cycles_is_refused(files, make, told):
    np.save(files[0].with_name("ints.npy"), np.zeros((2, 6, 3), int))
    np.savez(files[0].with_name("more.npz"), CYCLES)
    with pytest.raises(MotionError, match=told):
        make(files)


def test_a_file_that_becomes_shorter_is_told(files):
    stored = StoredCycles(files, "abc")
    np.save(files[0], CYCLES[:2])
    with pytest.raises(MotionError, match=r"0.npy has become shorter"):
        stored.values[:]
