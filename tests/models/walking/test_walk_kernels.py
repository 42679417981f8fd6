"""The compiled walks against the same in NumPy, which evaluates every sample of every channel by itself."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter1d

import motionenv
from motionenv.body import from_height
from motionenv.body.kinematics import feet
from motionenv.body.skeleton import ANKLE_HEIGHT
from motionenv.errors import MotionError
from motionenv.models.walking import _contact_kernels as contact
from motionenv.models.walking import _walk_kernels as kernels
from motionenv.models.walking.model import Stride, WalkingModel
from motionenv.types import POSE, Skeleton

HINGES = [i for i, name in enumerate(POSE) if "elbow" in name or "knee" in name]
HIPS = [POSE.index("left_hip_flexion"), POSE.index("right_hip_flexion")]  # abduction comes next
MIDSWING = np.array([0.8, 0.3])


@pytest.fixture(scope="module")
def model() -> WalkingModel:
    return motionenv.load("walk/fpca")


def walked(model: WalkingModel, seconds, fps, n, seed, speed, phase, variation, height) -> np.ndarray:
    """What `synthesize` gives, (n, frames, 25), after the steps that its docstrings tell."""
    rng = np.random.default_rng(seed)
    body = model.skeleton(height)
    relative = None if speed is None else speed * model.height_ / body.height
    stride = model.sample(n, seed=rng, speed=relative)
    frames, shortest = round(seconds * fps), min(0.5, stride.seconds.min())
    count = int(np.ceil((frames / fps + 0.4) / shortest)) + 5
    values, vectors = np.linalg.eigh(model.cycle_covariance_)
    root = vectors * np.sqrt(np.maximum(values, 0)) @ vectors.T
    wobble = variation * rng.standard_normal((n, count, len(root))) @ root / np.sqrt(0.48)
    for _ in range(0 if speed is None else 4):
        x = one_pace(model, stride, frames + 1, fps, body, phase, wobble)[..., 0]
        pace = (x[:, -1] - x[:, 0]) * fps / frames
        stride = replace(stride, seconds=np.maximum(stride.seconds * (pace / speed) ** 0.75, shortest))
    return one_pace(model, stride, frames, fps, body, phase, wobble)


def one_pace(model, stride: Stride, frames: int, fps: float, body: Skeleton, phase, wobble) -> np.ndarray:
    """Poses (n, frames, 25): the cycles played at the stride's pace, on a root moved by contact."""
    finer = int(np.ceil(60 / fps))
    rate = fps * finer
    pad = int(np.ceil(0.2 * rate))
    clock = np.arange(-pad, (frames - 1) * finer + 1 + pad) / rate
    cycles = clock / stride.seconds[:, None]
    scores = stride.scores[:, None] + b_spline(wobble, (clock + pad / rate) / stride.seconds[:, None])
    channels = model.fpca_.evaluate(scores, phase + cycles)
    poses = np.zeros((*channels.shape[:2], 25))
    poses[..., 6:], poses[..., 3:6] = channels[..., :19], channels[..., 19:22]
    poses[..., HINGES] = 0.03 * np.logaddexp(0.0, poses[..., HINGES] / 0.03)
    floor = np.percentile(model.fpca_.inverse_transform(stride.scores)[..., 22:], 10, axis=1)[:, None]
    heights = ANKLE_HEIGHT + 0.002 * np.logaddexp(0.0, (channels[..., 22:] - floor) / 0.002)
    carry(poses, body.height * heights, phase + cycles, rate, body)
    poses = poses[:, pad : len(clock) - pad : finer]
    poses[..., :2] -= poses[:, :1, :2]
    return poses


def b_spline(points: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Uniform cubic B-splines (n, frames, q) with control points (n, k, q) at parameters (n, frames) from 0."""
    first = np.floor(at).astype(np.intp)
    u = (at - first)[..., None]
    basis = ((1 - u) ** 3, 3 * u**3 - 6 * u**2 + 4, -3 * u**3 + 3 * u**2 + 3 * u + 1, u**3)
    rows = np.arange(len(points))[:, None]
    return sum(b * points[rows, first + i] for i, b in enumerate(basis)) / 6.0


def carry(poses, heights, phase, rate, body) -> None:
    """Move the roots of poses (n, samples, 25), at the origin, over the ground so that standing feet stand still."""
    ankles = feet(poses, body)[0]
    back = -np.gradient(ankles[..., 0], 1 / rate, axis=1)
    stands = np.exp((back - back.max(-1, keepdims=True)) / 0.15)
    stands /= stands.sum(-1, keepdims=True)
    poses[..., 2] = (smooth(stands, 0.05 * rate) * (heights - ankles[..., 2])).sum(-1)
    ankles, balls = feet(poses, body)
    ball = balls[..., :2]
    velocity = smooth(-(stands[..., None] * np.gradient(ball, 1 / rate, axis=1)).sum(2), 0.01 * rate)
    poses[:, 1:, :2] = np.cumsum(0.5 * (velocity[:, 1:] + velocity[:, :-1]), axis=1) / rate
    ball = ball + poses[:, :, None, :2]
    slip = places(ball, stands, phase) - ball
    surely = (stands * np.exp(-((slip / 0.04) ** 2).sum(-1)))[..., None]
    plant(poses, smooth(surely * slip, 0.015 * rate) / (smooth(surely, 0.015 * rate) + 0.1), ankles, body)


def places(ball, stands, phase) -> np.ndarray:
    """Mean place (n, samples, 2, 2) of the balls over the step that a sample belongs to, weighted by `stands`."""
    step = np.floor(phase[..., None] - MIDSWING)
    out = np.empty_like(ball)
    for walk, side in np.ndindex(len(ball), 2):
        for s in np.unique(step[walk, :, side]):
            mine = step[walk, :, side] == s
            weight = stands[walk, mine, side]
            out[walk, mine, side] = weight @ ball[walk, mine, side] / max(weight.sum(), 1e-9)
    return out


def plant(poses, slip, ankles, body) -> None:
    """Turn the hips so that the feet move by `slip` (n, samples, 2, 2)."""
    forward, left = np.cos(poses[..., 5]), np.sin(poses[..., 5])
    for side, outwards in enumerate((1, -1)):
        depth = poses[..., 2] + body.offsets[9 + side, 2] - ankles[..., side, 2]
        x, y = slip[..., side, 0], slip[..., side, 1]
        poses[..., HIPS[side]] += (forward * x + left * y) / depth
        poses[..., HIPS[side] + 1] += outwards * (forward * y - left * x) / np.hypot(depth, ankles[..., side, 0])


def smooth(values, frames) -> np.ndarray:
    return gaussian_filter1d(values, frames, axis=1, mode="nearest")


@given(
    seconds=st.floats(0.2, 4), fps=st.floats(10, 240), n=st.integers(1, 3), seed=st.integers(0, 2**32),
    speed=st.none() | st.floats(0.3, 2.4), phase=st.floats(-3, 3), variation=st.floats(0, 2),
    height=st.none() | st.floats(1.5, 2.1),
)  # fmt: skip
@example(seconds=4, fps=30, n=40, seed=0, speed=1.3, phase=0.0, variation=1.0, height=None)  # in threads
@example(seconds=4, fps=12, n=2, seed=0, speed=None, phase=0.8, variation=0.0, height=1.3)
@example(seconds=1, fps=1, n=1, seed=0, speed=1.0, phase=0.0, variation=1.0, height=None)
@example(seconds=30, fps=1000, n=1, seed=0, speed=None, phase=0.3, variation=1.0, height=None)
@settings(max_examples=60)
def test_walks_are_what_numpy_makes_of_every_sample(model, seconds, fps, n, seed, speed, phase, variation, height):
    expected = walked(model, seconds, fps, n, seed, speed, phase, variation, height)
    request = {"speed": speed, "phase": phase, "variation": variation, "height": height}
    motion = model.walks(seconds, fps, n=n, seed=seed, **request)
    np.testing.assert_allclose(motion.poses, expected, rtol=0, atol=1e-9)


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
    fpca = {**meta["fpca"], "settings": {**meta["fpca"]["settings"], "n_components": components}}
    fpca["settings"]["n_harmonics"] = harmonics
    small = WalkingModel.from_arrays(arrays, {**meta, "fpca": fpca})
    expected = walked(small, 2, 30, 3, 1, None, 0.1, 1.0, None)
    poses = small.walks(2, 30, n=3, seed=1, phase=0.1).poses
    np.testing.assert_allclose(poses, expected, rtol=0, atol=1e-9)


def test_feet_are_where_kinematics_puts_them():
    """In every posture, also with a leg straight out to the side, whose foot can't be level."""
    lanes, body = contact.LANES, from_height(1.8)
    poses = np.random.default_rng(0).uniform(-1.5, 1.5, (lanes, 25))
    poses[:, :2], poses[:, 2] = 0, np.linspace(0.5, 1.2, lanes)
    poses[:, [20, 24]] = np.abs(poses[:, [20, 24]]) + 1.5  # far from the stop of the knees
    poses[3, 3:6], poses[3, [17, 19, 21, 23]], poses[3, [18, 22]] = 0, 0, np.pi / 2
    w = np.zeros(kernels._WORK * lanes)
    w[: 11 * lanes] = poses[:, [3, 4, 5, *range(17, 25)]].T.ravel()
    kernels._legs(w, (0.0, 0.0), body.offsets, body.height)
    rows = np.zeros((contact.ROWS, lanes))
    rows[: 2 * contact.LEG_ROWS] = w[kernels._OUT * lanes :].reshape(-1, lanes)
    rows[contact.Z] = poses[:, 2]
    contact._balls(rows, lanes, body.height)
    ankles, balls = feet(poses, body)
    for side in range(2):
        leg = rows[contact.LEG_ROWS * side :]
        raised = leg[contact.ANKLE_Z] + poses[:, 2]
        np.testing.assert_allclose(np.stack([leg[0], leg[1], raised], axis=-1), ankles[:, side], atol=1e-12)
        found = rows[contact._BALLS + 2 * side : contact._BALLS + 2 * side + 2].T
        np.testing.assert_allclose(found, balls[:, side, :2], atol=1e-9)


@pytest.mark.parametrize("a", [0.0, 1e-300, 1e-9, 0.3, 1.0, 7.0, 39.9])
def test_exponentials_and_soft_stops(a):
    assert contact.decay(a) == pytest.approx(np.exp(-a), rel=1e-13)
    values = np.resize([-a, a], contact.LANES)
    soft = 0.03 * np.logaddexp(0, values / 0.03)
    kernels.soften(values, 0.03)
    np.testing.assert_allclose(values, soft, rtol=1e-13, atol=1e-18)


@pytest.mark.parametrize("deviation", [0.6, 3.0, 50.0])
def test_smoothing_is_scipys(deviation):
    values, out = np.random.default_rng(0).standard_normal(70), np.empty(70)
    contact.smooth(values, 70, deviation, out)
    np.testing.assert_allclose(out, gaussian_filter1d(values, deviation, mode="nearest"), atol=1e-14)


@pytest.mark.parametrize(
    ("change", "names"),
    [
        ({"scores": np.zeros((1, 9))}, r"scores \(1, 8\)"),
        ({"scores": np.full((1, 8), np.nan)}, "finite scores"),
        ({"seconds": np.zeros(1)}, "above 0 s"),
        ({"seconds": np.array([np.nan])}, "above 0 s"),
    ],
)
def test_walkers_that_cannot_be_are_refused(model, change, names):
    with pytest.raises(MotionError, match=names):
        model.walks(1, 30, n=1, stride=replace(model.sample(1, seed=0), **change))
