import re

import numpy as np
import pytest

from motionenv.data import Specification, generate
from motionenv.data.preview import contact_sheet, estimate
from motionenv.errors import MotionError
from tests.data.walks import EVERYTHING, SINGLE


@pytest.mark.parametrize(
    "spec", [EVERYTHING, SINGLE, Specification.read("lifting"), Specification.read("silhouette-gait")]
)
def test_the_sheet_shows_every_sample_with_its_joints(spec):
    sheet = contact_sheet(spec, 5)
    assert sheet.dtype == np.uint8
    assert sheet.ndim == 3
    orange = (np.abs(sheet.astype(int) - (230, 159, 0)).sum(axis=-1) < 3).sum()  # left limbs
    assert orange > 20
    with pytest.raises(MotionError, match="samples must be a whole number from 1 to 256, got 0"):
        contact_sheet(spec, 0)


def test_the_estimate_is_near_what_is_made(tmp_path):
    spec = SINGLE.replace(frames=500, people={"views": 8})
    told = estimate(spec, workers=4)
    made = generate(spec, tmp_path, workers=1)
    assert told.startswith("500 frames in 500 samples and 25 shards: ")
    assert told.endswith(" with 4 worker(s)")
    gigabytes, hours, minutes = (float(number) for number in re.findall(r"([\d.e-]+) (?:GB|core|min)", told))
    assert 0.7 < 1e9 * gigabytes / made.bytes < 1.3
    assert minutes == pytest.approx(15 * hours, rel=0.1)
