import numpy as np
import pytest

from motionenv.data import Specification
from motionenv.data.preview import contact_sheet
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
