"""WalkerTracking and ArmTracking: what is seen is what is there, and estimates are scored by it."""

import numpy as np
import pytest

from motionenv.body import markers
from motionenv.body.arm_reaching import REACH, RIGHT_ARM, reach
from motionenv.envs import ArmTracking, WalkerTracking
from motionenv.errors import MotionError
from motionenv.render import render
from motionenv.types import MARKERS
from tests.envs.playing import begun


def test_neither_observation_nor_info_holds_the_truth():
    env, seen = begun(seed=0)
    assert set(seen) == {"rgb", "mask", "depth"}
    truth = env.truth()
    _, _, _, _, info = env.step(truth["pose"])
    assert set(info) == {"error", "lost"}


def headings(**arguments) -> np.ndarray:
    """(episodes, frames) [rad]."""
    env, found = WalkerTracking(size=36, start="line", actions="metric", **arguments), []
    for seed in range(6):
        env.reset(seed=seed)
        found.append([])
        for _ in range(90):
            found[-1].append(env.truth()["pose"][5])
            env.step(np.zeros(25))
    return np.array(found)


def test_on_a_turning_path_walkers_turn():
    straight, turning = headings(), headings(path="turning")
    assert np.ptp(straight, axis=1).max() < 0.5
    assert np.mean(np.ptp(turning, axis=1)) > 0.6
    assert (np.sign(turning[:, -1] - turning[:, 0]) > 0).any()  # some left
    assert (np.sign(turning[:, -1] - turning[:, 0]) < 0).any()  # and some right


#: What is allowed, and what isn't.
REFUSED = {
    "size must be a whole number of pixels from 36 to 256": [{"size": size} for size in (0, 35, 512, 64.5, "large")],
    "observation must be one of rgb, mask, depth, joints, or several different ones": [
        {"observation": shown} for shown in ("sound", (), None, 5, [["rgb"]], ("rgb", "rgb"))
    ],
    "camera must be side, front, random,.* or a view angle in degrees": [
        {"camera": camera} for camera in ("above", np.nan, np.inf, True, None, [30])
    ],
    "background": [{"background": "beach"}],
    "distractors": [{"distractors": -1}],
    "occluders": [{"occluders": 1.5}],
    "noise": [{"noise": -1.0}],
    "brightness": [{"brightness": 1.0}],
    "alone must be a number of seconds": [{"alone": -1.0}, {"alone": np.inf}],
    "estimate must be one of pose, joints, belief": [{"estimate": "guess"}],
    "n_belief must be a whole number of poses from 1 to 4096": [{"n_belief": 0}, {"n_belief": 4097}],
    "actions must be one of normalised, metric": [{"actions": "raw"}],
    "clothes must be True or False": [{"clothes": "yes"}],
    "fps": [{"fps": 1e9}],
    "lost_after must be a number of metres above 0": [{"lost_after": after} for after in (0.0, True, "far")],
    "render_mode must be None or rgb_array": [{"render_mode": "ansi"}],
}


@pytest.mark.parametrize("make", [WalkerTracking, ArmTracking])
@pytest.mark.parametrize("allowed", REFUSED)
def test_impossible_arguments_are_named_when_it_is_made(make, allowed):
    for arguments in REFUSED[allowed]:
        with pytest.raises(MotionError, match=f"{allowed}.*, got"):
            make(**arguments)


@pytest.mark.parametrize(
    ("arguments", "allowed"),
    [({"start": "left"}, "line, near, anywhere"), ({"path": "round"}, "straight, turning")],
)
def test_impossible_walks_are_refused(arguments, allowed):
    with pytest.raises(MotionError, match=f"must be one of {allowed}, got"):
        WalkerTracking(**arguments)


def test_only_the_right_arm_moves_and_the_shoulder_stays_in_the_middle():
    for motion in ("reach", "walk/fpca"):
        env = ArmTracking(motion=motion, camera="random", horizon=30)
        env.reset(seed=1)
        first, moved = env.truth(), 0.0
        for _ in range(30):
            env.step(np.zeros(4))
            truth = env.truth()
            still = np.delete(np.arange(25), RIGHT_ARM)
            np.testing.assert_array_equal(truth["pose"][still], first["pose"][still])
            moved = max(moved, np.abs(truth["pose"] - first["pose"]).max())
            shoulder = truth["joints"][MARKERS.index("right_shoulder")]
            np.testing.assert_allclose(truth["camera"].project(shoulder)[0], 31.5, atol=1e-6)
            pixels, _ = truth["camera"].project(truth["joints"][[6, 8]])
            assert ((pixels > 0) & (pixels < 63)).all()
        assert moved > 0.1


def test_elbow_and_wrist_are_scored():
    env = ArmTracking(estimate="joints", actions="metric")
    env.reset(seed=0)
    said = env.truth()["joints"][[6, 8]] + [[0.1, 0, 0], [0, 0.3, 0]]
    *_, info = env.step(said)
    assert info["error"] == pytest.approx(0.2)


def test_beliefs_are_scored_over_elbow_and_wrist():
    env = ArmTracking(estimate="belief", n_belief=2, actions="metric")
    env.reset(seed=0)
    truth = env.truth()
    angles = truth["pose"][list(RIGHT_ARM)] + [[0.3, 0, 0, 0], [-0.1, 0, 0.2, 0.1]]
    poses = np.tile(truth["pose"], (2, 1))
    poses[:, RIGHT_ARM] = angles
    x = markers(poses, truth["skeleton"])[:, [6, 8]].reshape(2, 6)
    y = truth["joints"][[6, 8]].reshape(6)
    expected = np.linalg.norm(x - y, axis=1).mean() - 0.25 * np.linalg.norm(x[0] - x[1])
    _, reward, *_ = env.step(np.column_stack([angles, [0.0, 0.0]]))
    assert reward == pytest.approx(-expected / np.sqrt(2), rel=1e-5)


def test_reaching_is_smooth_and_within_its_range():
    for seed in range(5):
        angles = reach(600, 60.0, np.random.default_rng(seed))
        assert angles.shape == (600, 4)
        assert (angles >= REACH[:, 0]).all()
        assert (angles <= REACH[:, 1]).all()
        assert np.ptp(angles, axis=0).min() > 0.5
        # Least jerk over one second at least half: speed at most 1.875 · distance / duration.
        fastest = 1.875 * np.ptp(REACH, axis=1) / 0.5
        assert (np.abs(np.diff(angles, axis=0)) * 60 <= fastest).all()


def test_standing_feet_are_on_the_ground():
    env = ArmTracking()
    env.reset(seed=0)
    truth = env.truth()
    frame = render(truth["pose"], truth["skeleton"], truth["camera"])
    assert frame.limbs.any()
    ankles = truth["joints"][[13, 14], 2]
    np.testing.assert_allclose(ankles, 0.039 * truth["skeleton"].height, atol=1e-9)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"speed": (1.0, 1.2)}, "speed needs a walking motion: omit it for motion 'reach'"),
        ({"motion_seed": 1}, "motion_seed needs a model as motion: omit it for motion 'reach'"),
        ({"camera": "follow"}, "camera must be side, front, random, or a view angle in degrees, got 'follow'"),
    ],
)
def test_what_only_walkers_have_is_refused(arguments, says):
    with pytest.raises(MotionError, match=says):
        ArmTracking(**arguments)


def test_splits_share_no_reaching():
    def seen(split: str) -> set:
        env = ArmTracking(split=split, horizon=3)
        return {env.truth()["skeleton"].height for seed in range(20) if env.reset(seed=seed)}

    train, evaluation = seen("train"), seen("eval")
    assert min(len(train), len(evaluation)) > 15
    assert not train & evaluation
