"""Functional PCA against closed forms, brute force, Theorem 1, and its own laws."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import multivariate_normal
from sklearn.decomposition import PCA, FactorAnalysis

from benchmarks.models.imputation import hide_blocks, imputation_error
from motionenv.errors import GapError, ModelError, MotionError
from motionenv.models.fpca.fourier_basis import sampled_basis
from motionenv.models.fpca.model import FunctionalPCA
from motionenv.models.registry import load
from tests.models.fpca.made_cycles import as_cycles, low_rank, with_gaps


def dense(model: FunctionalPCA) -> multivariate_normal:
    """The distribution of a whole cycle, as a vector of P·m samples."""
    samples, m = model.mean_.shape
    n = model.residual_harmonics
    basis = sampled_basis(samples, n) if n else np.empty((samples, 0))
    residual = np.zeros((samples, m, samples, m))
    for a in range(m):
        smooth = basis * model.residual_spectrum_[a] @ basis.T
        residual[:, a, :, a] = smooth + model.white_variance_[a] * np.eye(samples)
    flat = model.components_.reshape(len(model.components_), -1)
    return multivariate_normal(
        model.mean_.ravel(), flat.T * model.explained_variance_ @ flat + residual.reshape(m * samples, -1)
    )


@pytest.mark.filterwarnings("ignore::motionenv.errors.FitWarning")
@settings(max_examples=60, deadline=None)
@given(
    k=st.integers(4, 14), q=st.integers(1, 3), share=st.floats(0, 0.7), noise=st.sampled_from([0.0, 1e-4, 0.3, 30.0]),
    seed=st.integers(0, 2**32 - 1), method=st.sampled_from(["svd", "ppca"]), centre=st.sampled_from(["all", "subject"]),
)  # fmt: skip
def test_the_objective_never_rises(k, q, share, noise, seed, method, centre):
    """Theorem 1, and the same for EM: few cycles, up to 70 % missing, no noise or nothing but noise."""
    values = with_gaps(low_rank(k + 2, 32, 3, 2, noise, seed)[0], share, seed)[0]
    values[0, 0, :] = 1.0  # no channel is empty
    subject = tuple("ab"[i % 2] for i in range(k + 2))
    model = FunctionalPCA(q, n_harmonics=8, centre=centre, method=method, tol=1e-12, max_iter=60)
    errors = model.fit(as_cycles(values, subject)).errors_
    scale = np.abs(errors).max() + (k * 96 if method == "ppca" else np.sqrt(np.nansum(values**2)))
    assert np.diff(errors).max(initial=0) <= 1e-9 * scale


@pytest.mark.parametrize("method", ["svd", "ppca"])
def test_components_are_orthonormal_smooth_and_found(gappy, method):
    _, components, values, _ = gappy
    model = FunctionalPCA(3, n_harmonics=10, method=method, residual_harmonics=0).fit(as_cycles(values))
    flat = model.components_.reshape(3, -1)
    np.testing.assert_allclose(flat @ flat.T, np.eye(3), atol=1e-12)
    overlap = np.linalg.svd(flat @ components.reshape(3, -1).T)[1]
    assert overlap.min() > 0.999
    assert (flat.max(axis=1) == np.abs(flat).max(axis=1)).all()
    assert (np.diff(model.singular_values_) <= 0).all()
    assert 0.95 < model.explained_variance_ratio_.sum() <= 1 + 1e-9
    for name, value in vars(model).items():
        if isinstance(value, np.ndarray):
            assert value.dtype == np.float64, name
            assert value.flags.c_contiguous, name


def test_a_gap_is_filled_and_the_rest_is_left_alone(gappy):
    truth, _, values, hidden = gappy
    model = FunctionalPCA(3, n_harmonics=10).fit(as_cycles(values))
    assert imputation_error(truth, model.imputed_, hidden) < 0.12  # the noise alone is 0.04
    np.testing.assert_array_equal(model.imputed_[~hidden], truth[~hidden])
    np.testing.assert_allclose(model.impute(values), model.imputed_)


@pytest.mark.parametrize("method", ["svd", "ppca"])
def test_transform_undoes_inverse_transform(gappy, method):
    model = FunctionalPCA(3, n_harmonics=10, method=method).fit(as_cycles(gappy[2]))
    scores = np.array([[[3.0, -1.0, 0.5], [0.0, 2.0, -1.0]]])
    np.testing.assert_allclose(model.transform(model.inverse_transform(scores)), scores, rtol=5e-3, atol=5e-3)
    nothing = np.full((1, 64, 4), np.nan)
    np.testing.assert_allclose(model.transform(nothing), 0, atol=1e-12)


def test_evaluate_is_the_same_curve_between_samples_smooth_and_periodic(gappy):
    model = FunctionalPCA(3, n_harmonics=10).fit(as_cycles(gappy[2]))
    scores = model.scores_[:5]
    on_grid = model.evaluate(scores[:, None], np.arange(64) / 64)
    np.testing.assert_allclose(on_grid, model.inverse_transform(scores), atol=1e-12)
    phase, h = np.linspace(-2, 3, 77), 1e-5
    for d in range(3):
        here = model.evaluate(scores[0], phase, d)
        np.testing.assert_allclose(model.evaluate(scores[0], phase + 1, d), here, atol=1e-9 * np.abs(here).max())
        slope = (model.evaluate(scores[0], phase + h, d) - model.evaluate(scores[0], phase - h, d)) / (2 * h)
        ahead = model.evaluate(scores[0], phase, d + 1)
        np.testing.assert_allclose(slope, ahead, atol=1e-6 * np.abs(ahead).max())


@pytest.mark.parametrize("derivative", range(5))
def test_evaluate_is_the_written_out_series(gappy, derivative):
    model = FunctionalPCA(3, n_harmonics=10).fit(as_cycles(gappy[2]))
    rng = np.random.default_rng(derivative)
    scores, phase = rng.normal(0, 5, (4, 1, 3)), rng.uniform(-40, 40, (4, 700))
    k = np.arange(1, 10)
    angle = 2 * np.pi * phase[..., None] * k + derivative * np.pi / 2
    pairs = np.sqrt(2 / 64) * (2 * np.pi * k) ** derivative * np.array([np.cos(angle), np.sin(angle)])
    constant = np.full((*phase.shape, 1), (derivative == 0) / 8.0)
    columns = np.concatenate([constant, *pairs], axis=-1)
    series = np.concatenate([model.mean_coefficients_[None], model.component_coefficients_])
    weights = np.concatenate([np.ones((4, 1, 1)), scores], axis=-1)
    plain = np.einsum("...k,...q,qkm->...m", columns, np.broadcast_to(weights, (4, 700, 4)), series)
    np.testing.assert_allclose(model.evaluate(scores, phase, derivative), plain, atol=1e-11 * np.abs(plain).max())
    for shape in ((), (0,), (1,)):
        assert model.evaluate(scores[0, 0], np.zeros(shape)).shape == (*shape, 4)


@pytest.mark.parametrize("settings", [{}, {"method": "svd"}, {"residual_harmonics": 0}, {"noise": "shared"}])
def test_likelihood_and_draws_are_those_of_one_dense_normal(gappy, settings):
    values = gappy[2]
    model = FunctionalPCA(3, n_harmonics=10, **settings).fit(as_cycles(values))
    whole = dense(model)
    some = values[:5].copy()
    some[4] = np.nan
    expected = []
    for row in some.reshape(5, -1):
        seen = np.isfinite(row)
        part = multivariate_normal(whole.mean[seen], whole.cov[np.ix_(seen, seen)]) if seen.any() else None
        expected.append(part.logpdf(row[seen]) if part else 0.0)
    np.testing.assert_allclose(model.score_samples(some), expected, atol=1e-6)
    assert model.score_samples(some)[4] == 0.0
    assert model.score(some) == pytest.approx(sum(expected) / np.isfinite(some).sum())
    drawn, smooth = model.sample(4000, seed=7), model.sample(4000, seed=7, noise=False)
    error = np.sqrt(np.diag(whole.cov) / 4000)
    assert (np.abs(drawn.mean(axis=0).ravel() - whole.mean) < 5 * error).all()
    assert drawn.var(axis=0).sum() == pytest.approx(np.trace(whole.cov), rel=0.06)
    shares = model.explained_variance_ratio_
    assert smooth.var(axis=0).sum() == pytest.approx(shares.sum() * np.trace(whole.cov), rel=0.06)
    assert shares.sum() + model.noise_ratio_ == pytest.approx(1, abs=1e-12)
    assert ((shares >= 0) & (shares <= 1)).all()
    assert drawn.tobytes() == model.sample(4000, seed=np.random.default_rng(7)).tobytes()


@pytest.mark.parametrize("gaps", [0.0, 0.3])
@pytest.mark.parametrize("method", ["svd", "ppca"])
def test_shares_of_variance_are_those_of_what_was_simulated(method, gaps):
    """Cycles whose components have 64, 23, 8 and noise 5 percent of the variance."""
    values, _ = low_rank(600, 32, 3, 3, noise=0.5, seed=4)
    values = with_gaps(values, gaps)[0] if gaps else values
    model = FunctionalPCA(3, n_harmonics=8, method=method).fit(values)
    variance = 64 * 0.36 ** np.arange(3)
    total = variance.sum() + 0.25 * 96
    error = 3 * variance / total * np.sqrt(2 / 600)
    assert (np.abs(model.explained_variance_ratio_ - variance / total) < error + 0.01).all()
    assert model.noise_ratio_ == pytest.approx(0.25 * 96 / total, abs=0.03)


def test_complete_cycles_with_shared_noise_give_the_components_of_pca():
    """Of scikit-learn, where the basis leaves nothing out."""
    values = np.random.default_rng(0).standard_normal((80, 9, 2)) * np.linspace(1, 4, 9)[:, None] * [1.0, 2.0]
    peer = PCA(3).fit(values.reshape(80, -1))
    settings = {"n_harmonics": 5, "residual_harmonics": 0, "tol": 1e-13, "max_iter": 20_000}
    shared = FunctionalPCA(3, noise="shared", **settings).fit(values)
    unbiased = 80 / 79  # scikit-learn divides by n - 1
    np.testing.assert_allclose(shared.noise_variance_ * unbiased, peer.noise_variance_, rtol=1e-4)
    overlap = np.abs((shared.components_.reshape(3, -1) * peer.components_).sum(axis=1))
    np.testing.assert_allclose(overlap, 1, atol=1e-4)
    np.testing.assert_allclose(
        shared.explained_variance_ * unbiased, peer.explained_variance_ - peer.noise_variance_, rtol=1e-3
    )


def test_a_channel_per_sample_is_factor_analysis():
    """Cycles of a single sample, each channel with its own noise: scikit-learn's FactorAnalysis, to its tolerance."""
    rng = np.random.default_rng(1)
    values = (
        rng.standard_normal((400, 2)) @ rng.standard_normal((2, 7))
        + rng.standard_normal((400, 7)) * np.linspace(0.3, 1.5, 7)
    )[:, None]
    peer = FactorAnalysis(2, tol=1e-10, max_iter=20_000).fit(values[:, 0])
    model = FunctionalPCA(2, n_harmonics=1, residual_harmonics=0, tol=1e-13, max_iter=20_000).fit(values)
    np.testing.assert_allclose(model.white_variance_, peer.noise_variance_, rtol=1e-3)
    np.testing.assert_allclose(model.score_samples(values), peer.score_samples(values[:, 0]), atol=1e-3)


def test_cycles_of_which_little_is_seen_have_no_sharp_scores(gappy):
    """Nor do they make variances larger: before, such cycles doubled them."""
    values = gappy[2].copy()
    model = FunctionalPCA(3, n_harmonics=10).fit(values)
    edges = np.concatenate([values, values[:30]])
    edges[60:, 6:] = np.nan
    again = FunctionalPCA(3, n_harmonics=10).fit(edges)
    np.testing.assert_allclose(again.explained_variance_, model.explained_variance_, rtol=0.05)
    _, sharp = model.transform(values[:1], return_cov=True)
    _, blunt = model.transform(edges[60:61], return_cov=True)
    assert (np.diagonal(blunt[0]) > 3 * np.diagonal(sharp[0])).all()
    assert (np.diagonal(blunt[0]) <= model.explained_variance_).all()


def test_a_channel_that_only_cycles_with_gaps_show_has_its_noise(gappy):
    values = gappy[0].copy()
    values[10:, :, 3] = np.nan
    values[:10, ::2, :3] = np.nan
    model = FunctionalPCA(2, n_harmonics=10).fit(values)
    assert np.isfinite(model.white_variance_).all()
    assert np.isfinite(model.score(values))


def test_bands_hold_hidden_samples_as_often_as_asked():
    truth, _ = low_rank(300, 64, 4, noise=0.1, seed=9)
    values, hidden = with_gaps(truth, 0.25, seed=9)
    model = FunctionalPCA(3, n_harmonics=10).fit(values[:200])
    filled, width = model.impute(values[200:], return_band=True, level=0.8)
    own = hidden[200:]
    assert (np.abs(filled - truth[200:]) <= width)[own].mean() == pytest.approx(0.8, abs=0.04)
    assert (width[~own] == 0).all()
    _, wide = model.impute(values[200:], return_band=True, level=0.9, simultaneous=True, seed=1)
    whole = [(np.abs(f - t) <= w)[h].all() for f, t, w, h in zip(filled, truth[200:], wide, own, strict=True)]
    assert np.mean(whole) == pytest.approx(0.9, abs=0.08)
    with pytest.raises(MotionError, match="level must be between 0 and 1, got 90"):
        model.impute(values, return_band=True, level=90)


def test_between_and_within_people_are_told_apart():
    """Figs. 9 and 10: people differ in one direction, each one's cycles in another."""
    rng = np.random.default_rng(8)
    basis = sampled_basis(64, 4)
    between, within = basis[:, 1], basis[:, 5]
    people, each = 12, 6
    own = np.repeat(10 * rng.standard_normal(people), each)
    values = own[:, None] * between + 2 * rng.standard_normal((people * each, 1)) * within
    values = (values + 0.05 * rng.standard_normal(values.shape))[..., None]
    cycles = as_cycles(with_gaps(values)[0], tuple(f"p{i // each}" for i in range(people * each)))
    pooled = FunctionalPCA(2, n_harmonics=8).fit(cycles)
    own_mean = FunctionalPCA(1, n_harmonics=8, centre="subject").fit(cycles)
    assert abs(pooled.components_[0, :, 0] @ between) > 0.99
    assert abs(own_mean.components_[0, :, 0] @ within) > 0.99
    assert own_mean.singular_values_[0] < pooled.singular_values_[0]
    assert own_mean.subject_means_.shape == (12, 64, 1)
    np.testing.assert_allclose(own_mean.subject_means_.mean(axis=0), own_mean.mean_)


@pytest.mark.parametrize("centre", ["all", "subject"])
def test_same_data_same_file_and_back(gappy, tmp_path, centre):
    cycles = as_cycles(gappy[2], tuple("abc"[i % 3] for i in range(60)))
    for name in ("one.npz", "two.npz"):
        FunctionalPCA(3, n_harmonics=10, centre=centre).fit(cycles).save(tmp_path / name, {"people": 3})
    assert (tmp_path / "one.npz").read_bytes() == (tmp_path / "two.npz").read_bytes()
    model, again = FunctionalPCA(3, n_harmonics=10, centre=centre).fit(cycles), load(tmp_path / "one.npz")
    assert again.card_ == {"people": 3}
    assert again.channels_ == model.channels_
    for name in ("mean_", "components_", "subject_means_", "explained_variance_", "errors_"):
        np.testing.assert_array_equal(getattr(again, name), getattr(model, name))
    np.testing.assert_array_equal(again.explained_variance_ratio_, model.explained_variance_ratio_)
    np.testing.assert_array_equal(again.impute(gappy[2]), model.impute(gappy[2]))


def test_channels_can_be_chosen(gappy):
    model = FunctionalPCA(2, n_harmonics=10).fit(as_cycles(gappy[2]), channels=("angle_3", "angle_0"))
    assert model.channels_ == ("angle_3", "angle_0")
    only = FunctionalPCA(2, n_harmonics=10).fit(as_cycles(gappy[2][..., [3, 0]]))
    np.testing.assert_array_equal(model.components_, only.components_)


def test_hidden_blocks_are_blocks_of_the_asked_share():
    hidden = hide_blocks(np.zeros((30, 100, 5)), 0.25, seed=0)
    assert hidden.mean() == pytest.approx(0.25, abs=1e-3)
    starts = (np.diff(hidden, axis=1, prepend=hidden[:, -1:]) > 0) & hidden
    assert hidden.sum() / starts.sum() > 15
    np.testing.assert_array_equal(hidden, hide_blocks(np.zeros((30, 100, 5)), 0.25, seed=0))


@pytest.mark.parametrize(
    ("change", "kwargs", "error", "says"),
    [
        (lambda v: v[:5], {"n_components": 5}, MotionError, "at least 6 cycles"),
        (lambda v: v * np.nan, {}, GapError, "no samples of any channel: angle_0"),
        (lambda v: np.where(v == v.max(), np.inf, v), {}, MotionError, "infinite"),
        (lambda v: np.zeros_like(v), {}, MotionError, "constant"),
        (lambda v: v, {"method": "magic"}, MotionError, "magic"),
        (lambda v: v, {"centre": "none"}, MotionError, "none"),
        (lambda v: v, {"n_components": 0}, MotionError, "n_components must be a number from 1 on, a share .* got 0"),
        (lambda v: v, {"n_components": 1.5}, MotionError, "got 1.5"),
        (lambda v: v, {"n_components": "many"}, MotionError, "got 'many'"),
        (lambda v: v, {"noise": "loud"}, MotionError, "noise must be one of channel, shared, got 'loud'"),
        (lambda v: v, {"max_iter": 0}, MotionError, "at least 1"),
        (lambda v: v, {"n_harmonics": 40}, MotionError, "n_harmonics"),
        (lambda v: v[:0], {}, MotionError, "cycles"),
    ],
)
def test_bad_input_is_refused(change, kwargs, error, says):
    values = low_rank()[0]
    with pytest.raises(error, match=says):
        FunctionalPCA(**{"n_components": 3, "n_harmonics": 10, **kwargs}).fit(as_cycles(change(values)))


@pytest.mark.parametrize("what", [[1, 2], "cycles", low_rank()[0][0]])
def test_what_is_no_cycles_is_named(what):
    with pytest.raises(MotionError, match=r"cycles must be Cycles, as motionenv\.segment makes them, or an array"):
        FunctionalPCA().fit(what)


def test_a_model_from_a_file_has_no_cycles_to_fill(gappy, tmp_path):
    FunctionalPCA(3, 10).fit(as_cycles(gappy[2])).save(tmp_path / "model.npz")
    with pytest.raises(ModelError, match="doesn't hold its cycles: fill gaps with impute"):
        _ = load(tmp_path / "model.npz").imputed_


def test_channels_that_no_cycle_shows_are_left_out():
    """The model is that of the other channels alone; asked for by name, a missing channel is refused."""
    values = low_rank()[0]
    less = as_cycles(np.where(np.arange(4) == 2, np.nan, values))
    kept = ("angle_0", "angle_1", "angle_3")
    model = FunctionalPCA(3, n_harmonics=10).fit(less)
    assert model.channels_ == kept
    alone = FunctionalPCA(3, n_harmonics=10).fit(as_cycles(values), channels=kept)
    np.testing.assert_array_equal(model.components_, alone.components_)
    with pytest.raises(MotionError, match="the channels are angle_0, angle_1, angle_3"):
        model.transform(values)
    with pytest.raises(GapError, match="angle_2"):
        FunctionalPCA(3, n_harmonics=10).fit(less, channels=less.channels)


def test_use_before_fit_and_wrong_shapes_are_refused(gappy):
    with pytest.raises(ModelError, match="fit"):
        FunctionalPCA().sample(1)
    model = FunctionalPCA(2, n_harmonics=10).fit(as_cycles(gappy[2]))
    with pytest.raises(MotionError, match="shape"):
        model.transform(np.zeros((3, 64, 5)))
    with pytest.raises(MotionError, match="no channel"):
        FunctionalPCA(2).fit(as_cycles(gappy[2]), channels=("nose",))
