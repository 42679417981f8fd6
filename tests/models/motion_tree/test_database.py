"""A database of sequences from clips, and the end of a motion as it sees it."""

import numpy as np
import pytest

import motionenv
from motionenv.body import mirror
from motionenv.errors import MotionError
from motionenv.models.motion_tree.database import Clip, build_database, leg_length, recent_frames
from motionenv.models.motion_tree.features import parameters
from motionenv.models.transforms import scaled
from motionenv.types import Motion


@pytest.fixture(scope="module")
def clips():
    model = motionenv.load("walk/fpca")
    seconds = (2.0, 1.0, 11 / 30)
    return [
        Clip(model.synthesize(seconds=s, fps=30, seed=i, height=1.75), f"clip {i}", "walk", str(i % 2))
        for i, s in enumerate(seconds)
    ]


def test_windows_never_cross_sequences_and_have_successors(clips):
    database = build_database(clips)
    assert np.diff(database.starts).tolist() == [60, 30, 11]
    by_hand = [t for a, b in ((0, 60), (60, 90), (90, 101)) for t in range(b) if t - 9 >= a and t + 1 < b]
    assert database.windows.tolist() == by_hand
    assert database.sequence_of(database.windows).tolist() == [0] * 50 + [1] * 20 + [2]


def test_a_sequence_is_the_clip_from_the_origin(clips):
    database = build_database(clips)
    first = database.motion(0)
    np.testing.assert_allclose(first.poses[0, [0, 1, 5]], 0, atol=1e-7)
    np.testing.assert_allclose(parameters(first.poses)[:, :25], parameters(clips[0].motion.poses)[:, :25], atol=1e-5)
    assert (database.clips, database.activities, database.persons) == (
        ("clip 0", "clip 1", "clip 2"),
        ("walk",) * 3,
        ("0", "1", "0"),
    )


def test_mirror_images_follow_their_clips(clips):
    database = build_database(clips[:2], mirrored=True)
    assert database.mirrored.tolist() == [False, True, False, True]
    np.testing.assert_allclose(database.motion(1).poses, mirror(database.motion(0).poses), atol=1e-6)


def test_lengths_are_told_on_one_body(clips):
    tall = Clip(scaled(clips[0].motion, 1.95), "tall")
    database = build_database([clips[0], tall])
    np.testing.assert_allclose(database.motion(1).poses, database.motion(0).poses, atol=1e-6)
    on_tall = build_database([clips[0]], skeleton=tall.motion.skeleton)
    np.testing.assert_allclose(on_tall.poses[:, :3].max() / database.poses[:60, :3].max(), 1.95 / 1.75, rtol=1e-5)


def test_gaps_make_sequences_of_their_own(clips):
    poses = clips[0].motion.poses.copy()
    poses[30, 20] = np.nan
    database = build_database([Clip(Motion(poses, clips[0].motion.skeleton, 30.0), "gap")])
    assert np.diff(database.starts).tolist() == [30, 29]
    assert database.clips == ("gap", "gap")
    assert np.isfinite(database.poses).all()


def test_short_clips_are_reported_and_only_short_ones_refused(clips):
    short = Clip(Motion(clips[0].motion.poses[:10], clips[0].motion.skeleton, 30.0), "brief")
    told = []
    assert build_database([short, clips[1]], on_short=told.append).clips == ("clip 1",)
    assert told == ["brief"]
    with pytest.raises(MotionError, match=r"at least 11 frames at 30 frames/s .* only shorter ones, the last 'brief'"):
        build_database([short])
    with pytest.raises(MotionError, match="no clips at all"):
        build_database([])


def test_there_is_no_such_sequence(clips):
    with pytest.raises(MotionError, match=r"from 0 to 2, got 3"):
        build_database(clips).motion(3)


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
