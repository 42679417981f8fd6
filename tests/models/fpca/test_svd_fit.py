"""Fig. 8 without its detours, against numpy's SVD and the steps as the paper writes them."""

import numpy as np

from motionenv.models.fpca.fourier_basis import sampled_basis
from motionenv.models.fpca.model import FunctionalPCA
from motionenv.models.fpca.observations import Observations, column_sums, group_centres
from motionenv.models.fpca.svd_fit import fit_svd
from tests.models.fpca.made_cycles import as_cycles, low_rank, with_gaps


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


def test_a_large_fig_8_starts_from_more_components_and_ends_where_small_steps_end():
    values = with_gaps(low_rank(1100, 32, 4, noise=0.3)[0])[0]
    large = FunctionalPCA(3, n_harmonics=8, method="svd").fit(as_cycles(values))
    exact = FunctionalPCA(3, n_harmonics=8, method="svd", tol=1e-12).fit(as_cycles(values))
    assert large.errors_[-1] <= exact.errors_[-1] * (1 + 1e-6)
    assert np.diff(large.errors_).max() <= 0
    overlap = np.linalg.svd(large.components_.reshape(3, -1) @ exact.components_.reshape(3, -1).T)[1]
    assert overlap.min() > 1 - 1e-5


def test_errors_and_noise_are_those_of_the_samples_that_are_seen():
    """Against least-squares scores of each cycle, given the components that were found."""
    values, basis = with_gaps(low_rank(30, 32, 2, 2, noise=0.2)[0])[0], sampled_basis(32, 6)
    groups = np.zeros(30, dtype=int)
    data = Observations(values, basis, group_centres(column_sums(values, groups), basis), groups)
    centre, components, variance, noise, errors = fit_svd(data, 2, 1e-12, 2000)
    curves = (basis @ components).reshape(2, -1)
    rest = (values - basis @ centre[0]).reshape(30, -1)
    for row in rest:
        seen = np.isfinite(row)
        row[seen] -= curves[:, seen].T @ np.linalg.lstsq(curves[:, seen].T, row[seen], rcond=None)[0]
    np.testing.assert_allclose(errors[-1], np.sqrt(np.nansum(rest**2)), rtol=1e-5)
    np.testing.assert_allclose(noise, np.nanmean(rest.reshape(30, 32, 2) ** 2, axis=(0, 1)), rtol=1e-3)
    assert variance[0] > variance[1] > 0
