"""Functional PCA against closed forms, brute force, Theorem 1, and its own laws."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import multivariate_normal, norm

from benchmarks.models.imputation import hide_blocks, imputation_error
from motionenv.errors import GapError, ModelError, MotionError
from motionenv.models.fpca.em_fit import Parameters, e_step, log_likelihood
from motionenv.models.fpca.fourier_basis import fourier_basis, sampled_basis
from motionenv.models.fpca.model import FunctionalPCA
from motionenv.models.fpca.observations import Observations, functions
from motionenv.models.fpca.residual import expected_residual, residual_model
from motionenv.models.registry import load
from motionenv.types import Cycles


def as_cycles(values, subject=None) -> Cycles:
    k, _, m = values.shape
    channels = tuple(f"angle_{a}" for a in range(m))
    return Cycles(values, channels, np.ones(k), np.arange(k), subject or ("one",) * k)


def low_rank(k=60, p=64, m=4, q=3, noise=0.05, seed=0, n_harmonics=6):
    """Cycles (k, p, m) of q smooth components with falling variance, and the components."""
    rng = np.random.default_rng(seed)
    basis = sampled_basis(p, n_harmonics)
    w = np.linalg.qr(rng.standard_normal((basis.shape[1] * m, q)))[0].T.reshape(q, -1, m)
    scores = rng.standard_normal((k, q)) * 8 * 0.6 ** np.arange(q)
    mean = basis @ rng.standard_normal((basis.shape[1], m))
    components = basis @ w
    return mean + np.tensordot(scores, components, axes=1) + noise * rng.standard_normal((k, p, m)), components


def with_gaps(values, share=0.2, seed=1):
    hidden = hide_blocks(values, share, seed=seed)
    return np.where(hidden, np.nan, values), hidden


@pytest.fixture(scope="module")
def gappy():
    truth, components = low_rank()
    values, hidden = with_gaps(truth)
    return truth, components, values, hidden


def test_without_gaps_fig_8_is_the_svd_of_the_smoothed_cycles():
    values = np.random.default_rng(0).standard_normal((12, 48, 3))
    model = FunctionalPCA(4, n_harmonics=6, method="svd").fit(as_cycles(values))
    spectrum = np.fft.rfft(values - values.mean(axis=0), axis=1)
    spectrum[:, 6:] = 0
    smooth = np.fft.irfft(spectrum, 48, axis=1).reshape(12, -1)
    _, s, vt = np.linalg.svd(smooth)
    np.testing.assert_allclose(model.singular_values_, s[:4])
    np.testing.assert_allclose(np.abs(np.sum(model.components_.reshape(4, -1) * vt[:4], axis=1)), 1)


def test_fig_8_ends_where_its_literal_steps_end(gappy):
    """Impute, project, truncate the SVD, repeat (real basis): the same error and components, in fewer iterations."""
    values = gappy[2]
    seen, basis = np.isfinite(values), sampled_basis(64, 10)
    x2 = np.where(seen, values - basis @ (basis.T @ np.nanmean(values, axis=0)), 0.0)
    errors = [np.inf]
    while len(errors) < 3 or errors[-2] - errors[-1] > 1e-9 * errors[-1]:
        u, s, vt = np.linalg.svd((basis.T @ x2).reshape(60, -1), full_matrices=False)
        x5 = basis @ ((u[:, :3] * s[:3]) @ vt[:3]).reshape(60, -1, 4)
        errors.append(np.linalg.norm(x2 - x5))
        x2 = np.where(seen, x2, x5)
    model = FunctionalPCA(3, n_harmonics=10, method="svd", tol=1e-9).fit(as_cycles(values))
    assert model.errors_[-1] <= errors[-1] * (1 + 1e-6)
    assert len(model.errors_) < len(errors)
    np.testing.assert_allclose(model.singular_values_, s[:3], rtol=1e-4)
    components = (basis @ vt[:3].reshape(3, -1, 4)).reshape(3, -1)
    np.testing.assert_allclose(np.abs(np.sum(model.components_.reshape(3, -1) * components, axis=1)), 1, rtol=1e-6)


@pytest.mark.parametrize("method", ["svd", "ppca"])
def test_directions_without_variance_do_not_count(method):
    values = low_rank(k=20, q=2, noise=0.0)[0]
    model = FunctionalPCA(4, n_harmonics=6, method=method, residual_harmonics=0).fit(as_cycles(values))
    model.explained_variance_[2:] = 0.0
    expected = norm(0, np.sqrt(model.explained_variance_[:2])).logpdf(model.scores_[:, :2]).sum(axis=1)
    np.testing.assert_allclose(model.score_samples(model.scores_), expected)


def test_posterior_and_likelihood_are_those_of_the_dense_gaussian():
    rng = np.random.default_rng(3)
    values = with_gaps(rng.standard_normal((5, 12, 3)), 0.3)[0]
    basis = sampled_basis(12, 3)
    w, mean, centre = rng.standard_normal((15, 2)), rng.standard_normal((1, 15)), rng.standard_normal((1, 5, 3))
    parameters = Parameters(w, mean, np.array([0.3, 0.5, 0.8]))
    data = Observations(values, basis, centre, np.zeros(5, int))
    found = e_step(data, parameters)
    z, covariance = found.z, found.covariance
    loglik = 0.5 * (found.twice - data.square @ (1 / parameters.noise))
    assert log_likelihood(data, parameters.noise, found) == pytest.approx(loglik.sum())
    loading = functions(w, basis, 3).reshape(-1, 2)
    level, noise = (functions(mean.T, basis, 3)[..., 0] + basis @ centre[0]).ravel(), np.tile(parameters.noise, 12)
    for k, y in enumerate(values.reshape(5, -1)):
        o = np.isfinite(y)
        full = loading[o] @ loading[o].T + np.diag(noise[o])
        gain = loading[o].T @ np.linalg.inv(full)
        np.testing.assert_allclose(z[k], gain @ (y - level)[o])
        np.testing.assert_allclose(covariance[k], np.eye(2) - gain @ loading[o], atol=1e-12)
        np.testing.assert_allclose(loglik[k], multivariate_normal(level[o], full).logpdf(y[o]))


def test_without_gaps_maximum_likelihood_is_the_closed_form():
    """Tipping & Bishop (1999), eq. 7 and 8, where the basis leaves nothing out; noise is made the same by symmetry."""
    values = np.random.default_rng(0).standard_normal((40, 9, 1)) * np.linspace(1, 4, 9)[:, None]
    model = FunctionalPCA(2, n_harmonics=5, residual_harmonics=0, tol=1e-12, max_iter=5000).fit(as_cycles(values))
    eigenvalues = np.linalg.eigvalsh(np.cov(values[..., 0].T, bias=True))[::-1]
    noise = eigenvalues[2:].mean()
    np.testing.assert_allclose(model.noise_variance_, noise, rtol=1e-3)
    np.testing.assert_allclose(model.explained_variance_, eigenvalues[:2] - noise, rtol=1e-3)


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


def test_smooth_residuals_are_filled_as_dense_kriging_does():
    rng = np.random.default_rng(5)
    basis = sampled_basis(32, 4)
    spectrum, white = np.full((2, 7), 3.0), np.array([0.1, 0.4])
    residuals = with_gaps(rng.standard_normal((3, 32, 2)), 0.3)[0]
    filled = expected_residual(residuals, basis, spectrum, white)
    for k in range(3):
        for a in range(2):
            o = np.isfinite(residuals[k, :, a])
            prior = basis @ np.diag(spectrum[a]) @ basis.T
            weights = np.linalg.solve(prior[np.ix_(o, o)] + white[a] * np.eye(o.sum()), residuals[k, o, a])
            np.testing.assert_allclose(filled[k, :, a], prior[:, o] @ weights)


def test_the_residual_spectrum_is_recovered():
    rng = np.random.default_rng(6)
    basis = sampled_basis(64, 4)
    true = np.array([4.0, 2.0, 1.0, 0.5, 2.0, 1.0, 0.5])
    u = rng.standard_normal((800, 2, 7)) * np.sqrt(true)
    residuals = np.moveaxis(u @ basis.T, 1, 2) + 0.1 * rng.standard_normal((800, 64, 2))
    spectrum, white = residual_model(with_gaps(residuals)[0], basis)
    np.testing.assert_allclose(spectrum, np.tile(true, (2, 1)), rtol=0.15)
    np.testing.assert_allclose(white, 0.01, rtol=0.05)


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


def test_samples_have_the_models_mean_and_variance_and_come_back_by_seed(gappy):
    model = FunctionalPCA(3, n_harmonics=10).fit(as_cycles(gappy[2]))
    drawn = model.sample(4000, seed=7)
    scores = model.transform(drawn)
    se = np.sqrt(model.explained_variance_ / 4000)
    assert (np.abs(scores.mean(axis=0)) < 5 * se).all()
    np.testing.assert_allclose(scores.var(axis=0), model.explained_variance_, rtol=0.12)
    assert drawn.tobytes() == model.sample(4000, seed=np.random.default_rng(7)).tobytes()


def test_log_density_is_that_of_independent_normals(gappy):
    model = FunctionalPCA(3, n_harmonics=10).fit(as_cycles(gappy[2]))
    expected = norm(0, np.sqrt(model.explained_variance_)).logpdf(model.scores_).sum(axis=1)
    np.testing.assert_allclose(model.score_samples(model.scores_), expected)
    np.testing.assert_allclose(model.score(gappy[2]), expected.mean())


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


def test_a_large_fit_that_starts_from_a_part_ends_where_others_do():
    values = with_gaps(low_rank(1100, 32, 2, noise=0.3)[0])[0]
    large = FunctionalPCA(3, n_harmonics=8, tol=1e-9).fit(as_cycles(values))
    part = FunctionalPCA(3, n_harmonics=8, tol=1e-9).fit(as_cycles(values[:999]))
    overlap = np.linalg.svd(large.components_.reshape(3, -1) @ part.components_.reshape(3, -1).T)[1]
    assert overlap.min() > 0.999
    assert len(large.errors_) < len(part.errors_)


def test_a_large_fig_8_starts_from_more_components_and_ends_where_small_steps_end():
    values = with_gaps(low_rank(1100, 32, 4, noise=0.3)[0])[0]
    large = FunctionalPCA(3, n_harmonics=8, method="svd").fit(as_cycles(values))
    exact = FunctionalPCA(3, n_harmonics=8, method="svd", tol=1e-12).fit(as_cycles(values))
    assert large.errors_[-1] <= exact.errors_[-1] * (1 + 1e-6)
    assert np.diff(large.errors_).max() <= 0
    overlap = np.linalg.svd(large.components_.reshape(3, -1) @ exact.components_.reshape(3, -1).T)[1]
    assert overlap.min() > 1 - 1e-5


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


def test_the_basis_is_orthonormal_and_matches_the_fft():
    basis = sampled_basis(64, 20)
    np.testing.assert_allclose(basis.T @ basis, np.eye(39), atol=1e-12)
    x = np.random.default_rng(0).standard_normal(64)
    spectrum = np.fft.rfft(x)
    spectrum[20:] = 0
    np.testing.assert_allclose(basis @ (basis.T @ x), np.fft.irfft(spectrum, 64), atol=1e-12)
    with pytest.raises(MotionError, match="n_harmonics"):
        fourier_basis(0.0, 20, 38)


@pytest.mark.parametrize(
    ("change", "kwargs", "error", "says"),
    [
        (lambda v: v[:5], {"n_components": 5}, MotionError, "at least 6 cycles"),
        (lambda v: np.where(np.arange(4) == 2, np.nan, v), {}, GapError, "angle_2"),
        (lambda v: np.where(v == v.max(), np.inf, v), {}, MotionError, "infinite"),
        (lambda v: np.zeros_like(v), {}, MotionError, "constant"),
        (lambda v: v, {"method": "magic"}, MotionError, "magic"),
        (lambda v: v, {"centre": "none"}, MotionError, "none"),
        (lambda v: v, {"n_components": 0}, MotionError, "at least 1"),
        (lambda v: v, {"n_harmonics": 40}, MotionError, "n_harmonics"),
        (lambda v: v[:0], {}, MotionError, "cycles"),
    ],
)
def test_bad_input_is_refused(change, kwargs, error, says):
    values = low_rank()[0]
    with pytest.raises(error, match=says):
        FunctionalPCA(**{"n_components": 3, "n_harmonics": 10, **kwargs}).fit(as_cycles(change(values)))


def test_use_before_fit_and_wrong_shapes_are_refused(gappy):
    with pytest.raises(ModelError, match="fit"):
        FunctionalPCA().sample(1)
    model = FunctionalPCA(2, n_harmonics=10).fit(as_cycles(gappy[2]))
    with pytest.raises(MotionError, match="shape"):
        model.transform(np.zeros((3, 64, 5)))
    with pytest.raises(MotionError, match="no channel"):
        FunctionalPCA(2).fit(as_cycles(gappy[2]), channels=("nose",))
