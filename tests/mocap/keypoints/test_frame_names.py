"""Frames by names of images: what counts up is the frame, what is a time tells the rate, all else is said."""

from datetime import datetime, timedelta

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionenv.errors import FormatError
from motionenv.mocap.keypoints.frame_names import frame_numbers

FRAMES = [0, 1, 2, 5, 9, 10, 11, 12]
STYLES = {
    "before a camera": "take2_{:06d}_cam1.jpg",
    "of digits only": "{}.png",
    "after all else": "subject 07/trial_03/frame{:04d}.PNG",
    "in a folder of its own": "{:05d}/cam-3.jpeg",
    "between": "GX010{:03d}_2024.mp4_keypoints.json",
    "of OpenPose": "walk2_{:012d}_keypoints.json",
    "after a date": "2024-03-05_{:03d}_v2.jpg",
    "of one digit": "p1 cam2 {} of 400.jpg",
    "without suffix": "cam2.{:04d}",
    "after a date and a time": "20240305_120417_{:06d}.jpg",
    "after a short count of milliseconds": "2024-03-05_12-04-17_{:03d}.jpg",
    "twice": "{0:03d}_frame_{0}.jpg",
}


@pytest.mark.parametrize("style", STYLES)
@pytest.mark.parametrize("first", [0, 7, 95])
def test_the_number_that_counts_up_is_the_frame(style, first):
    names = [STYLES[style].format(first + i) for i in FRAMES]
    order = np.random.default_rng(first).permutation(len(names))
    twice = [names[i] for i in order] + [names[0]]  # of two people in one picture
    numbers, fps = frame_numbers("a.json", twice)
    assert numbers == [FRAMES[i] for i in order] + [0]
    assert fps is None


@given(st.lists(st.integers(0, 3000), min_size=2, max_size=40, unique=True), st.integers(0, 999), st.integers(0, 9))
def test_constant_numbers_never_matter(frames, take, camera):
    span = max(frames) - min(frames)
    if span > max(50 * len(frames), 1000) - 2:
        return
    numbers, _ = frame_numbers("a", [f"s{take:03d}_f{frame:05d}_c{camera}.jpg" for frame in frames])
    assert numbers == [frame - min(frames) for frame in frames]


TIMES = {
    "AlphaPose of UP-Fall": lambda t: f"{t:%Y-%m-%dT%H_%M_%S.%f}.png",
    "compact": lambda t: f"{t:%Y%m%d_%H%M%S_%f}.jpg",
    "milliseconds": lambda t: f"cam1_{t:%Y-%m-%d %H-%M-%S}.{t.microsecond // 1000:03d}.jpg",
    "seconds since 1970": lambda t: f"{t.timestamp():.6f}.png",
    "microseconds since 1970": lambda t: f"rgb_{round(t.timestamp() * 1e6)}.png",
    "nanoseconds since 1970": lambda t: f"{round(t.timestamp() * 1e6)}000.png",
    "milliseconds since 1970": lambda t: f"{round(t.timestamp() * 1e3)}.png",
}


@pytest.mark.parametrize("style", TIMES)
@pytest.mark.parametrize("rate", [12.5, 20.0, 60.0])
def test_times_give_frames_and_their_rate(style, rate):
    rng = np.random.default_rng(round(rate))
    kept = np.delete(np.arange(100), [3, 40, 41, 42])
    begun = datetime(2018, 7, 4, 23, 59, 57, 738369)  # over midnight
    late = 0.15 / rate * rng.uniform(-1, 1, len(kept)) * (kept > 0) * (kept < 99)
    names = [TIMES[style](begun + timedelta(seconds=float(t))) for t in kept / rate + late]
    numbers, fps = frame_numbers("a.json", names)
    assert numbers == kept.tolist()
    assert fps == pytest.approx(rate, rel=1e-3)


def test_times_that_are_none_of_frames_are_numbers():
    assert frame_numbers("a", ["2024-03-05_12-04-17.jpg", "2024-03-05_12-04-18.jpg"]) == ([0, 1], None)
    assert frame_numbers("a", ["2024-13-45T12_04_17.5_1.jpg", "2024-13-45T12_04_17.5_2.jpg"])[0] == [0, 1]
    assert frame_numbers("a", [5, 3, 9, 3]) == ([2, 0, 6, 0], None)
    assert frame_numbers("a", []) == ([], None)


@pytest.mark.parametrize(
    ("names", "says"),
    [
        (["cam1_1.jpg", "cam2_1.jpg", "cam1_2.jpg"], "3 files or images have 2 numbers.*those of one camera"),
        (["front_7.jpg", "back_7.jpg"], "2 files or images have 1 numbers"),
        (["a.jpg", "b1.jpg"], "must be the number of a frame or hold one, got 'a.jpg'"),
        (["1.jpg", "9999999.jpg"], "span 9999999 numbers"),
        ([0, 10**12], "span"),
    ],
)
def test_what_cannot_be_frames_is_told(names, says):
    with pytest.raises(FormatError, match=says):
        frame_numbers("a.json", names)
