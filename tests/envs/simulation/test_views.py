"""People are in the picture, wherever the camera is."""

import numpy as np
import pytest

from motionenv.body import from_height, markers
from motionenv.envs.simulation.views import EYE, ArmView, WalkingView, drawn_angle, level
from motionenv.types import MARKERS
from tests.envs.playing import begun


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


def test_a_level_camera_sees_the_walker_at_the_papers_angle():
    """At 0 +x goes to the right of the picture; at 90 degrees who walks along +x comes towards the camera."""
    x, up = np.eye(3)[0], np.eye(3)[2]
    np.testing.assert_allclose(level(0.0) @ x, [1, 0, 0], atol=1e-12)
    np.testing.assert_allclose(level(np.pi / 2) @ x, [0, 0, -1], atol=1e-12)
    for angle in np.linspace(-3, 3, 7):
        turn = level(angle)
        np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(turn) == pytest.approx(1.0)
        np.testing.assert_allclose(turn @ up, [0, -1, 0], atol=1e-12)


@pytest.mark.parametrize("camera", ["side", "front", 30, "random"])
def test_a_walk_is_put_in_the_middle_and_seen_from_eye_height(camera):
    poses = np.zeros((50, 25))
    poses[:, 0], poses[:, 1], poses[:, 2] = np.linspace(7, 11, 50), 5.0, 0.9
    placed = WalkingView(camera, 30.0).place(poses, from_height(1.8), np.random.default_rng(0))
    np.testing.assert_allclose(np.ptp(poses[:, 0]), 4.0)
    np.testing.assert_allclose(poses[:, :2].min(0) + poses[:, :2].max(0), 0, atol=1e-12)
    assert (-placed.R.T @ placed.t)[2] == pytest.approx(EYE)
    assert not placed.way.any()
    assert placed.behind > placed.t[2]


@pytest.mark.parametrize(("start", "most", "deep"), [("near", np.pi / 6, 2.0), ("anywhere", np.pi / 2, 4.0)])
def test_people_walk_anywhere_in_view(start, most, deep):
    rng, view, body = np.random.default_rng(0), WalkingView("side", 30.0, 3.0, start), from_height(1.8)
    headings, middles = [], []
    for _ in range(300):
        poses = np.zeros((91, 25))
        poses[:, 0], poses[:, 2] = np.linspace(0, 4, 91), 0.9
        placed = view.place(poses, body, rng)
        way = poses[-1, :2] - poses[0, :2]
        np.testing.assert_allclose(np.hypot(*way), 4.0)
        headings.append(poses[0, 5])
        np.testing.assert_allclose(np.exp(1j * headings[-1]), complex(*way) / 4.0, atol=1e-9)
        seen = poses[:, :3] @ placed.R.T + placed.t
        assert (np.abs(seen[:, 0]) + 0.55 <= 0.364 * seen[:, 2] + 1e-6).all()
        assert placed.t.tolist() == [0.0, 1.1, 8.0]
        assert placed.away == pytest.approx(seen[:, 2].mean(), abs=1e-6)
        assert np.abs(poses[:, :2]).max() < view.reach
        middles.append(poses[:, :2].mean(0))
    tilts = np.abs(np.arcsin(np.sin(headings)))
    assert 0.8 * most < tilts.max() <= most
    assert 0.4 < np.mean(np.cos(headings) > 0) < 0.6
    assert np.ptp(middles, axis=0).min() > 1.5
    assert np.ptp([m[1] for m in middles]) > deep


def test_a_camera_that_follows_goes_as_far_as_the_walker():
    poses = np.zeros((91, 25))
    poses[:, 0], poses[:, 2] = 1.3 * np.arange(91) / 30, 0.9
    placed = WalkingView("follow", 30.0).place(poses, from_height(1.8), np.random.default_rng(0))
    np.testing.assert_allclose(poses[:, :2], 0, atol=1e-9)
    np.testing.assert_allclose(placed.way, 1.3 * np.arange(91) / 30, atol=1e-9)


def test_an_arms_shoulder_is_on_the_axis():
    poses, body = np.zeros((3, 25)), from_height(1.8)
    for seed in range(5):
        placed = ArmView("random").place(poses, body, np.random.default_rng(seed))
        shoulder = placed.R @ markers(poses[0], body)[MARKERS.index("right_shoulder")] + placed.t
        np.testing.assert_allclose(shoulder, [0, 0, 2.4], atol=1e-12)


def test_angles_are_named_given_or_drawn_from_the_whole_circle():
    rng = np.random.default_rng(0)
    assert [drawn_angle(a, rng) for a in ("side", "front", 45)] == pytest.approx([0, np.pi / 2, np.pi / 4])
    drawn = np.array([drawn_angle("random", rng) for _ in range(2000)])
    assert np.histogram(drawn, 4, (-np.pi, np.pi))[0].min() > 400
