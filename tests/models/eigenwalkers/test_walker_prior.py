"""The prior of walkers against noise that was put in, the joint Gaussian, mirrors, and people whom it never saw."""

import numpy as np
import pytest
from scipy.stats import norm

from benchmarks.models import kinectgait
from motionenv.errors import GapError, ModelError, MotionError
from motionenv.models.eigenwalkers import walker_prior as walkerprior
from motionenv.models.eigenwalkers.fourier_series import (
    OTHER_SIDE,
    FourierWalker,
    centred,
    in_phase,
    later,
    mirrored,
)
from motionenv.models.eigenwalkers.walker_prior import WalkerPrior
from motionenv.models.registry import load
from motionenv.models.storage.model_file import save_model
from motionenv.types import MARKERS

ANKLES = [MARKERS.index("left_ankle"), MARKERS.index("right_ankle")]
DEVIATIONS = np.array([0.02, 0.01, 0.01, 0.004, 0.004])[:, None] * np.where(["wrist" in m for m in MARKERS], 2.0, 1.0)


def base() -> np.ndarray:
    """Coefficients of a walk (5, 15, 3) with phase and sides that nothing below puts in doubt."""
    w = np.zeros((5, 15, 3))
    w[0, :, 2] = [1.6, 1.3, 0.95, 1.4, 1.4, 1.1, 1.1, 0.85, 0.85, 0.9, 0.9, 0.5, 0.5, 0.08, 0.08]
    w[0, 3::2, 1], w[0, 4::2, 1] = 0.15, -0.15
    for side, sign in ((0, 1), (1, -1)):
        w[2, 11 + side, 0], w[2, 13 + side, 0], w[2, 7 + side, 0] = 0.15 * sign, 0.3 * sign, -0.1 * sign
    return w


def crowd(
    people: int, walks: int = 1, rank: int = 3, noise=DEVIATIONS, seed: int = 0
) -> tuple[list[FourierWalker], list[str]]:
    """Walks of people who differ along `rank` directions, and by `noise` (5, 15) [m] in each coordinate.

    Ankles have no noise along the way of the fundamental, nor has the mean of the pelvis: phase and place are as made.
    """
    rng = np.random.default_rng(seed)
    directions = rng.standard_normal((rank, 5, 15, 3))
    directions[:, 1:3, ANKLES, 0] = directions[:, 0, 2, :2] = 0.0
    loose = noise[..., None] * np.ones(3)
    loose[1:3, ANKLES, 0] = loose[0, 2, :2] = 0.0
    made, who = [], []
    for person in range(people):
        own = base() + 0.02 * np.tensordot(rng.standard_normal(rank), directions, 1)
        for _ in range(walks):
            frequency = 0.9 * np.exp(0.05 * rng.standard_normal())
            made.append(FourierWalker(own + loose * rng.standard_normal(loose.shape), frequency))
            who.append(str(person))
    return made, who


@pytest.fixture(scope="module")
def people():
    return crowd(40, walks=2)


@pytest.fixture(scope="module")
def model(people) -> WalkerPrior:
    return WalkerPrior(8).fit(*people)


def covariance(model: WalkerPrior) -> np.ndarray:
    """(225, 225) of all coefficients."""
    flat = model.components_.reshape(len(model.components_), -1)
    return (flat.T * model.explained_variance_) @ flat + np.diag(np.repeat(model.noise_.ravel(), 3))


def test_what_is_said_of_left_is_said_of_right(model):
    np.testing.assert_allclose(mirrored(model.mean_), model.mean_, atol=1e-12)
    sigma = covariance(model)
    once = mirrored(sigma.reshape(-1, 5, 15, 3)).reshape(225, 225).T
    twice = mirrored(once.reshape(-1, 5, 15, 3)).reshape(225, 225).T
    np.testing.assert_allclose(twice, sigma, atol=1e-12)
    np.testing.assert_array_equal(model.noise_[:, OTHER_SIDE], model.noise_)
    np.testing.assert_array_equal(model.inflation_[list(OTHER_SIDE)], model.inflation_)
    np.testing.assert_array_equal(model.noise_[1], model.noise_[2])
    np.testing.assert_array_equal(model.noise_[3], model.noise_[4])


def test_noise_that_was_put_in_is_found(model):
    """But for the factor, up to what 3 of 8 components take for more than noise, and the noise of 40 people."""
    ratio = np.sqrt(model.noise_) / DEVIATIONS
    free = np.ones((5, 15), dtype=bool)
    free[1:3, ANKLES] = free[0, 2] = False
    assert ratio[free].std() / ratio[free].mean() < 0.12
    assert 0.7 < ratio[free].mean() < 1.6
    # Of one coordinate of three there was none:
    np.testing.assert_allclose(ratio[1, ANKLES] / ratio[free].mean(), np.sqrt(2 / 3), rtol=0.15)


def test_of_gaussian_people_no_bands_need_be_wider(model):
    assert np.median(model.inflation_) == pytest.approx(1, abs=0.25)


@pytest.mark.parametrize("phase", [-2.0, 0.3, np.pi])
def test_the_phase_in_which_walks_come_does_not_matter(phase):
    walks, who = crowd(5)
    turned = [FourierWalker(later(w.coefficients, phase), w.frequency) for w in walks]
    a, b = (WalkerPrior(4).fit(some, who) for some in (walks, turned))
    for name in ("mean_", "explained_variance_", "noise_", "inflation_"):
        np.testing.assert_allclose(getattr(b, name), getattr(a, name), rtol=1e-6, atol=1e-9, err_msg=name)


def test_lifting_left_out_people_is_the_conditional_gaussian(model, people):
    """The short way by scores against Gauss' formulas with the whole covariance (225, 225), ten markers seen."""
    w = np.stack([a.coefficients for a in people[0][:3]])
    out = walkerprior._LeftOut(w, np.ones(3), model.mean_, model.components_, model.explained_variance_)
    seen, alpha = np.arange(15) % 3 > 0, 0.7
    c, s = np.cos(alpha), np.sin(alpha)
    shown = np.kron(np.diag(np.tile(seen, 5).astype(float)), [[c, s, 0], [0, 0, 1]])[np.repeat(np.tile(seen, 5), 2)]
    away = np.kron(np.diag(np.tile(seen, 5).astype(float)), [-s, c, 0])[np.tile(seen, 5)]
    sigma, deviation = covariance(model), (w - model.mean_).reshape(3, -1)
    gain = away @ sigma @ shown.T @ np.linalg.inv(shown @ sigma @ shown.T)
    error = deviation @ shown.T @ gain.T - deviation @ away.T
    rest = (away - gain @ shown) @ sigma @ away.T
    over_time = np.kron(walkerprior._CYCLE, np.eye(seen.sum()))
    found, variance = walkerprior._lifted(out, model.noise_, alpha, seen, w)
    np.testing.assert_allclose(found.reshape(3, -1), error, atol=1e-10)
    np.testing.assert_allclose(variance.ravel(), ((over_time @ rest) * over_time).sum(1), rtol=1e-8)


def test_each_walk_and_mirror_image_is_a_column(people, model):
    assert (model.n_people_, model.n_walkers_, model.scores_.shape) == (40, 80, (160, 8))
    assert model.people_ == tuple(people[1]) * 2
    w = centred(in_phase(np.stack([a.coefficients for a in people[0]])))
    both = np.concatenate([w, mirrored(w)]).reshape(160, -1)
    values = np.linalg.eigvalsh(np.cov(both.T))[::-1]
    np.testing.assert_allclose(model.explained_variance_, values[:8], rtol=1e-8)
    merged = WalkerPrior(8, merge=True).fit(*people)
    assert (merged.n_people_, merged.n_walkers_, merged.scores_.shape) == (40, 80, (80, 8))


def test_one_sided_components_say_nothing_of_pace(model):
    one_sided = np.abs(mirrored(model.components_) + model.components_).max(axis=(1, 2, 3)) < 1e-9
    assert one_sided.any()
    np.testing.assert_allclose(model.log_frequency_weights_[one_sided], 0, atol=1e-9)


def test_saved_and_loaded_it_is_the_same(model, tmp_path):
    model.save(tmp_path / "prior.npz", card={"people": 40})
    same = load(tmp_path / "prior.npz")
    assert isinstance(same, WalkerPrior)
    assert (same.n_people_, same.merge, same.card_) == (40, False, {"people": 40})
    for name in WalkerPrior._stored:
        np.testing.assert_array_equal(getattr(same, name), getattr(model, name))


@pytest.mark.parametrize(("name", "shape"), [("noise_", (5, 14)), ("inflation_", (5,)), ("mean_", (5, 14, 3))])
def test_a_model_file_with_other_shapes_is_refused(model, tmp_path, name, shape):
    arrays, meta = model.to_arrays()
    save_model(tmp_path / "bad.npz", "walker-prior", arrays | {name: np.ones(shape)}, meta)
    with pytest.raises(ModelError, match=f"{name} has shape"):
        load(tmp_path / "bad.npz")


@pytest.mark.parametrize("name", ["noise_", "inflation_"])
def test_a_model_file_with_variances_of_nothing_is_refused(model, tmp_path, name):
    arrays, meta = model.to_arrays()
    save_model(tmp_path / "bad.npz", "walker-prior", arrays | {name: 0 * arrays[name]}, meta)
    with pytest.raises(ModelError, match=f"{name} must be above 0"):
        load(tmp_path / "bad.npz")


def one_sided(walker: FourierWalker, side: str) -> FourierWalker:
    w = walker.coefficients.copy()
    w[:, [i for i, m in enumerate(MARKERS) if side in m]] = np.nan
    return FourierWalker(w, walker.frequency)


def test_merged_walks_that_show_one_side_each_are_nearly_as_good(people, model):
    shown = [one_sided(w, ("left", "right")[i % 2]) for i, w in enumerate(people[0])]
    merged = WalkerPrior(8, merge=True).fit(shown, people[1])
    np.testing.assert_allclose(merged.mean_, model.mean_, atol=0.01)
    free = DEVIATIONS[:, 3:]
    np.testing.assert_allclose(np.sqrt(merged.noise_[:, 3:]) / free, np.sqrt(model.noise_[:, 3:]) / free, rtol=0.5)


def test_it_learns_from_walks_with_markers_missing(people):
    """Unmerged, of incomplete columns: by likelihood, in each fold too."""
    walks = [one_sided(w, "left") if i % 5 == 0 else w for i, w in enumerate(people[0][:40])]
    model = WalkerPrior(3, tol=1e-5).fit(walks, people[1][:40])
    complete = WalkerPrior(3).fit(people[0][:40], people[1][:40])
    assert np.isfinite(model.inflation_).all()
    np.testing.assert_allclose(np.sqrt(model.noise_), np.sqrt(complete.noise_), rtol=0.3)


def test_a_marker_that_never_moves_keeps_a_variance(people):
    still = []
    for walker in people[0][:20]:
        w = walker.coefficients.copy()
        w[:, 2] = base()[:, 2]
        still.append(FourierWalker(w, walker.frequency))
    model = WalkerPrior(3).fit(still, people[1][:20])
    assert (model.noise_ > 0).all()
    assert (model.inflation_ > 0).all()


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda w, p: WalkerPrior().fit(w[:2]), "walks of three people for its cross-validation, got 2"),
        (lambda w, p: WalkerPrior().fit(w[:6], p[:4] + p[:2]), "three people for its cross-validation, got 2"),
        (lambda w, p: WalkerPrior(12).fit(w[:6], p[:6]), "12 walks and mirror images can have 1 to 11"),
        (lambda w, p: WalkerPrior(0).fit(w[:6], p[:6]), "1 to 11 components, got 0"),
        (lambda w, p: WalkerPrior().fit(w[:6], p[:5]), "subject for each"),
        (lambda w, p: WalkerPrior().fit([1, 2, 3]), "Markers"),
    ],
)
def test_what_makes_no_sense_is_refused(people, call, says):
    with pytest.raises(MotionError, match=says):
        call(*people)


def test_before_fit_and_of_a_marker_unseen_it_says_nothing(people):
    with pytest.raises(ModelError, match="not fitted"):
        WalkerPrior().sample(1)
    headless = []
    for walker in people[0][:8]:
        w = walker.coefficients.copy()
        w[:, 0] = np.nan
        headless.append(FourierWalker(w, 1.0))
    with pytest.raises(GapError, match="head"):
        WalkerPrior(2).fit(headless)


@pytest.fixture(scope="module")
def captured(cmu_walkers):
    """The straight CMU walks, and the person of each."""
    return [walker for _, walker, _ in cmu_walkers], np.array([person for _, _, person in cmu_walkers])


@pytest.fixture(scope="module")
def nested(captured) -> tuple[float, np.ndarray, np.ndarray]:
    """Of priors fitted without a person, lifting this person: rms [m] of the missing dimension, and the share (15,) of
    time in which bands of 90 % hold, by walk and by person.
    """
    walkers, people = captured
    errors, by_person = [], []
    for person in np.unique(people):
        out = people == person
        prior = WalkerPrior().fit([w for w, o in zip(walkers, out, strict=True) if not o], people[~out])
        w = np.stack([w.coefficients for w, o in zip(walkers, out, strict=True) if o])
        left = walkerprior._LeftOut(w, np.ones(len(w)), prior.mean_, prior.components_, prior.explained_variance_)
        held = []
        for alpha in np.radians(np.arange(-90, 91, 10)):
            error, variance = walkerprior._lifted(left, prior.noise_, alpha, np.ones(15, dtype=bool), w)
            over_time = np.einsum("th,nhm->ntm", walkerprior._CYCLE, error)
            width = norm.ppf(0.95) * np.sqrt(prior.inflation_ * variance)
            errors.append((over_time**2).mean(axis=(1, 2)))
            held.append((np.abs(over_time) < width).mean(axis=1))
        by_person.append(np.mean(held, axis=0))
    return np.sqrt(np.concatenate(errors).mean()), np.concatenate(by_person), np.stack([h.mean(0) for h in by_person])


@pytest.mark.slow
def test_people_it_never_saw_are_lifted_better_than_paper_b_would(nested):
    """27.7 mm with the paper's model, each walk a column and one noise of 70 mm² (30 components)."""
    assert nested[0] < 0.0225


@pytest.mark.slow
def test_bands_hold_on_people_it_never_saw(nested):
    _, walks, people = nested
    assert 0.87 < walks.mean() < 0.94
    assert 0.87 < people.mean() < 0.93
    sides = (people + people[:, OTHER_SIDE]) / 2
    assert sides.mean(axis=0).min() > 0.85
    assert sides.mean(axis=0).max() < 0.95


def test_drawn_people_walk():
    model = load("walk/prior")
    heights = [model.synthesize(1.0, 30.0, seed=seed).skeleton.height for seed in range(6)]
    assert 1.4 < min(heights) <= max(heights) < 2.1
    motion = model.synthesize(3.0, 60.0, seed=1)
    assert 0.5 < (motion.poses[-1, 0] - motion.poses[0, 0]) / 2.98 < 2.0


def test_kinectgait_in_seconds(mocap):
    """Walks of which no pass shows both sides; averages of a person's passes do."""
    near, people, _ = kinectgait.pass_walkers(mocap / "kinectgait", people=15)
    model = WalkerPrior(6, merge=True).fit(near, people)
    assert model.scores_.shape == (2 * len(set(people)), 6)
    elbow, hip = (np.sqrt(model.noise_[1, MARKERS.index(f"left_{j}")]) for j in ("elbow", "hip"))
    assert 0.001 < hip < elbow < 0.05
    assert ((model.inflation_ > 0) & (model.inflation_ < 5)).all()
