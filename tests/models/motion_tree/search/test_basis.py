import numpy as np
import pytest

import motionenv
from motionenv.models.motion_tree.database import Clip, build_database
from motionenv.models.motion_tree.features import parameters
from motionenv.models.motion_tree.search.basis import fit_basis, project


@pytest.fixture(scope="module")
def database():
    """Sequences of many lengths, down to one window, more frames than are taken at a time."""
    model = motionenv.load("walk/fpca")
    lengths = [11, 12, 15, 19, 20, 21, 33, *[150] * 130]
    motions = [model.synthesize(seconds=n / 30, fps=30, seed=i) for i, n in enumerate(lengths)]
    return build_database([Clip(m) for m in motions])


def explicit(database, channels):
    """Standardised windows (n, 10 p), the last frame first, made one by one."""
    rows = []
    for k in range(len(database.clips)):
        frames = parameters(database.poses[database.starts[k] : database.starts[k + 1]])[:, channels]
        rows += [frames[t - 9 : t + 1][::-1] for t in range(9, len(frames) - 1)]
    windows = np.array(rows)
    last = windows[:, 0]
    scale = np.where(last.std(0) > 1e-6, last.std(0), 1.0)
    return ((windows - last.mean(0)) / scale).reshape(len(rows), -1)


@pytest.mark.parametrize("channels", [np.arange(50), np.array([13, 14, 15, 16, 38, 39, 40, 41])], ids=["body", "arm"])
def test_components_are_those_of_the_windows_themselves(database, channels):
    basis = fit_basis(database, channels)
    windows = explicit(database, channels)
    _, singular, axes = np.linalg.svd(windows - windows.mean(0), full_matrices=False)
    b = int(np.log2(len(windows)))
    assert basis.components.shape == (b, 10, len(channels))
    deviation = singular / np.sqrt(len(windows))
    np.testing.assert_allclose(basis.deviation, deviation[:b], rtol=1e-4)
    assert basis.share == pytest.approx((deviation[:b] ** 2).sum() / (deviation**2).sum(), rel=1e-5)
    cosines = np.abs(np.einsum("bn,bn->b", basis.components.reshape(b, -1), axes[:b]))
    np.testing.assert_allclose(cosines, 1, atol=1e-5)


def test_projection_is_that_of_the_windows_themselves(database):
    basis = fit_basis(database, np.arange(50))
    windows = explicit(database, np.arange(50))
    b = len(basis.deviation)
    wanted = (windows - windows.mean(0)) @ basis.components.reshape(b, -1).T / basis.deviation
    out = np.empty((len(windows), b), dtype=np.float32)
    project(database, basis, out)
    np.testing.assert_allclose(out, wanted, atol=2e-4)
    np.testing.assert_allclose(out.std(0), 1, rtol=1e-4)


def test_coefficients_of_a_history_are_those_of_its_window(database):
    basis = fit_basis(database, np.arange(50))
    out = np.empty((len(database.windows), len(basis.deviation)), dtype=np.float32)
    project(database, basis, out)
    i = int(np.searchsorted(database.windows, database.starts[-2] + 40))
    history = database.poses[database.starts[-2] : database.windows[i] + 1]
    np.testing.assert_allclose(basis.coefficients(parameters(history)), out[i], atol=1e-4)


def test_what_does_not_vary_is_left_alone():
    """A body that stands still, but for one elbow."""
    from motionenv.body import from_height
    from motionenv.types import Motion

    poses = np.zeros((40, 25))
    poses[:, 12] = np.sin(np.arange(40))
    basis = fit_basis(build_database([Clip(Motion(poses, from_height(), 30.0))]), np.arange(50))
    assert np.isfinite(basis.components).all()
    assert (basis.scale[[c for c in range(50) if c not in (12, 37)]] == 1).all()
    assert len(basis.deviation) <= 2  # a sine has two axes
    assert basis.share > 0.999
