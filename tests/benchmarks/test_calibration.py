"""What the calibration and peer benchmarks measure with, against brute force and closed forms."""

import numpy as np
import pytest
from scipy.stats import kstest, multivariate_normal, norm

from benchmarks.tracking import calibration, peers
from motionenv.envs.agents.particle_filter import adults_prior
from motionenv.render.cameras import view
from motionenv.tracking import Belief, ParticleFilter
from motionenv.tracking.priors.guided import GuidedState


def test_levels_are_shares_of_the_belief_below_the_truth():
    rng, camera = np.random.default_rng(3), view(0.0, distance=5.0, width=32, height=32)
    poses = 0.3 * rng.standard_normal((500, 25))
    logs = rng.standard_normal(500)
    logs -= np.logaddexp.reduce(logs)
    truth = np.zeros(25)
    truth[5] = 2 * np.pi  # the same heading
    found = calibration.levels(Belief(GuidedState(poses, 0), logs, 1.0, 1.0, 0.0, False), truth, 1.0, camera)
    weights = np.exp(logs)
    away = poses[:, 1]  # the camera stands at y = -5 and looks along y
    assert found[0] == pytest.approx(weights[away < 0].sum())
    assert found[1] == pytest.approx(weights[-poses[:, 0] < 0].sum())
    assert found[3] == pytest.approx(weights[poses[:, 5] < 0].sum())
    assert found[4] == pytest.approx(0.5)  # all have the true size
    assert found[calibration.AXES.index("right_knee_flexion")] == pytest.approx(weights[poses[:, 24] < 0].sum())


@pytest.mark.slow
def test_the_filters_own_first_frame_is_calibrated():
    """Before anything is seen, particles and truth come from the same distribution."""
    prior, camera = adults_prior(30.0), view(0.0, distance=7.0, width=64, height=64)
    found = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        start = calibration.wide_start(prior, rng)
        walker, tracker = (ParticleFilter(prior, calibration.Blind(camera), n, hidden=0.0, seed=rng) for n in (2, 100))
        walker.start(start)
        tracker.start(start)
        which = np.array([rng.integers(2)])
        for _ in range(2):
            truth, belief = walker.step().state.take(which), tracker.step()
        found.append(calibration.levels(belief, truth.poses[0], truth.sizes[0], camera))
    for i in range(5):
        assert kstest(np.array(found)[:, i], "uniform").pvalue > 1e-3, calibration.AXES[i]


@pytest.fixture
def clip():
    pytest.importorskip("filterpy")
    pytest.importorskip("particles")
    return peers.clip("place", 3, 8)


def test_kalman_peers_are_exact(clip):
    """Against the joint normal distribution of all points."""
    frames, d = clip.truth.shape
    apart = np.abs(np.subtract.outer(np.arange(frames), np.arange(frames)))
    states = np.kron(clip.keep**apart, np.diag(clip.deviation**2))
    slopes = np.kron(np.eye(frames), clip.slopes(0, np.zeros(d)))
    cov = slopes @ states @ slopes.T + clip.noise**2 * np.eye(30 * frames)
    off = np.concatenate([clip.points[t].ravel() - clip.seen(t, np.zeros((1, d)))[0] for t in range(frames)])
    exact = multivariate_normal.logpdf(off, cov=cov)
    smooth = (states @ slopes.T @ np.linalg.solve(cov, off)).reshape(frames, d)
    variance = np.diag(states - states @ slopes.T @ np.linalg.solve(cov, slopes @ states)).reshape(frames, d)
    for method in (peers.kalman, peers.unscented):
        assert method(clip, 0, 0).evidence == pytest.approx(exact, abs=1e-6)
        answer = method(clip, 0, 0, smooth=True)
        np.testing.assert_allclose(answer.means, smooth, atol=1e-8)
        np.testing.assert_allclose(answer.levels, norm.cdf((clip.truth - smooth) / np.sqrt(variance)), atol=1e-6)


def test_particle_peers_agree_with_kalman(clip):
    exact = peers.kalman(clip, 0, 0)
    for method in (peers.ours, peers.FILTERS["`particles` bootstrap"], peers.FILTERS["`particles` guided"]):
        answer = method(clip, 4096, 1)
        assert answer.evidence == pytest.approx(exact.evidence, abs=1.0)
        np.testing.assert_allclose(answer.means, exact.means, atol=0.03)
    smooth, exactly = peers.SMOOTHERS["`particles` FFBS"](clip, 2048, 1), peers.kalman(clip, 0, 0, smooth=True)
    np.testing.assert_allclose(smooth.means, exactly.means, atol=0.03)
