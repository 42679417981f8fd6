"""The likelihood of colours: limbs that only colours tell apart, changing light, threads, misuse."""

import numpy as np
import pytest

from motionenv.body import LIMBS, from_height
from motionenv.errors import MotionError
from motionenv.likelihoods.appearance import AppearanceLikelihood
from motionenv.render import Raycaster
from motionenv.render.cameras import view

CAMERA = view(0.0, width=96, height=96, distance=4.0)
COLOURS = np.random.default_rng(2).integers(0, 256, (18, 3))  # of background and limbs


def standing(n=1):
    poses = np.zeros((n, 25))
    poses[:, 2] = 0.93
    return poses


def painted(pose, noise=6.0, seed=0):
    """A picture in which each limb has a colour, and the background clutter."""
    rng = np.random.default_rng(seed)
    limbs = Raycaster().render(pose, from_height(), CAMERA, rgb=False).limbs
    behind = np.kron(rng.integers(0, 256, (12, 12, 3)), np.ones((8, 8, 1)))
    rgb = np.where(limbs[..., None] > 0, COLOURS[limbs], behind) + rng.normal(0, noise, (96, 96, 3))
    return np.clip(rgb, 0, 255).astype(np.uint8)


def clothed(labels, colours):
    """A picture of limbs in these colours before a grey wall."""
    return np.where(labels[..., None] > 0, colours[labels], 90).astype(np.uint8)


def test_the_true_pose_scores_best_where_silhouettes_say_nothing():
    """Arms that swing before the torso, legs that change places."""
    model, first = AppearanceLikelihood(CAMERA), standing()[0]
    first[[17, 21, 9, 13]] = 0.4, -0.4, -0.3, 0.3
    model.observe(rgb=painted(first))
    model.learn(first)
    true = standing()[0]
    true[[17, 21, 9, 13]] = 0.3, -0.3, -0.1, 0.15
    model.observe(rgb=painted(true, seed=1))
    mirrored = true.copy()
    mirrored[[17, 21]] = mirrored[[21, 17]]
    directions = np.random.default_rng(4).normal(size=(60, 25)) * np.r_[0.3, 0.3, 0.3, np.ones(22)]
    means = [model.log_likelihood(true + size * directions).mean() for size in (0.0, 0.1, 0.3, 0.6)]
    assert means == sorted(means, reverse=True)
    assert means[0] > model.log_likelihood(mirrored[None])[0] + 1


def test_colours_follow_the_light():
    model, pose = AppearanceLikelihood(CAMERA, rate=0.3), standing()[0]
    bright = painted(pose)
    model.observe(rgb=bright)
    model.learn(pose)
    before = model.log_likelihood(pose[None])[0]
    model.observe(rgb=bright // 2)
    darker = model.log_likelihood(pose[None])[0]
    for _ in range(10):
        model.learn(np.stack([pose, standing()[0] + 0.5]), np.array([0.0, -50.0]))
    assert model.log_likelihood(pose[None])[0] > darker + 1
    assert before > darker


def test_says_nothing_before_it_has_learned_and_after_it_forgot():
    model, poses = AppearanceLikelihood(CAMERA), standing(3)
    with pytest.raises(MotionError, match="observe"):
        model.log_likelihood(poses)
    model.observe(rgb=painted(poses[0]))
    np.testing.assert_array_equal(model.log_likelihood(poses), 0.0)
    model.learn(poses[0])
    assert model.log_likelihood(poses)[0] > 1.0
    model.forget()
    model.observe(rgb=painted(poses[0]))
    np.testing.assert_array_equal(model.log_likelihood(poses), 0.0)


def test_a_belief_that_takes_left_for_right_teaches_nothing_of_either():
    """Half of the belief looks away: what it takes for left is right. Then exchanged clothes are as good."""
    pose, camera = standing()[0], view(np.pi / 2, width=96, height=96, distance=4.0)
    turned = pose.copy()
    turned[5] = np.pi
    labels = Raycaster().render(pose, from_height(), camera, rgb=False).limbs
    sides = {"left": "right", "right": "left"}
    names = ["", *("_".join(sides.get(part, part) for part in limb.split("_")) for limb in LIMBS)]
    other = [["", *LIMBS].index(name) for name in names]
    loss = []
    for believed in (pose[None], np.stack([pose, turned])):
        model = AppearanceLikelihood(camera)
        model.observe(rgb=clothed(labels, COLOURS))
        model.learn(believed)
        score = model.log_likelihood(pose[None])[0]
        model.observe(rgb=clothed(labels, COLOURS[other]))
        loss.append(score - model.log_likelihood(pose[None])[0])
    assert loss[0] > 1.0
    assert abs(loss[1]) < 0.1 * loss[0]


def test_a_hidden_limb_keeps_its_colours():
    pose = standing()[0]
    shown, model = pose.copy(), AppearanceLikelihood(CAMERA, rate=0.5)
    shown[[17, 21]] = -0.9, 0.9
    model.observe(rgb=painted(shown))
    model.learn(shown)
    hidden = pose.copy()
    hidden[:2] = 300.0  # nobody in the picture
    alone = model.log_likelihood(np.stack([shown, pose]))
    for _ in range(20):
        model.learn(hidden)
    np.testing.assert_array_equal(np.argsort(model.log_likelihood(np.stack([shown, pose]))), np.argsort(alone))
    assert model.log_likelihood(shown[None])[0] > 0.5 * alone[0]


def test_any_number_of_threads_gives_the_same():
    poses = standing(600) + 0.2 * np.random.default_rng(0).normal(size=(600, 25))
    poses[:20, :2] += 4.0
    scores = []
    for threads in (1, 2, 3):
        model = AppearanceLikelihood(CAMERA, threads=threads)
        model.observe(rgb=painted(poses[-1]))
        model.learn(poses[-1])
        scores.append(model.log_likelihood(poses))
    assert np.isfinite(scores[0]).all()
    np.testing.assert_array_equal(scores[0], scores[1])
    np.testing.assert_array_equal(scores[0], scores[2])


def test_misuse():
    with pytest.raises(MotionError, match="outliers"):
        AppearanceLikelihood(CAMERA, outliers=0.0)
    with pytest.raises(MotionError, match="rate"):
        AppearanceLikelihood(CAMERA, rate=0.0)
    model = AppearanceLikelihood(CAMERA)
    with pytest.raises(MotionError, match="observe"):
        model.learn(standing())
    with pytest.raises(MotionError, match="rgb"):
        model.observe(rgb=np.zeros((9, 9, 3), np.uint8))
    model.observe(rgb=painted(standing()[0]))
    with pytest.raises(MotionError, match="poses"):
        model.log_likelihood(np.zeros((3, 24)))
    with pytest.raises(MotionError, match="log_weights"):
        model.learn(standing(), np.zeros(3))
    with pytest.raises(MotionError, match="log_weights"):
        model.learn(standing(), np.full(1, -np.inf))
