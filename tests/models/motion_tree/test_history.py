"""The end of a motion, as a database of another body sees it."""

import numpy as np
import pytest

from motionenv.errors import MotionError
from motionenv.models.motion_tree.database import leg_length
from motionenv.models.motion_tree.features import parameters
from motionenv.models.motion_tree.history import recent_frames
from motionenv.models.transforms import scaled
from motionenv.types import Motion


def test_the_last_ten_frames_count_with_two_before_them_for_velocities(database, stranger):
    recent = recent_frames(stranger.poses, database)
    assert recent.scale == 1.0
    np.testing.assert_allclose(recent.parameters, parameters(stranger.poses)[-10:], atol=1e-12)
    np.testing.assert_array_equal(recent.last, stranger.poses[-1])
    longer = np.concatenate([np.full((5, 25), np.nan), stranger.poses[-12:]])
    np.testing.assert_array_equal(recent_frames(longer, database).parameters, recent.parameters)


def test_somebody_taller_is_brought_to_the_size_of_the_database(database, stranger):
    plain = recent_frames(Motion(stranger.poses, database.skeleton, 30.0), database)
    tall = scaled(Motion(stranger.poses, database.skeleton, 30.0), 2.1)
    recent = recent_frames(tall, database)
    assert recent.scale == pytest.approx(leg_length(database.skeleton) / leg_length(tall.skeleton))
    np.testing.assert_allclose(recent.parameters, plain.parameters, atol=1e-6)
    np.testing.assert_allclose(recent.last, plain.last, atol=1e-9)


@pytest.mark.parametrize(
    ("history", "message"),
    [
        (np.zeros((9, 25)), r"history must have shape \(..., 10 or more frames, 25\), got \(9, 25\)"),
        (np.zeros((20, 24)), r"got \(20, 24\)"),
        (np.full((20, 25), np.nan), "NaN or infinite values in its last 12 frames"),
        ("walk", "history must be numeric"),
    ],
)
def test_bad_histories_are_named(database, history, message):
    with pytest.raises(MotionError, match=message):
        recent_frames(history, database)


def test_a_history_of_another_rate_is_refused(database, stranger):
    with pytest.raises(MotionError, match="history must be at 30 frames/s, got 60"):
        recent_frames(Motion(stranger.poses, stranger.skeleton, 60.0), database)
