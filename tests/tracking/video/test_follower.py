"""A track that detections guide: starts and gaps, how well an outline is met, and that every frame gets its belief."""

from dataclasses import replace

import numpy as np
import pytest

from motionenv.body import from_height, markers
from motionenv.likelihoods import SilhouetteLikelihood
from motionenv.models.synthesis import synthesize
from motionenv.render import render
from motionenv.render.cameras import view
from motionenv.tracking import FPCAPrior
from motionenv.tracking.video.follower import Follower, overlap
from motionenv.tracking.video.guide import Guide
from motionenv.tracking.video.survey import Look

CAMERA = view(0.0, width=96, height=96, distance=5.0)


def test_overlap_is_what_both_show_of_what_either_shows_and_of_the_body():
    body = from_height()
    pose = np.eye(25)[2] * 0.93
    there = render(pose, body, CAMERA, rgb=False).limbs > 0
    assert overlap(pose, body, CAMERA, there.astype(float)) == (1.0, 1.0)
    upper = there & (np.arange(96) < 48)[:, None]
    assert overlap(pose, body, CAMERA, 0.9 * upper)[0] == pytest.approx(upper.sum() / there.sum())
    assert overlap(pose, body, CAMERA, 0.4 * there) == (0.0, 0.0)
    assert overlap(pose + np.eye(25)[1] * 1e6, body, CAMERA, np.zeros((96, 96))) == (0.0, 0.0)
    other = upper | (np.arange(96) > 80)  # somebody else beside
    share = (there & other).sum() / there.sum()
    assert overlap(pose, body, CAMERA, 0.9 * other)[1] == pytest.approx(share)


def test_silhouettes_go_on_in_the_gaps_of_the_guide():
    walk = synthesize("walk/fpca", 1.5, 20, seed=4, height=1.75)
    poses = walk.poses - np.eye(25)[0] * walk.poses[:, :1].mean()
    film = (render(poses, walk.skeleton, CAMERA, rgb=False).limbs > 0).astype(np.float32)
    seen = Look(20.0, CAMERA, film, np.zeros((30, 4)), np.zeros(30, dtype=bool))
    gaps = poses.copy()
    gaps[[1, *range(12, 22)]] = np.nan
    guide = Guide(gaps, walk.skeleton, CAMERA.project(markers(poses, walk.skeleton))[0])
    likelihood = SilhouetteLikelihood(CAMERA, walk.skeleton, misses=0.25, false_alarms=0.1, distance=5.0, threads=1)
    prior = FPCAPrior(skeleton=walk.skeleton, fps=20.0)
    ticks = []
    follower = Follower(prior, likelihood, seen, guide, 300, 1, np.random.default_rng(1))
    found = follower.followed(ticks.append)
    assert ticks == list(range(1, 31))
    off = np.linalg.norm(markers(found.poses, walk.skeleton) - markers(poses, walk.skeleton), axis=-1).mean(axis=1)
    assert off[guide.known].max() < 0.06
    assert np.median(off[12:22]) < 0.15
    assert np.median(found.overlap) > 0.7
    assert (found.effective >= 1).all()
    for t in (0, 15, 29):
        shown, alone = overlap(found.poses[t], walk.skeleton, CAMERA, film[t])
        assert found.overlap[t] == pytest.approx(shown)
        assert np.median(np.linalg.norm(found.particles[t, :, :3] - found.poses[t, :3], axis=-1)) < 0.5
    one = replace(follower, seen=replace(seen, merged=np.ones(30, dtype=bool)), rng=np.random.default_rng(1))
    again = one.followed(ticks.append)
    np.testing.assert_array_equal(again.poses, found.poses)
    assert again.overlap[29] == pytest.approx(alone)
