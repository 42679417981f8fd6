"""What counts as followed, on tracks whose faults are put in by hand."""

import numpy as np

from motionenv.tracking.video.verdict import FOLLOWED, HIDDEN, JUMP, MISFIT, TOO_LITTLE, losses, verdict

FPS, FRAMES = 20.0, 60


def judged(**faults) -> np.ndarray:
    """The verdict on a perfect track with other values given as {name: (slice, value)}."""
    values = {
        "poses": np.zeros((FRAMES, 25)), "overlap": np.full(FRAMES, 0.8), "seen": np.ones(FRAMES, dtype=bool),
    }  # fmt: skip
    for name, (where, value) in faults.items():
        values.setdefault(name, np.full(FRAMES, np.nan))[where] = value
    return verdict(values["poses"], values["overlap"], values["seen"], FPS, values.get("off"))


def test_a_perfect_track_is_followed_and_each_fault_has_its_reason():
    part = slice(20, 40)
    assert (judged() == FOLLOWED).all()
    for fault, reason in (
        ({"overlap": (part, 0.2)}, MISFIT), ({"seen": (part, False)}, HIDDEN),
    ):  # fmt: skip
        found = judged(**fault)
        assert (found[22:38] == reason).all()
        assert (found[:17] == FOLLOWED).all()
        assert (found[43:] == FOLLOWED).all()
    found = judged(poses=(slice(30, None), 4.0))
    assert set(found[26:30]) == {JUMP}
    assert (found[:20] == FOLLOWED).all()


def test_one_bad_frame_is_no_loss_and_one_good_frame_no_find():
    """The overlap is averaged over a quarter of a second, without frames that show nothing."""
    assert (judged(overlap=(slice(30, 31), 0.0)) == FOLLOWED).all()
    overlap = np.full(FRAMES, 0.7)
    overlap[20:40], overlap[30] = 0.3, 0.9
    assert (judged(overlap=(slice(None), overlap))[22:38] == MISFIT).all()
    assert (np.flatnonzero(judged(seen=(slice(30, 33), False), overlap=(slice(30, 33), 0.0))) == [30, 31, 32]).all()


def test_a_short_agreement_by_chance_is_none():
    overlap = np.full(FRAMES, 0.1)
    overlap[30:40] = 0.9
    assert (judged(overlap=(slice(None), overlap))[30:40] == TOO_LITTLE).any()
    assert FOLLOWED not in judged(overlap=(slice(None), overlap))


def test_losses_are_runs_in_order():
    found = losses(judged(overlap=(slice(20, 40), 0.2)))
    assert [loss.reason for loss in found] == ["the outline doesn't fit the body"]
    assert 17 <= found[0].first <= 21
    assert 38 <= found[0].last <= 42
    assert not found[0].left


def test_detections_that_fit_hold_without_an_outline_and_others_change_nothing():
    part = slice(20, 40)
    for fault in ({"overlap": (part, 0.2)}, {"seen": (part, False)}):
        assert (judged(**fault, off=(slice(15, 45), 0.02)) == FOLLOWED).all()
        for far in (0.1, np.nan):
            np.testing.assert_array_equal(judged(**fault, off=(part, far)), judged(**fault))
    assert set(judged(poses=(slice(30, None), 4.0), off=(slice(None), 0.0))[26:30]) == {JUMP}
