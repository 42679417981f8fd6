"""Parts: compiled functions that only kernels call."""

import gc
import os
import subprocess
import sys

import numpy as np
import pytest
from numba import float64, int64
from numba.core.errors import TypingError

from motionenv._core.compilation import kernel, part


@pytest.fixture(autouse=True, scope="module")
def empty_cache(tmp_path_factory):
    """A cache in which nothing lies: kernels that are loaded have no parts."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("NUMBA_CACHE_DIR", str(tmp_path_factory.mktemp("cache")))
        yield


@part
def root(x):
    """The positive square root."""
    if x < 0.0:
        raise ValueError("no root of a negative number")
    return np.sqrt(x)


@part(fastmath={"contract"})
def length(values):
    """Length of a vector (n,), and n."""
    total = 0.0
    for i in range(len(values)):
        total += values[i] * values[i]
    return root(total), len(values)


@kernel
def mean_root(values):
    return length(values)[0] / length(values)[1]


@kernel
def fourth_root(x):
    return root(root(x))


@kernel
def sixteenth_root():
    return root(root(root(root(65536.0)))), root(4), root(9)


@kernel
def wrong():
    return root("text")


@kernel
def collects(enabled):
    return enabled


def test_kernels_get_what_the_parts_are_in_python():
    values = np.arange(5.0)
    assert mean_root(values) == np.linalg.norm(values) / 5


def test_two_kernels_share_a_part():
    mean_root(np.arange(5.0))
    code = root.overloads[float64,]
    assert fourth_root(16.0) == 2.0
    assert root.overloads[float64,] is code


def test_a_part_has_one_version_for_each_type():
    assert mean_root(np.arange(5, dtype=np.float32)) == pytest.approx(np.sqrt(30) / 5)
    assert mean_root(np.arange(10.0)[::2]) == np.sqrt(120) / 5


def test_constants_make_no_versions_of_their_own():
    mean_root(np.arange(5.0))
    assert sixteenth_root() == (2.0, 2.0, 3.0)
    assert set(root.overloads) == {(float64,), (int64,)}


def test_what_a_part_raises_comes_out_of_the_kernel():
    with pytest.raises(ValueError, match="no root of a negative number"):
        fourth_root(-1.0)


@pytest.mark.parametrize("argument", [1.0, "text", object()])
def test_python_is_told_that_it_can_not_call_a_part(argument):
    fourth_root(16.0)  # so that there is code for numbers
    with pytest.raises(TypeError, match="root is a part of kernels: call it from a kernel"):
        root(argument)


def test_a_kernel_and_its_parts_become_one_function():
    mean_root(np.arange(5.0))
    code = mean_root.inspect_llvm((float64[::1],)).splitlines()
    names = [line for line in code if line.startswith("define") and "NRT" not in line]
    assert names
    assert all("mean_root" in name for name in names)


def test_without_compilation_parts_are_plain_functions():
    asks = (
        "from motionenv._core.compilation import kernel, part\n"
        "@part\ndef twice(x): return 2 * x\n"
        "@kernel\ndef more(x): return twice(x) + 1\n"
        "print(twice(2), more(3))"
    )
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run([sys.executable, "-c", asks], env=environment, capture_output=True, text=True)
    assert done.stdout.split() == ["4", "7"]


@pytest.mark.parametrize("enabled", [True, False])
def test_the_garbage_collector_is_left_as_it_was(enabled):
    try:
        (gc.enable if enabled else gc.disable)()
        collects.compile((float64,))
        assert gc.isenabled() == enabled
        with pytest.raises(TypingError):
            wrong()
        assert gc.isenabled() == enabled
    finally:
        gc.enable()
