"""The first and second look at a film, against the outline that was drawn."""

from dataclasses import replace

import numpy as np
import pytest

from motionenv.body import markers
from motionenv.errors import MotionError
from motionenv.render.cameras import view
from motionenv.render.video.encode import write_video
from motionenv.tracking.video.candidates import chosen
from motionenv.tracking.video.survey import Film, look, survey
from motionenv.types import Points


def test_the_second_look_is_at_her_pixels(crossing):
    path, camera, poses, skeleton, masks = crossing
    points = Points(camera.project(markers(poses, skeleton))[0], 30, "px")
    seen = survey(Film(path, detections=points))
    assert seen.fps == pytest.approx(30)
    who = chosen(seen.found)
    close = look(seen, who, slice(10, 50), camera)
    scale = close.camera.K[1, 1] / camera.K[1, 1]
    assert scale < 1  # larger than needed
    assert (close.camera.width, close.camera.height) == close.foreground.shape[:0:-1]
    rows, columns = np.nonzero(masks[30])
    boxed, corner = close.boxes[20], (camera.K[:2, 2] + 0.5) * scale - 0.5 - close.camera.K[:2, 2]
    there = np.array([columns.min(), columns.max(), rows.min(), rows.max()])
    np.testing.assert_allclose(boxed, (there + 0.5) * scale - 0.5 - np.repeat(corner, 2), atol=8)
    found = close.foreground[20] > 0.5
    assert found.sum() == pytest.approx((masks[30].sum()) * scale**2, rel=0.25)
    assert boxed[0] - 3 <= np.nonzero(found.any(axis=0))[0].min()


def test_outlines_of_others_are_left_out(crossing):
    path, camera, poses, skeleton, _ = crossing
    points = Points(camera.project(markers(poses, skeleton))[0], 30, "px")
    behind = Points(points.positions - [12, 0], 30, "px", confidence=np.full((60, 15), 0.1))
    seen = survey(Film(path, detections=[points, behind]))
    alone, both = (look(replace(seen, found=seen.found[:n]), seen.found[0], slice(10, 50), camera) for n in (1, 2))
    assert both.merged.all()
    assert not alone.merged.any()
    assert (both.foreground <= alone.foreground).all()
    assert (both.foreground < alone.foreground).any()


def test_a_second_look_fits_pictures_whose_height_rounds_from_a_half(tmp_path):
    """416 × 312 pixels become 254 × 190.5 and the like."""
    rng = np.random.default_rng(3)
    write_video(tmp_path / "film.mp4", rng.integers(90, 110, (24, 312, 416, 3), np.uint8), 30)
    body = np.repeat(rng.uniform([180, 100], [230, 200], (1, 15, 2)), 24, axis=0)
    seen = survey(Film(tmp_path / "film.mp4", detections=Points(body, 30, "px")))
    for top in np.linspace(163.4, 163.8, 5):
        taller = replace(seen.found[0], boxes=np.repeat([[178.0, 232.0, top, 310.0]], 24, axis=0))
        close = look(seen, taller, slice(0, 24), view(0.0, width=416, height=312))
        assert close.foreground.shape[1:] == (close.camera.height, close.camera.width)


@pytest.mark.parametrize(
    ("wrong", "says"),
    [({"fps": 0}, "fps"), ({"seconds": -1}, "seconds"), ({"region": (0, 0, -3, 9)}, "region must be x, y, width")],
)
def test_films_that_can_not_be_are_refused(wrong, says):
    with pytest.raises(MotionError, match=says):
        Film("walk.mp4", **wrong)
