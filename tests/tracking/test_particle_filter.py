"""Particle filters and smoothing against exact posteriors: Kalman's, and enumeration of a discrete world."""

import tracemalloc
from dataclasses import dataclass, replace

import numpy as np
import pytest

import motionenv
from motionenv.body import from_height
from motionenv.envs.walker import WalkerTracking
from motionenv.errors import MotionError
from motionenv.likelihoods import Likelihood, MarkerLikelihood, SilhouetteLikelihood
from motionenv.render.cameras import view
from motionenv.tracking import Belief, FPCAPrior, ParticleFilter, Start

# A world whose posterior is known exactly: x moves and is measured linearly, with Gaussian noise.
KEEP, MOVES, MEASURES, BEGINS = 0.95, 0.3, 0.5, 1.0  # x' = KEEP x + MOVES ε, y = x + MEASURES ε, x_0 ~ BEGINS ε


@dataclass(frozen=True, eq=False)
class Point:
    poses: np.ndarray
    sizes = None

    def take(self, which):
        return Point(self.poses[which])


class LinearPrior:
    """The first entry of the pose follows an autoregression."""

    skeleton, fps, size = from_height(), 30.0, 0.0

    def initial(self, start, n, rng):
        return Point(start.draw(n, rng)[1])

    def propagate(self, state, rng):
        return self.diffuse(Point(KEEP * state.poses), 1.0, rng)

    def diffuse(self, state, share, rng):
        poses = state.poses.copy()
        poses[:, 0] += share * MOVES * rng.standard_normal(len(poses))
        return Point(poses)

    def moved(self, state, poses):
        return replace(state, poses=poses)


class GaussianLikelihood(Likelihood):
    """Measures the first entry; NaN where it is told NaN."""

    def observe(self, *, y):
        self.y = y

    def log_likelihood(self, poses):
        return -0.5 * ((self.y - poses[:, 0]) / MEASURES) ** 2 - np.log(MEASURES * np.sqrt(2 * np.pi))


def measurements(frames, seed):
    rng = np.random.default_rng(seed)
    x, out = rng.standard_normal() * BEGINS, []
    for t in range(frames):
        x = x if t == 0 else KEEP * x + MOVES * rng.standard_normal()
        out.append(x + MEASURES * rng.standard_normal())
    return np.array(out)


def kalman(ys):
    """Means, variances and log evidences (T,) of the filter, then means and variances of the smoother (Rauch 1965)."""
    mean, variance, out = 0.0, BEGINS**2, []
    for t, y in enumerate(ys):
        if t:
            mean, variance = KEEP * mean, KEEP**2 * variance + MOVES**2
        s = variance + MEASURES**2
        evidence = -0.5 * ((y - mean) ** 2 / s + np.log(2 * np.pi * s))
        gain = variance / s
        mean, variance = mean + gain * (y - mean), (1 - gain) * variance
        out.append((mean, variance, evidence))
    means, variances, evidences = np.array(out).T
    smooth, spread = means.copy(), variances.copy()
    for t in range(len(ys) - 2, -1, -1):
        ahead = KEEP**2 * variances[t] + MOVES**2
        back = KEEP * variances[t] / ahead
        smooth[t] += back * (smooth[t + 1] - KEEP * means[t])
        spread[t] += back**2 * (spread[t + 1] - ahead)
    return means, variances, evidences, smooth, spread


NOWHERE = np.zeros(25)
SPREAD = np.concatenate([[BEGINS], np.zeros(24)])
START = Start.at(NOWHERE, spread=SPREAD)


def followed(ys, likelihood=None, **options):
    tracker = ParticleFilter(LinearPrior(), likelihood or GaussianLikelihood(), seed=3, **options)
    tracker.start(START)
    return [tracker.step(y=y) for y in ys]


def moments(belief):
    weights, x = np.exp(belief.log_weights), belief.poses[:, 0]
    return weights @ x, weights @ (x - weights @ x) ** 2


@pytest.mark.parametrize("resample", [0.1, 0.5, 1.0])
def test_bootstrap_agrees_with_kalman(resample):
    ys = measurements(25, 0)
    means, variances, evidences, *_ = kalman(ys)
    beliefs = followed(ys, n=20_000, resample=resample, hidden=0.0)
    got = np.array([moments(belief) for belief in beliefs])
    assert np.abs(got[:, 0] - means).max() < 0.03
    assert np.abs(got[:, 1] / variances - 1).max() < 0.1
    assert np.abs([belief.log_evidence for belief in beliefs] - evidences).max() < 0.05
    assert not any(belief.lost or belief.recovered for belief in beliefs)
    assert all(np.isclose(np.exp(b.log_weights).sum(), 1) and 1 <= b.effective <= 20_000 for b in beliefs)


def test_what_follows_an_earlier_belief_agrees_with_kalman():
    ys = measurements(25, 0)
    means, variances, evidences, *_ = kalman(ys)
    tracker = ParticleFilter(LinearPrior(), GaussianLikelihood(), 20_000, hidden=0.0, keep=False, seed=3)
    tracker.start(START)
    beliefs = [tracker.step(y=y) for y in ys]
    tracker.resume(beliefs[9])
    again = [tracker.step(y=y) for y in ys[10:]]
    got = np.array([moments(belief) for belief in again])
    assert np.abs(got[:, 0] - means[10:]).max() < 0.03
    assert np.abs(got[:, 1] / variances[10:] - 1).max() < 0.1
    assert np.abs([belief.log_evidence for belief in again] - evidences[10:]).max() < 0.05


def test_annealing_does_not_change_what_is_said_of_the_evidence():
    """Layers move particles to peaks, where their weights say nothing about how well the image was predicted."""
    ys = measurements(25, 0)
    exact = kalman(ys)[2]
    beliefs = followed(ys, n=20_000, layers=3, hidden=0.0)
    assert abs(np.mean([belief.log_evidence for belief in beliefs] - exact)) < 0.05


def test_ancestors_are_those_whose_children_are_left():
    """Tracer: a state whose poses keep the number that each particle was born with a third of a second ago."""
    ys = measurements(12, 1)
    tracker = ParticleFilter(LinearPrior(), GaussianLikelihood(), 200, seed=3, hidden=0.0)
    tracker.start(START)
    names, resample, history = np.arange(200), tracker._resample, []

    def traced():
        nonlocal history
        which = resample()
        history = [born[which] for born in history]
        return which

    tracker._resample = traced
    recent = round(0.3 * LinearPrior.fps)
    for t, y in enumerate(ys):
        belief = tracker.step(y=y)
        history.append(names)
        weights = np.zeros(200)
        np.add.at(weights, history[max(0, t - recent)], np.exp(belief.log_weights))
        assert belief.ancestors == pytest.approx(1 / (weights**2).sum())
    assert 1 <= belief.ancestors < belief.effective


def test_a_belief_with_few_ancestors_or_lost_is_not_reliable():
    point = Point(np.zeros((2, 25)))
    said = [
        Belief(point, np.log([0.5, 0.5]), 2.0, k, 0.0, lost).reliable for k, lost in ((9, False), (2, False), (9, True))
    ]
    assert said == [True, False, False]


def test_evidence_of_all_frames_is_unbiased():
    ys = measurements(6, 4)
    exact = kalman(ys)[2].sum()
    total = []
    for seed in range(400):
        tracker = ParticleFilter(LinearPrior(), GaussianLikelihood(), 50, hidden=0.0, seed=seed)
        tracker.start(START)
        total.append(sum(tracker.step(y=y).log_evidence for y in ys))
    ratios = np.exp(np.array(total) - exact)
    assert abs(ratios.mean() - 1) < 4 * ratios.std() / np.sqrt(len(ratios))


def test_annealing_finds_a_far_peak_with_few_particles():
    ys = np.array([0.0, 1.0])  # far in the tail of what is expected, where hardly any of 60 particles is
    plain, annealed = (np.mean([_end_error(ys, layers, seed) for seed in range(40)]) for layers in (1, 5))
    assert annealed < 0.7 * plain


def _end_error(ys, layers, seed):
    sharp = GaussianLikelihood()
    sharp.log_likelihood = lambda poses: -0.5 * ((sharp.y - poses[:, 0]) / 0.02) ** 2
    tracker = ParticleFilter(LinearPrior(), sharp, 60, layers=layers, seed=seed, hidden=0.0)
    tracker.start(START)
    return abs(moments([tracker.step(y=y) for y in ys][-1])[0] - ys[-1])


class Chain(Likelihood):
    """Three places, walked at random; each shows itself with probability 0.7, else one of the others."""

    skeleton, fps, size = LinearPrior.skeleton, 30.0, 0.0
    MOVES = np.array([[0.8, 0.15, 0.05], [0.2, 0.6, 0.2], [0.1, 0.3, 0.6]])
    SHOWS = np.full((3, 3), 0.15) + 0.55 * np.eye(3)

    def initial(self, start, n, rng):
        return self._at(rng.integers(3, size=n))

    def propagate(self, state, rng):
        edges = np.cumsum(self.MOVES, axis=1)[state.poses[:, 0].astype(int)]
        return self._at((rng.random((len(edges), 1)) > edges).sum(axis=1).clip(0, 2))

    def observe(self, *, place):
        self.place = place

    def log_likelihood(self, poses):
        return np.log(self.SHOWS[poses[:, 0].astype(int), self.place])

    @staticmethod
    def _at(places):
        poses = np.zeros((len(places), 25))
        poses[:, 0] = places
        return Point(poses)


def test_agrees_with_enumeration_of_a_discrete_world():
    chain, seen = Chain(), [0, 0, 2, 2, 1, 2, 0]
    tracker = ParticleFilter(chain, chain, 40_000, hidden=0.0, seed=1)
    tracker.start(START)
    exact = np.full(3, 1 / 3)
    for t, place in enumerate(seen):
        joint = (exact if t == 0 else exact @ chain.MOVES) * chain.SHOWS[:, place]
        exact = joint / joint.sum()
        belief = tracker.step(place=place)
        got = np.bincount(belief.poses[:, 0].astype(int), np.exp(belief.log_weights), minlength=3)
        assert np.abs(got - exact).max() < 0.015
        assert abs(belief.log_evidence - np.log(joint.sum())) < 0.02


class Failing(GaussianLikelihood):
    """Scores nothing but NaN (or what it is told) while y is NaN."""

    scores = np.nan

    def log_likelihood(self, poses):
        return np.full(len(poses), self.scores) if np.isnan(self.y) else super().log_likelihood(poses)


@pytest.mark.parametrize("scores", [np.nan, -np.inf, np.inf])
@pytest.mark.parametrize("layers", [1, 3])
def test_what_cannot_be_scored_leaves_the_prediction_and_says_lost(scores, layers):
    failing = Failing()
    failing.scores = scores
    ys = np.array([0.2, np.nan, np.nan, 0.1])
    beliefs = followed(ys, failing, n=4000, layers=layers)
    assert [belief.lost for belief in beliefs] == [False, True, True, False]
    assert all(np.isfinite(belief.poses).all() and np.isfinite(belief.log_weights).all() for belief in beliefs)
    assert beliefs[1].log_evidence == beliefs[2].log_evidence == -np.inf
    assert np.isfinite(beliefs[-1].log_evidence)
    assert abs(beliefs[-1].mean[0]) < 0.3
    if layers == 1:  # a prediction: as wide as without a measurement
        variance = moments(beliefs[0])[1]
        for belief in beliefs[1:3]:
            variance = 0.95**2 * variance + 0.3**2
            assert moments(belief)[1] == pytest.approx(variance, rel=0.1)


def test_few_scores_that_are_nan_only_lose_their_particles():
    class Half(GaussianLikelihood):
        def log_likelihood(self, poses):
            return np.where(poses[:, 0] > 0, super().log_likelihood(poses), np.nan)

    for layers in (1, 4):
        belief = followed([0.5, 0.6, 0.4], Half(), n=2000, layers=layers)[-1]
        assert not belief.lost
        assert np.isfinite(belief.mean).all()
        assert (belief.poses[np.exp(belief.log_weights) > 0, 0] > 0).all()


class Window(GaussianLikelihood):
    """Sees within one unit of y; all else is as nobody there."""

    def log_likelihood(self, poses):
        return np.where(np.abs(poses[:, 0] - self.y) < 1.0, 8.0, -8.0 * (np.abs(poses[:, 0]) < 1e4))


def test_who_is_hidden_stays_where_the_prior_says():
    beliefs = followed([0.0, 1e5, 1e5, 1e5, 0.0], Window(), n=2000)  # at 1e5 nobody is
    assert [belief.lost for belief in beliefs] == [False, True, True, True, False]
    assert abs(beliefs[3].mean[0]) < 0.3
    assert beliefs[3].effective > 1000
    assert abs(beliefs[-1].mean[0]) < 0.5


def test_a_lost_track_widens_and_begins_anew():
    tracker = ParticleFilter(LinearPrior(), Window(), 500, seed=0)
    tracker.start(START)
    lost = [tracker.step(y=40.0) for _ in range(60)]
    assert all(belief.lost and not belief.recovered and np.isfinite(belief.mean).all() for belief in lost)
    assert lost[14].poses[:, 0].std() > 1.2 * lost[6].poses[:, 0].std()
    tracker.start(Start.at(np.concatenate([[40.0], np.zeros(24)]), spread=SPREAD), lost)
    found = [tracker.step(y=40.0) for _ in range(2)]
    assert not any(belief.lost for belief in found)
    assert [belief.recovered for belief in found] == [True, False]
    assert tracker.beliefs == lost


def test_angles_are_averaged_on_the_circle():
    poses = np.zeros((2, 25))
    poses[:, 5] = np.radians([179.0, -179.0])
    belief = Belief(Point(poses), np.log([0.5, 0.5]), 2.0, 2.0, 0.0, False)
    assert np.cos(belief.mean[5]) == pytest.approx(-1.0)
    assert abs(belief.mean[5] - poses[np.argmax(belief.log_weights), 5]) < 0.1


@pytest.mark.parametrize("layers", [1, 3])
def test_same_seed_same_bytes_with_any_number_of_threads(layers):
    env = WalkerTracking(motion="walk/fpca", start="line", actions="metric", size=48, observation="mask", horizon=6)
    beliefs = [_walked(env, threads, layers) for threads in (1, 2)]
    for one, other in zip(*beliefs, strict=True):
        assert one.poses.tobytes() == other.poses.tobytes()
        assert one.log_weights.tobytes() == other.log_weights.tobytes()
        assert one.log_evidence == other.log_evidence


def _walked(env, threads, layers):
    observation, _ = env.reset(seed=2)
    truth = env.truth()
    tracker = ParticleFilter(
        FPCAPrior(), SilhouetteLikelihood(truth["camera"], threads=threads), 600, layers=layers, seed=4
    )
    tracker.start(Start.at(truth["pose"]))
    beliefs = []
    for _ in range(4):
        beliefs.append(tracker.step(mask=observation[..., 0]))
        observation, *_ = env.step(beliefs[-1].mean.astype(np.float32))
    return beliefs


def test_what_a_search_found_may_be_nearer_or_farther_while_it_is_seen():
    """Sizes of found walkers spread to those of people; who is given stays; nothing spreads while nobody is seen."""

    def spread(heights, steps, seen):
        prior = FPCAPrior(size=0.07)
        pose = motionenv.synthesize("walk/fpca", 0.1, 30, seed=1, height=prior.skeleton.height).poses[0]
        tracker = ParticleFilter(prior, Blind(view(0.0, distance=6.0), seen), 4000, seed=3)
        at = Start.at(pose, spread=0.0)
        tracker.start(Start(at.poses, at.log_weights, at.previous, at.spread, heights))
        for _ in range(steps):
            belief = tracker.step(mask=np.zeros((4, 4)))
        return np.log(belief.state.sizes).std()

    found = np.array([FPCAPrior().skeleton.height])
    assert spread(found, 120, 5.0) == pytest.approx(0.07, rel=0.1)  # the prior's, by Metropolis' rule
    assert spread(None, 120, 5.0) < 0.05
    assert spread(found, 20, -100.0) < 0.6 * spread(found, 20, 5.0)


class Blind(Likelihood):
    """A picture in which all poses are as likely, by `level` more than that there is nobody."""

    def __init__(self, camera, level):
        self.camera, self.level = camera, level

    def observe(self, mask):
        pass

    def log_likelihood(self, poses):
        return np.where(np.abs(poses[:, 0]) < 1e3, self.level, 0.0)


def test_a_hundred_thousand_particles_fit_in_a_gigabyte():
    env = WalkerTracking(motion="walk/fpca", start="line", actions="metric", size=36, observation="mask", horizon=6)
    observation, _ = env.reset(seed=2)
    tracker = ParticleFilter(FPCAPrior(), SilhouetteLikelihood(env.truth()["camera"]), 100_000, seed=4)
    tracemalloc.start()
    tracker.start(Start.at(env.truth()["pose"]))
    for _ in range(2):
        tracker.step(mask=observation[..., 0])
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 0.8e9


@pytest.mark.parametrize(
    "options",
    [{"n": 1}, {"n": 2.5}, {"n": True}, {"resample": 0.0}, {"resample": 1.1}, {"layers": 0},
     {"hidden": 1.0}, {"hidden": -0.1}, {"n": np.nan}, {"n": np.inf}],
)  # fmt: skip
def test_refuses_options_out_of_range(options):
    with pytest.raises(MotionError, match=next(iter(options))):
        ParticleFilter(LinearPrior(), GaussianLikelihood(), **options)


def test_refuses_a_prior_of_another_body():
    with pytest.raises(MotionError, match=r"1.75 m .* 1.20 m"):
        ParticleFilter(LinearPrior(), SilhouetteLikelihood(view(0.0), from_height(1.2)), 10)


def test_bodies_of_unknown_size_need_pictures_in_which_a_small_one_looks_like_a_large_one_farther_away():
    sized, camera = FPCAPrior(size=0.06), view(0.0, width=48, height=48)
    with pytest.raises(MotionError, match="needs a likelihood with a camera"):
        ParticleFilter(sized, MarkerLikelihood(0.0), 10)
    tracker = ParticleFilter(sized, SilhouetteLikelihood(camera), 10, seed=0)
    tracker.start(Start.at(0.93 * np.eye(25)[2]))
    tracker.step(mask=np.ones((48, 48)))
    with pytest.raises(MotionError, match="depths can't be tracked"):
        tracker.step(depth=np.ones((48, 48)))


def test_reprs_are_a_line():
    tracker = ParticleFilter(FPCAPrior(), SilhouetteLikelihood(view(0.0, width=64, height=48)), 100)
    assert repr(tracker) == (
        "ParticleFilter(FPCAPrior(8 components, 30 fps), SilhouetteLikelihood(64x48, body of 1.75 m), n=100, layers=1)"
    )
    tracker.start(Start.at(0.93 * np.eye(25)[2]))
    assert repr(tracker.step(mask=np.zeros((48, 64)))) == "Belief(100 particles, effective 100, lost)"


def test_refuses_to_step_before_it_starts_and_poses_that_are_not_numbers():
    tracker = ParticleFilter(LinearPrior(), GaussianLikelihood(), 10)
    with pytest.raises(MotionError, match="start"):
        tracker.step(y=0.0)

    class Broken(LinearPrior):
        def propagate(self, state, rng):
            return Point(state.poses * np.nan)

    tracker = ParticleFilter(Broken(), GaussianLikelihood(), 10, seed=0)
    tracker.start(START)
    tracker.step(y=0.0)
    with pytest.raises(MotionError, match="Broken"):
        tracker.step(y=0.0)
