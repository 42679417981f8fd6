"""Videos in: what was written is read, at other rates and sizes, and cameras out of files."""

import numpy as np
import pytest

from motionenv.errors import FormatError, MotionError
from motionenv.render.video.decode import read_frames, video_info
from motionenv.render.video.encode import write_video


@pytest.fixture(scope="module")
def steps(tmp_path_factory):
    """A film of 30 grey pictures at 60 fps, each 8 levels lighter than the one before."""
    path = tmp_path_factory.mktemp("films") / "steps.mp4"
    write_video(path, np.broadcast_to(np.arange(30, dtype=np.uint8)[:, None, None, None] * 8, (30, 48, 64, 3)), 60)
    return path


def levels(frames) -> np.ndarray:
    return np.array([round(float(f.mean()) / 8) for f in frames])


def test_all_frames_as_they_were_written(steps):
    assert video_info(steps).fps == 60
    assert (video_info(steps).width, video_info(steps).height) == (64, 48)
    np.testing.assert_array_equal(levels(read_frames(steps)), np.arange(30))


@pytest.mark.parametrize(
    ("fps", "expected"), [(30, np.arange(0, 30, 2)), (20, np.arange(0, 30, 3)), (60, np.arange(30))]
)
def test_other_rates_take_the_nearest_frames(steps, fps, expected):
    np.testing.assert_array_equal(levels(read_frames(steps, fps=fps)), expected)


def test_faster_rates_repeat_frames(steps):
    np.testing.assert_array_equal(levels(read_frames(steps, fps=120))[:6], [0, 0, 1, 1, 2, 2])
    assert len(list(read_frames(steps, fps=120))) == 60


def test_size_and_duration(steps):
    frames = list(read_frames(steps, width=32, seconds=0.25))
    assert len(frames) == 15
    assert frames[0].shape == (24, 32, 3)
    assert frames[0].dtype == np.uint8


def test_films_that_are_none(steps, tmp_path):
    for name, content in {"empty": b"", "text": b"no film " * 99, "cut": steps.read_bytes()[:1500]}.items():
        (tmp_path / f"{name}.mp4").write_bytes(content)
        with pytest.raises(FormatError, match=name):
            list(read_frames(tmp_path / f"{name}.mp4"))
    with pytest.raises(FormatError, match="no such file"):
        video_info(tmp_path / "none.mp4")
    for wrong in ({"fps": 0}, {"width": 3}, {"seconds": 0}):
        with pytest.raises(MotionError, match=next(iter(wrong))):
            read_frames(steps, **wrong)
