"""WalkerTracking: what is seen is what is there, and estimates are scored by it."""

import numpy as np
import pytest

from motionenv.body import markers
from motionenv.body.arm_reaching import REACH, RIGHT_ARM, reach
from motionenv.envs import ArmTracking, WalkerTracking, WalkerTrackingVector
from motionenv.errors import MotionError
from motionenv.metrics import energy_score, mpjpe
from motionenv.render import render
from motionenv.render.sensors.augmentation import FAR
from motionenv.types import MARKERS


def begun(seed: int = 0, **arguments):
    env = WalkerTracking(**{"observation": ("rgb", "mask", "depth"), "horizon": 30, **arguments})
    return env, env.reset(seed=seed)[0]


@pytest.mark.parametrize("camera", ["side", "front", 45, -120.5, "random", "follow"])
def test_pictures_show_the_truth(camera):
    env, seen = begun(camera=camera, seed=3)
    for _ in range(20):
        truth = env.truth()
        np.testing.assert_array_equal(truth["joints"], markers(truth["pose"], truth["skeleton"]))
        frame = render(truth["pose"], truth["skeleton"], truth["camera"])
        np.testing.assert_array_equal(seen["mask"][..., 0], np.where(frame.limbs > 0, 255, 0))
        body = frame.limbs > 0
        np.testing.assert_array_equal(seen["depth"][body, 0], frame.depth[body])
        assert (seen["depth"][~body] == FAR).all()
        seen, *_ = env.step(truth["pose"])


@pytest.mark.parametrize("camera", ["side", "front", "random", "follow"])
@pytest.mark.parametrize("motion", ["walk/fpca", "mixed/tree"])
def test_walkers_stay_in_view_and_reasonably_large(camera, motion):
    for seed in range(4):
        env, _ = begun(camera=camera, seed=seed, motion=motion, horizon=60)
        heights = []
        for _ in range(60):
            truth = env.truth()
            pixels, depth = truth["camera"].project(truth["joints"])
            assert (depth > 1.0).all()
            assert (pixels > -0.5).all()
            assert (pixels < 63.5).all()
            heights.append(np.ptp(pixels[:, 1]))
            env.step(truth["pose"])
        assert max(heights) > 12
        if camera == "follow":
            assert min(heights) > 20


def test_a_camera_that_follows_keeps_the_walker_in_the_middle_and_moves_the_background():
    env, first = begun(camera="follow", background="clutter", observation="rgb", clothes=False)
    fixed, _ = begun(camera="follow", background="plain", observation="rgb", clothes=False)
    x = []
    for _ in range(30):
        x.append(env.truth()["pose"][0])
        last, *_ = env.step(env.truth()["pose"])
        fixed.step(fixed.truth()["pose"])
    assert np.abs(x).max() < 0.2
    corner = np.s_[:20, :20]  # where there is no walker
    assert (first[corner] != last[corner]).mean() > 0.5


def test_joints_are_scored_by_distance():
    env, _ = begun(estimate="joints", seed=2)
    for shift in ([0.0, 0.0, 0.0], [0.3, 0.0, -0.4], [0.0, 0.1, 0.0]):
        joints = env.truth()["joints"] + shift
        expected = mpjpe(joints, env.truth()["joints"])
        _, reward, _, _, info = env.step(joints)
        assert info["error"] == pytest.approx(expected)
        assert info["error"] == pytest.approx(np.linalg.norm(shift))
        assert reward == -info["error"]


def test_poses_are_put_on_the_true_body():
    env, _ = begun(seed=2)
    truth = env.truth()
    pose = truth["pose"] + np.random.default_rng(0).normal(0, 0.1, 25)
    expected = mpjpe(markers(pose, truth["skeleton"]), truth["joints"])
    _, reward, _, _, info = env.step(pose)
    assert info["error"] == pytest.approx(expected)
    assert reward == -info["error"]


def test_beliefs_are_scored_properly():
    env, _ = begun(estimate="belief", n_belief=40, seed=2)
    rng = np.random.default_rng(0)
    truth = env.truth()
    poses = truth["pose"] + rng.normal(0, 0.1, (40, 25))
    weights = rng.normal(0, 1, 40)
    joints = markers(poses, truth["skeleton"])
    score = energy_score(joints[None], weights[None], truth["joints"][None])[0]
    mean = np.average(joints, axis=0, weights=np.exp(weights))
    _, reward, _, _, info = env.step(np.column_stack([poses, weights]))
    assert reward == pytest.approx(-score / np.sqrt(15))
    assert info["error"] == pytest.approx(mpjpe(mean, truth["joints"]))
    truth = env.truth()  # a belief that is sure of itself and right is as good as can be
    _, reward, *_ = env.step(np.tile([*truth["pose"], 0.0], (40, 1)))
    assert reward == pytest.approx(0.0, abs=1e-6)


def test_the_observation_model_prefers_the_truth():
    for observation in ("mask", "depth"):
        env, _ = begun(observation=observation, seed=4)
        rng = np.random.default_rng(0)
        for _ in range(3):
            truth = env.truth()
            poses = np.concatenate([truth["pose"][None], truth["pose"] + rng.normal(0, 0.3, (50, 25))])
            scores = env.observation_model.log_likelihood(poses)
            assert scores.argmax() == 0
            assert env.observation_model is env.observation_model
            env.step(truth["pose"])


def test_the_observation_model_doesnt_know_the_body():
    env, _ = begun(seed=1)
    assert env.observation_model.skeleton.height != env.truth()["skeleton"].height


def test_neither_observation_nor_info_holds_the_truth():
    env, seen = begun(seed=0)
    assert set(seen) == {"rgb", "mask", "depth"}
    truth = env.truth()
    _, _, _, _, info = env.step(truth["pose"])
    assert set(info) == {"error", "lost"}


def test_randomised_looks():
    envs = WalkerTrackingVector(12, clothes=True, horizon=5)
    first, _ = envs.reset(seed=0)
    assert len({truth["skeleton"].height for truth in envs.truth()}) > 8
    plain = WalkerTrackingVector(2, clothes=False, horizon=5)
    plain.reset(seed=0)
    stage = plain.world.stage
    np.testing.assert_array_equal(stage.colours[0], stage.colours[1])
    assert len(np.unique(envs.world.stage.colours[:, 1], axis=0)) == 12
    assert len(np.unique(first.reshape(12, -1), axis=0)) == 12


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        ({"size": 0}, "size"),
        ({"size": 35}, "size"),
        ({"size": 512}, "size"),
        ({"size": 64.5}, "size"),
        ({"observation": "sound"}, "observation"),
        ({"observation": ()}, "observation"),
        ({"observation": None}, "observation"),
        ({"observation": 5}, "observation"),
        ({"observation": [["rgb"]]}, "observation"),
        ({"observation": ("rgb", "rgb")}, "observation"),
        ({"camera": "above"}, "camera"),
        ({"camera": np.nan}, "camera"),
        ({"camera": True}, "camera"),
        ({"background": "beach"}, "background"),
        ({"distractors": -1}, "distractors"),
        ({"occluders": 1.5}, "occluders"),
        ({"noise": -1.0}, "noise"),
        ({"brightness": 1.0}, "brightness"),
        ({"estimate": "guess"}, "estimate"),
        ({"estimate": "belief", "n_belief": 0}, "n_belief"),
        ({"clothes": "yes"}, "clothes"),
        ({"fps": 1e9}, "fps"),
        ({"lost_after": 0.0}, "lost_after"),
        ({"lost_after": True}, "lost_after"),
        ({"lost_after": "far"}, "lost_after"),
        ({"render_mode": "ansi"}, "render_mode"),
    ],
)
@pytest.mark.parametrize("make", [WalkerTracking, ArmTracking])
def test_impossible_arguments_are_named_when_it_is_made(make, arguments, why):
    with pytest.raises(MotionError, match=why):
        make(**arguments)


def test_unknown_arguments_are_named():
    with pytest.raises(TypeError, match="colour"):
        WalkerTracking(colour="red")


class TestArm:
    def test_only_the_right_arm_moves_and_the_shoulder_stays_in_the_middle(self):
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

    def test_elbow_and_wrist_are_scored(self):
        env = ArmTracking(estimate="joints")
        env.reset(seed=0)
        said = env.truth()["joints"][[6, 8]] + [[0.1, 0, 0], [0, 0.3, 0]]
        *_, info = env.step(said)
        assert info["error"] == pytest.approx(0.2)

    def test_beliefs_are_scored_over_elbow_and_wrist(self):
        env = ArmTracking(estimate="belief", n_belief=2)
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

    def test_reaching_is_smooth_and_within_its_range(self):
        for seed in range(5):
            angles = reach(600, 60.0, np.random.default_rng(seed))
            assert angles.shape == (600, 4)
            assert (angles >= REACH[:, 0]).all()
            assert (angles <= REACH[:, 1]).all()
            assert np.ptp(angles, axis=0).min() > 0.5
            # Least jerk over one second at least half: speed at most 1.875 · distance / duration.
            fastest = 1.875 * np.ptp(REACH, axis=1) / 0.5
            assert (np.abs(np.diff(angles, axis=0)) * 60 <= fastest).all()

    def test_standing_feet_are_on_the_ground(self):
        env = ArmTracking()
        env.reset(seed=0)
        truth = env.truth()
        frame = render(truth["pose"], truth["skeleton"], truth["camera"])
        assert frame.limbs.any()
        ankles = truth["joints"][[13, 14], 2]
        np.testing.assert_allclose(ankles, 0.039 * truth["skeleton"].height, atol=1e-9)
