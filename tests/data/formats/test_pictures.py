import io
import time

import numpy as np
import pytest
from PIL import Image

from motionenv.data.formats.pictures import SUFFIX, encoded, packed


@pytest.mark.parametrize("how", SUFFIX)
def test_encodings(how):
    rng = np.random.default_rng(0)
    picture = np.repeat(np.repeat(rng.integers(256, size=(8, 9, 3), dtype=np.uint8), 8, 0), 8, 1)
    content = encoded(picture, how)
    assert content == encoded(picture.copy(), how)
    opened = Image.open(io.BytesIO(content))
    assert opened.format.lower() == how
    off = np.abs(np.asarray(opened).astype(int) - picture)
    assert off.max() == 0 if how != "jpeg" else off.mean() < 4


def test_arrays_are_exact_and_tell_no_time():
    depth = np.random.default_rng(0).normal(size=(30, 20)).astype(np.float32)
    first = packed(depth=depth)
    time.sleep(2.1)  # ZIP files count time in steps of two seconds
    assert packed(depth=depth) == first
    assert np.array_equal(np.load(io.BytesIO(first))["depth"], depth)
    assert len(packed(depth=np.zeros((64, 64)))) < 1000
