"""The compiled walks against the model's own curves, SciPy's splines and filters, and forward kinematics."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BSpline
from scipy.ndimage import gaussian_filter1d

import motionenv
from motionenv._core.compilation import kernel
from motionenv.body import from_height
from motionenv.body.kinematics import feet
from motionenv.errors import MotionError
from motionenv.models.walking import _walk_kernels as kernels
from motionenv.models.walking.model import WalkingModel
from motionenv.types import POSE

HINGES = [i for i, name in enumerate(POSE) if "elbow" in name or "knee" in name]
#: Columns of a pose that contact leaves alone: all angles but flexion and abduction of the hips.
FREE = [i for i, name in enumerate(POSE) if i > 2 and not ("hip" in name and "rotation" not in name)]


@kernel
def legs(w, floor, offsets, height):
    kernels._legs(w, floor, offsets, height)


@kernel
def balls_of(rows, samples, height):
    kernels._balls(rows, samples, height)


@kernel
def soften(values, softness):
    kernels.soften(values, softness)


@kernel
def decay(a):
    return kernels.decay(a)


@kernel
def smooth(values, samples, deviation, out):
    kernels.smooth(values, samples, deviation, out)


@pytest.fixture(scope="module")
def model() -> WalkingModel:
    return motionenv.load("walk/fpca")


def check_angles(model, seconds, fps, n, seed, phase, variation) -> None:
    """Compare angles with the model's curves at scores that follow SciPy's splines; knees and elbows stop softly."""
    rng = np.random.default_rng(seed)
    stride, frames = model.sample(n, seed=rng), int(seconds * fps) + 1
    shortest = min(0.5, stride.seconds.min())
    count = int((seconds + 1) / shortest) + 5
    points = variation * rng.standard_normal((n, count, stride.scores.shape[1]))
    poses = np.empty((n, frames, 25))
    body = model.skeleton()
    bodies = np.repeat(body.offsets[None], n, axis=0), np.full(n, body.height)
    model._walk(stride, points, fps, phase, np.zeros(n), shortest, bodies, poses)
    for i in range(n):
        cycles = np.arange(frames) / fps / stride.seconds[i]
        begun = 0.2 / stride.seconds[i]  # the spline begins 0.2 s before the first pose
        scores = stride.scores[i] + BSpline(np.arange(-3, count + 1), points[i], 3)(cycles + begun)
        channels = model.fpca_.evaluate(scores[None], phase + cycles[None])[0]
        expected = np.concatenate([np.zeros((frames, 3)), channels[:, 19:22], channels[:, :19]], axis=1)
        expected[:, HINGES] = 0.03 * np.logaddexp(0.0, expected[:, HINGES] / 0.03)
        expected[:, 5] += poses[i, 0, 5] - expected[0, 5]  # walks are turned so that they go along x
        np.testing.assert_allclose(poses[i][:, FREE], expected[:, FREE], rtol=0, atol=1e-9)


@given(
    seconds=st.floats(0.2, 8), fps=st.sampled_from([1, 12, 30, 60]), n=st.integers(1, 40), seed=st.integers(0, 2**32),
    phase=st.floats(-3, 3), variation=st.floats(0, 2),
)  # fmt: skip
@settings(max_examples=40, deadline=None)
def test_angles_follow_the_curves_of_the_model(model, seconds, fps, n, seed, phase, variation):
    check_angles(model, seconds, fps, n, seed, phase, variation)


@pytest.mark.parametrize(("components", "harmonics"), [(1, 1), (3, 5)])
def test_other_numbers_of_components_and_harmonics(model, components, harmonics):
    arrays, meta = model.to_arrays()
    keep = [0, *range(1, harmonics), *range(12, 11 + harmonics)]
    arrays = {k: v[:components] if k in ("fpca_explained_variance_",) else v for k, v in arrays.items()}
    arrays["fpca_component_coefficients_"] = arrays["fpca_component_coefficients_"][:components, keep]
    arrays["fpca_subject_coefficients_"] = arrays["fpca_subject_coefficients_"][:, keep]
    person = [*range(components), -2, -1]
    arrays["person_mean_"] = arrays["person_mean_"][person]
    arrays["person_covariance_"] = arrays["person_covariance_"][np.ix_(person, person)]
    arrays["cycle_covariance_"] = arrays["cycle_covariance_"][:components, :components]
    arrays |= {f"pace_{name}": arrays[f"pace_{name}"][:components] for name in ("weights", "direction", "between")}
    arrays["pace_curvature"] = arrays["pace_curvature"][:components, :components]
    fpca = {**meta["fpca"], "settings": {**meta["fpca"]["settings"], "n_components": components}}
    fpca["settings"]["n_harmonics"] = harmonics
    small = WalkingModel.from_arrays(arrays, {**meta, "fpca": fpca})
    check_angles(small, 2, 30, 3, 1, 0.1, 1.0)


def test_feet_are_where_kinematics_puts_them():
    """In every posture, also with a leg straight out to the side, whose foot can't be level."""
    lanes, body = kernels.LANES, from_height(1.8)
    poses = np.random.default_rng(0).uniform(-1.5, 1.5, (lanes, 25))
    poses[:, :2], poses[:, 2] = 0, np.linspace(0.5, 1.2, lanes)
    poses[:, [20, 24]] = np.abs(poses[:, [20, 24]]) + 1.5  # far from the stop of the knees
    poses[3, 3:6], poses[3, [17, 19, 21, 23]], poses[3, [18, 22]] = 0, 0, np.pi / 2
    w = np.zeros(kernels._BLOCK * lanes)
    w[: 11 * lanes] = poses[:, [3, 4, 5, *range(17, 25)]].T.ravel()
    legs(w, np.zeros(2), body.offsets, body.height)
    rows = np.zeros((kernels.ROWS, lanes))
    rows[: 2 * kernels.LEG_ROWS] = w[kernels._OUT * lanes :].reshape(-1, lanes)
    rows[kernels.Z] = poses[:, 2]
    balls_of(rows, lanes, body.height)
    ankles, balls = feet(poses, body)
    for side in range(2):
        leg = rows[kernels.LEG_ROWS * side :]
        raised = leg[kernels.ANKLE_Z] + poses[:, 2]
        np.testing.assert_allclose(np.stack([leg[0], leg[1], raised], axis=-1), ankles[:, side], atol=1e-12)
        found = rows[kernels._BALLS + 2 * side : kernels._BALLS + 2 * side + 2].T
        np.testing.assert_allclose(found, balls[:, side, :2], atol=1e-9)


@pytest.mark.parametrize("a", [0.0, 1e-300, 1e-9, 0.3, 1.0, 7.0, 39.9])
def test_exponentials_and_soft_stops(a):
    assert decay(a) == pytest.approx(np.exp(-a), rel=1e-13)
    values = np.resize([-a, a], kernels.LANES)
    soft = 0.03 * np.logaddexp(0, values / 0.03)
    soften(values, 0.03)
    np.testing.assert_allclose(values, soft, rtol=1e-13, atol=1e-18)


@pytest.mark.parametrize("deviation", [0.6, 3.0, 50.0])
def test_smoothing_is_scipys(deviation):
    values, out = np.random.default_rng(0).standard_normal(70), np.empty(70)
    smooth(values, 70, deviation, out)
    np.testing.assert_allclose(out, gaussian_filter1d(values, deviation, mode="nearest"), atol=1e-14)


@pytest.mark.parametrize(
    ("change", "names"),
    [
        ({"scores": np.zeros((1, 9))}, r"scores \(1, 8\)"),
        ({"scores": np.full((1, 8), np.nan)}, "finite scores"),
        ({"seconds": np.zeros(1)}, "from 0.05 to 60 s"),
        ({"seconds": np.array([np.nan])}, "from 0.05 to 60 s"),
        ({"seconds": np.array([1e-9])}, "nearer to the average"),
    ],
)
def test_walkers_that_cannot_be_are_refused(model, change, names):
    with pytest.raises(MotionError, match=names):
        model.walks(1, 30, n=1, stride=replace(model.sample(1, seed=0), **change))
