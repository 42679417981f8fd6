"""Which attempt shows a film better: the walker, or his mirror image with all but the same outline from the side."""

import numpy as np
import pytest

from motionenv.likelihoods import SilhouetteLikelihood
from motionenv.likelihoods.appearance import COLOURS, colour_bins
from motionenv.models.synthesis import synthesize
from motionenv.render import render
from motionenv.render.cameras import view
from motionenv.tracking.video.model_selection import advantage
from motionenv.tracking.video.multi_start import _reflected


@pytest.fixture(scope="module")
def walk():
    return synthesize("walk/fpca", 1.5, 20, seed=4, height=1.75)


def shown(walk, distance: float):
    """Likelihood, foregrounds and colours of a film of the walk; from far away, perspective tells nothing."""
    poses = walk.poses - np.eye(25)[0] * walk.poses[:, :1].mean()
    camera = view(0.0, width=128, height=96, distance=distance, fov_degrees=np.degrees(2 * np.arctan(1.3 / distance)))
    drawn = render(poses, walk.skeleton, camera)
    film = (drawn.limbs > 0).astype(np.float32)
    likelihood = SilhouetteLikelihood(
        camera, walk.skeleton, distance=distance, misses=0.25, false_alarms=0.1, threads=1
    )
    return poses, likelihood, film, np.stack([colour_bins(picture) for picture in drawn.rgb])


def test_colours_tell_a_walker_from_his_mirror_image(walk):
    poses, likelihood, film, colours = shown(walk, 100.0)
    mirrored = _reflected(poses)
    assert advantage(poses, mirrored, likelihood, film, colours) > 10
    plain = np.zeros_like(colours)
    told = advantage(poses, mirrored, likelihood, film, colours) - advantage(poses, mirrored, likelihood, film, plain)
    assert told > 10


def test_it_is_the_other_way_round_for_the_other_and_nothing_for_the_same(walk):
    poses, likelihood, film, colours = shown(walk, 4.5)
    mirrored = _reflected(poses)
    there, back = (advantage(a, b, likelihood, film, colours) for a, b in ((poses, mirrored), (mirrored, poses)))
    assert there == pytest.approx(-back, abs=1e-6)
    assert advantage(poses, poses, likelihood, film, colours) == 0


def test_plain_clothes_leave_it_to_silhouettes(walk):
    poses, likelihood, film, colours = shown(walk, 4.5)
    shifted = poses + 0.3 * np.eye(25)[0]
    silhouettes = 0.0
    for t, foreground in enumerate(film):
        likelihood.observe(mask=foreground)
        silhouettes += float(-np.diff(likelihood.log_likelihood(np.stack([poses[t], shifted[t]])))[0])
    plain = np.full_like(colours, COLOURS // 2)
    assert advantage(poses, shifted, likelihood, film, plain) == pytest.approx(silhouettes, rel=0.01)


def test_figures_beside_the_picture_say_nothing_of_colours(walk):
    poses, likelihood, film, colours = shown(walk, 4.5)
    away = poses + 50.0 * np.eye(25)[0]
    assert np.isfinite(advantage(away, away - 100.0 * np.eye(25)[0], likelihood, film, colours))
    assert advantage(poses, away, likelihood, film, colours) > 10
