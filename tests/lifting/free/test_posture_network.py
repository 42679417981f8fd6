"""The network against PyTorch, what its input must not depend on, and the postures that it proposes."""

import numpy as np
import pytest

from motionenv.body import markers
from motionenv.lifting.free.posture_network import BODY_UNIT, PostureNetwork, features, propose, shipped_network
from motionenv.models.eigenwalkers.fourier_series import OTHER_SIDE
from motionenv.models.synthesis import synthesize

RNG = np.random.default_rng(1)
DIRECTIONS = RNG.normal(0, 0.1, (2, 40, 15, 2))
SEEN = RNG.uniform(size=(2, 40, 15)) < 0.8


def test_it_computes_what_pytorch_does():
    torch = pytest.importorskip("torch")
    from benchmarks.free_walking.train import Network

    torch.manual_seed(0)
    network = Network(features(DIRECTIONS, SEEN).values.shape[-1], channels=24)
    for parameter in network.parameters():  # as stored: in half precision
        parameter.data = parameter.data.half().float()
    values = features(DIRECTIONS, SEEN).values
    with torch.no_grad():
        posture, spread = network(torch.from_numpy(values))
    ours = PostureNetwork(network.arrays()).forward(values)
    np.testing.assert_allclose(ours[0], posture.numpy(), atol=1e-5)
    np.testing.assert_allclose(ours[1], spread.numpy(), atol=1e-5)


def test_place_distance_and_what_is_not_seen_do_not_matter():
    plain = features(DIRECTIONS, SEEN)
    hidden = np.where(SEEN[..., None], DIRECTIONS, 77.0)
    np.testing.assert_array_equal(features(hidden, SEEN).values, plain.values)
    turned = features(np.add(DIRECTIONS, [0.7, 0.0]), SEEN)
    np.testing.assert_allclose(turned.values, plain.values, atol=1e-5)
    np.testing.assert_allclose(turned.azimuth - plain.azimuth, 0.7)
    level = DIRECTIONS * [1, 0]
    np.testing.assert_allclose(features(0.5 * level, SEEN).values, features(level, SEEN).values, atol=1e-5)


def test_the_shipped_one_is_small_enough_and_certain_of_something():
    network = shipped_network()
    assert sum(w.size for w in network.weights.values()) * 2 < 3e6
    posture, spread = network.forward(features(DIRECTIONS, SEEN).values)
    assert np.isfinite(posture).all()
    assert (spread > 0).all()


MOTION = synthesize("walk/eigenwalkers", 4, 30, seed=3)
PLACES = markers(MOTION.poses, MOTION.skeleton) - [0, 4.5, 1.2]
RAYS = PLACES / np.linalg.norm(PLACES, axis=-1, keepdims=True)
NETWORK = shipped_network()


def test_postures_turn_with_the_rays():
    c, s = np.cos(2.5), np.sin(2.5)
    turn = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    one, other = propose(NETWORK, RAYS, 30), propose(NETWORK, RAYS @ turn, 30)
    np.testing.assert_allclose(other.posture, one.posture @ turn, atol=2e-4)
    np.testing.assert_allclose(other.spread, one.spread, atol=2e-4)


def test_mirror_images_give_mirror_images():
    one, other = propose(NETWORK, RAYS, 30), propose(NETWORK, RAYS[:, OTHER_SIDE] * [1, -1, 1], 30)
    np.testing.assert_allclose(other.posture[:, OTHER_SIDE] * [1, -1, 1], one.posture, atol=2e-4)


def test_they_are_near_the_truth():
    truth = PLACES - PLACES[:, [2]]
    off = np.linalg.norm(propose(NETWORK, RAYS, 30).posture * BODY_UNIT - truth, axis=-1)
    assert off.mean() < 0.06


@pytest.mark.parametrize(("frames", "fps"), [(8, 15.0), (15, 60.0), (120, 30.0), (700, 30.0), (50, 9.0)])
def test_any_length_and_rate_will_do(frames, fps):
    rays = np.tile(RAYS, (6, 1, 1))[:frames]
    rays[1:3] = np.nan
    made = propose(NETWORK, rays, fps)
    assert made.posture.shape == (frames, 15, 3)
    assert np.isfinite(made.posture).all()
    assert (made.spread > 0).all()


@pytest.mark.parametrize("every", [2, 3])
def test_frames_between_those_that_a_detector_saw_are_near_the_truth(every):
    """Of a film at `every` times 15 fps, of which the detector took every frame of 15 a second: one stream sees."""
    rays = np.full((len(RAYS), 15, 3), np.nan)
    rays[::every] = RAYS[::every]
    made = propose(NETWORK, rays, 15.0 * every)
    off = np.linalg.norm(made.posture * BODY_UNIT - (PLACES - PLACES[:, [2]]), axis=-1)
    assert off.mean() < 0.1
    assert (made.spread > 0).all()
