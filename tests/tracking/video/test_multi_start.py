"""Several tracks of one film: mirrored starts, how well an outline is met, and that every frame gets its belief."""

from dataclasses import replace

import numpy as np
import pytest

from motionenv.body import from_height, markers
from motionenv.likelihoods import SilhouetteLikelihood
from motionenv.models.synthesis import synthesize
from motionenv.render import render
from motionenv.render.cameras import view
from motionenv.tracking import FPCAPrior
from motionenv.tracking.priors.base import Start
from motionenv.tracking.video.multi_start import MultiStart, _reflected, advantage, exchanged, overlap
from motionenv.tracking.video.survey import COLOURS, Look, colour_bins
from motionenv.types import MARKERS

CAMERA = view(0.0, width=96, height=96, distance=5.0)


@pytest.fixture(scope="module")
def walk():
    """Somebody who walks past for a second."""
    return synthesize("walk/fpca", 1.0, 20, seed=4, height=1.75)


def test_an_exchanged_start_is_the_mirror_image_in_the_plane_of_walking(walk):
    poses, skeleton = walk.poses, walk.skeleton
    start = Start.at(poses[7], poses[6])
    other = exchanged(start)
    heading = np.array([np.cos(poses[7, 5]), np.sin(poses[7, 5]), 0.0])
    aside = np.array([-heading[1], heading[0], 0.0])
    true, found = (markers(s.poses[0], skeleton) - [*poses[7, :2], 0.0] for s in (start, other))
    swapped = [MARKERS.index(m.replace("left", "*").replace("right", "left").replace("*", "right")) for m in MARKERS]
    np.testing.assert_allclose((found @ aside)[swapped], -(true @ aside), atol=1e-9)
    np.testing.assert_allclose((found @ heading)[swapped], true @ heading, atol=1e-9)
    np.testing.assert_allclose(exchanged(other).previous, start.previous, atol=1e-12)


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


def test_a_track_goes_both_ways_from_where_it_begins(walk):
    """Frames before the start are followed backwards; each is counted once, over all tracks."""
    poses = walk.poses - np.eye(25)[0] * walk.poses[:, :1].mean()
    film = (render(poses, walk.skeleton, CAMERA, rgb=False).limbs > 0).astype(np.float32)
    seen = Look(20.0, CAMERA, film, np.zeros(film.shape, np.uint16), np.zeros((20, 4)), np.zeros(20, dtype=bool))
    likelihood = SilhouetteLikelihood(CAMERA, walk.skeleton, misses=0.25, false_alarms=0.1, distance=5.0, threads=1)
    priors = (FPCAPrior(skeleton=walk.skeleton, fps=20.0, backwards=back) for back in (False, True))
    ticks = []
    starts = MultiStart(*priors, likelihood, seen, 6, 200, 1, np.random.default_rng(1))
    found = starts.best(2, ticks.append)
    assert ticks == list(range(1, 41))
    assert found.poses.shape == (20, 25)
    assert set(found.starts) >= {6}
    assert np.median(found.overlap) > 0.6
    assert (found.effective >= 1).all()
    for t in (0, 6, 19):
        shown, _ = overlap(found.poses[t], walk.skeleton, CAMERA, film[t])
        assert found.overlap[t] == pytest.approx(shown)
        spread = np.linalg.norm(found.particles[t, :, :3] - found.poses[t, :3], axis=-1)
        assert np.median(spread) < 0.5


def shown(walk, distance: float):
    """Poses, likelihood and a film of the walk; from far away, perspective tells nothing."""
    poses = walk.poses - np.eye(25)[0] * walk.poses[:, :1].mean()
    camera = view(0.0, width=128, height=96, distance=distance, fov_degrees=np.degrees(2 * np.arctan(1.3 / distance)))
    drawn = render(poses, walk.skeleton, camera)
    film = (drawn.limbs > 0).astype(np.float32)
    likelihood = SilhouetteLikelihood(
        camera, walk.skeleton, distance=distance, misses=0.25, false_alarms=0.1, threads=1
    )
    colours = np.stack([colour_bins(picture) for picture in drawn.rgb])
    return poses, likelihood, Look(20.0, camera, film, colours, np.zeros((20, 4)), np.zeros(20, dtype=bool))


def test_colours_tell_a_walker_from_his_mirror_image(walk):
    poses, likelihood, film = shown(walk, 100.0)
    mirrored = _reflected(poses)
    assert advantage(poses, mirrored, likelihood, film) > 10
    plain = replace(film, colours=np.zeros_like(film.colours))
    told = advantage(poses, mirrored, likelihood, film) - advantage(poses, mirrored, likelihood, plain)
    assert told > 10


def test_it_is_the_other_way_round_for_the_other_and_nothing_for_the_same(walk):
    poses, likelihood, film = shown(walk, 4.5)
    mirrored = _reflected(poses)
    there, back = (advantage(a, b, likelihood, film) for a, b in ((poses, mirrored), (mirrored, poses)))
    assert there == pytest.approx(-back, abs=1e-6)
    assert advantage(poses, poses, likelihood, film) == 0


def test_plain_clothes_leave_it_to_silhouettes(walk):
    poses, likelihood, film = shown(walk, 4.5)
    shifted = poses + 0.3 * np.eye(25)[0]
    silhouettes = 0.0
    for t, foreground in enumerate(film.foreground):
        likelihood.observe(mask=foreground)
        silhouettes += float(-np.diff(likelihood.log_likelihood(np.stack([poses[t], shifted[t]])))[0])
    plain = replace(film, colours=np.full_like(film.colours, COLOURS // 2))
    assert advantage(poses, shifted, likelihood, plain) == pytest.approx(silhouettes, rel=0.01)


def test_figures_beside_the_picture_say_nothing_of_colours(walk):
    poses, likelihood, film = shown(walk, 4.5)
    away = poses + 50.0 * np.eye(25)[0]
    assert np.isfinite(advantage(away, away - 100.0 * np.eye(25)[0], likelihood, film))
    assert advantage(poses, away, likelihood, film) > 10
