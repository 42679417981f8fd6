"""The network in NumPy against PyTorch, and what its input must not depend on."""

import numpy as np
import pytest

from motionenv.lifting.free.posture_network import PostureNetwork, features
from motionenv.lifting.free.proposal import shipped_network

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
