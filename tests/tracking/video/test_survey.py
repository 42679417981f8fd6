"""The first and second look at a film, against the outline that was drawn."""

import numpy as np
import pytest

from motionenv.errors import MotionError
from motionenv.tracking.video.candidates import chosen
from motionenv.tracking.video.survey import Film, look, survey


def test_the_second_look_is_at_her_pixels(crossing):
    path, camera, _, _, masks = crossing
    seen = survey(Film(path))
    assert seen.fps == pytest.approx(30)
    who = chosen(seen.found)
    close = look(seen, who, slice(10, 50), camera)
    scale = close.camera.K[1, 1] / camera.K[1, 1]
    assert scale < 1  # larger than needed
    assert close.foreground.shape == close.colours.shape
    assert (close.camera.width, close.camera.height) == close.foreground.shape[:0:-1]
    rows, columns = np.nonzero(masks[30])
    boxed, corner = close.boxes[20], (camera.K[:2, 2] + 0.5) * scale - 0.5 - close.camera.K[:2, 2]
    there = np.array([columns.min(), columns.max(), rows.min(), rows.max()])
    np.testing.assert_allclose(boxed, (there + 0.5) * scale - 0.5 - np.repeat(corner, 2), atol=2.5)
    found = close.foreground[20] > 0.5
    assert found.sum() == pytest.approx((masks[30].sum()) * scale**2, rel=0.25)
    assert boxed[0] - 3 <= np.nonzero(found.any(axis=0))[0].min()


def test_a_region_limits_the_look(crossing):
    path = crossing[0]
    seen = survey(Film(path, 15, 1.0, region=(0, 0, 100, 192)))
    assert all(np.nanmax(c.boxes[:, 1]) <= 100 for c in seen.found)
    with pytest.raises(MotionError, match="inside the picture"):
        survey(Film(path, 15, 1.0, region=(900, 0, 10, 10)))


@pytest.mark.parametrize(
    ("wrong", "says"),
    [({"fps": 0}, "fps"), ({"seconds": -1}, "seconds"), ({"region": (0, 0, -3, 9)}, "region must be x, y, width")],
)
def test_films_that_can_not_be_are_refused(wrong, says):
    with pytest.raises(MotionError, match=says):
        Film("walk.mp4", **wrong)
