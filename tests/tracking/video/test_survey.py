"""The first and second look at a film, against the outline that was drawn."""

import numpy as np
import pytest

from motionenv.errors import MotionError
from motionenv.tracking.video.candidates import chosen
from motionenv.tracking.video.survey import look, survey


def test_the_second_look_is_at_her_pixels(crossing):
    path, camera, _, _, masks = crossing
    seen = survey(path, fps=None, seconds=60.0)
    assert seen.fps == pytest.approx(30)
    who = chosen(seen.found)
    close = look(seen, who, 10, 50)
    assert close.scale < 1  # larger than needed
    assert close.foreground.shape == close.colours.shape
    view = close.camera(camera)
    assert (view.width, view.height) == close.foreground.shape[:0:-1]
    rows, columns = np.nonzero(masks[30])
    boxed = close.boxes(who)[30]
    there = np.array([columns.min(), columns.max(), rows.min(), rows.max()])
    np.testing.assert_allclose(boxed, (there + 0.5) * close.scale - 0.5 - np.repeat(close.corner, 2), atol=2.5)
    found = close.foreground[20] > 0.5
    assert found.sum() == pytest.approx((masks[30].sum()) * close.scale**2, rel=0.25)
    assert boxed[0] - 3 <= np.nonzero(found.any(axis=0))[0].min()


def test_a_region_limits_the_look(crossing):
    path = crossing[0]
    assert all(
        np.nanmax(c.boxes[:, 1]) <= 100 for c in survey(path, fps=15, seconds=1.0, region=(0, 0, 100, 192)).found
    )
    with pytest.raises(MotionError, match="inside the picture"):
        survey(path, fps=15, seconds=1.0, region=(900, 0, 10, 10))
