"""The model of detector error against the numbers it is said to have: closed forms, published rates, seeds."""

import numpy as np
import pytest

import motionenv
from motionenv.body import from_height
from motionenv.errors import MotionError
from motionenv.mocap.keypoints import DetectorErrors
from motionenv.types import MARKERS, Points

NONE = {"bias": 0, "jitter": 0, "severity": 0, "missing": 0}
HEIGHT, FPS = 400.0, 50.0
KNEE, HIP, ANKLE, HEAD = (MARKERS.index(name) for name in ("left_knee", "left_hip", "left_ankle", "head"))


def standing(frames=4000, heading=0.0, fps=FPS) -> Points:
    """Somebody 400 pixels tall who stands and is seen from the front, or turned to the left by `heading` [rad]."""
    markers = motionenv.markers(np.zeros(25), from_height(1.75)) * HEIGHT / 1.75
    heading = np.broadcast_to(heading, frames)[:, None]
    across = markers[:, 1] * np.cos(heading) - markers[:, 0] * np.sin(heading)
    return Points(np.stack([600 + across, np.broadcast_to(300 - markers[:, 2], across.shape)], axis=-1), fps, "px")


def errors(frames=4000, seeds=1, **changes) -> np.ndarray:
    """Errors (seeds, frames, 15, 2) relative to height."""
    clean = standing(frames)
    model = DetectorErrors(**NONE | changes)
    return np.stack([model.apply(clean, seed).positions - clean.positions for seed in range(seeds)]) / HEIGHT


def test_without_errors_points_stay_and_with_the_same_seed_the_bytes():
    clean = standing(50)
    same = DetectorErrors(**NONE).apply(clean, 1)
    np.testing.assert_allclose(same.positions, clean.positions, rtol=0, atol=1e-9)
    one, again, other = (DetectorErrors().apply(clean, seed) for seed in (3, np.random.default_rng(3), 4))
    assert one.positions.tobytes() == again.positions.tobytes()
    assert one.confidence.tobytes() == again.confidence.tobytes()
    assert one.positions.tobytes() != other.positions.tobytes()


def test_jitter_has_the_spread_and_the_tails_of_students_t():
    found = errors(20_000, jitter=0.12, memory=0.0)[0, :, KNEE]
    scale = 0.12 * 0.087
    radius = np.linalg.norm(found, axis=-1)
    for at in (0.5, 1, 2, 4, 8):  # P(d > r) = (1 + r² / (ν τ²))^(-ν/2) in the plane
        beyond = (1 + at**2 / 4) ** -2
        assert (radius > at * scale).mean() == pytest.approx(beyond, abs=5 * np.sqrt(beyond / len(radius)))
    assert np.abs(np.corrcoef(found.T)[0, 1]) < 0.1


def test_errors_remember_the_last_frames():
    clean = standing(40_000)
    found = DetectorErrors(**NONE | {"jitter": 0.12, "memory": 0.5}).apply(clean, 0).positions - clean.positions
    ranks = found[..., 0].argsort(axis=0).argsort(axis=0)  # the tails are heavy, ranks aren't
    for lag in (1, 10, 25):
        measured = np.mean([np.corrcoef(ranks[:-lag, m], ranks[lag:, m])[0, 1] for m in range(15)])
        assert measured == pytest.approx(np.exp(-lag / (FPS * 0.5)), abs=0.04), lag


def test_published_rates_of_jitter_come_out_of_the_defaults():
    """PoseFix: 10 % of the knees and ankles, 20 % of the hips have OKS 0.5 to 0.85; the model has one share for all."""
    found = errors(500, seeds=60, bias=0.12, jitter=0.12)
    sigma = np.array([0.107, 0.087])
    similarity = np.exp(-((found[:, :, [HIP, KNEE]] / (2 * 0.41 * sigma[:, None])) ** 2).sum(axis=-1) / 2)
    share = ((similarity > 0.5) & (similarity < 0.85)).mean()
    assert 0.07 < share < 0.20


def test_bias_belongs_to_the_view_and_has_one_size_in_all():
    model = DetectorErrors(**NONE | {"bias": 0.12})
    turn = np.linspace(0, np.pi, 60)
    found = []
    for seed in range(300):
        clean = standing(60, turn)
        found.append((model.apply(clean, seed, height=HEIGHT).positions - clean.positions) / HEIGHT)
    found = np.stack(found)
    for marker, sigma in ((KNEE, 0.087), (HIP, 0.107), (HEAD, 0.035), (ANKLE, 0.089 / 3)):
        np.testing.assert_allclose(found[:, :, marker].std(axis=(0, 2)), 0.12 * sigma, rtol=0.15)
    knees = found[:, :, KNEE].reshape(300, 60, 2)
    assert np.corrcoef(knees[:, 0].ravel(), knees[:, -1].ravel())[0, 1] < -0.95  # front and back
    assert abs(np.corrcoef(knees[:, 0].ravel(), knees[:, 30].ravel())[0, 1]) < 0.3  # front and side
    assert np.abs(np.diff(knees, axis=1)).max() < 0.1 * 0.12


def test_gaps_have_their_share_and_their_length():
    gone = np.isnan(errors(40_000, missing=0.2, gap=0.3)[0, ..., 0])
    assert gone.mean() == pytest.approx(0.2, abs=0.02)
    begins = (gone[1:] & ~gone[:-1]).sum()
    assert gone.sum() / begins / FPS == pytest.approx(0.3, rel=0.1)


def test_misses_are_as_far_off_as_published_and_stay_there():
    found = np.linalg.norm(errors(40_000, severity=1.0, episode=0.2)[0], axis=-1)
    head = found[:, HEAD]
    assert (head > 0).mean() == pytest.approx(0.02, abs=0.006)
    off = np.exp(-((head[head > 1e-9] / (2 * 0.41 * 0.035)) ** 2) / 2)  # OKS
    assert off.min() > 0.0999
    assert off.max() < 0.5001
    episodes = np.diff(np.flatnonzero(head > 1e-9)) > 1
    assert (head > 1e-9).sum() / (episodes.sum() + 1) / FPS == pytest.approx(0.2, rel=0.25)


def test_left_and_right_are_swapped_as_often_as_published():
    clean = standing(40_000)
    model = DetectorErrors(**NONE | {"severity": 1.0})
    found = np.concatenate([model.apply(clean, seed).positions for seed in range(6)])
    swapped = {}
    for part in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle"):
        left, right = (MARKERS.index(f"{side}_{part}") for side in ("left", "right"))
        swapped[part] = np.all(found[:, left] == clean.positions[0, right], axis=-1)
        rate = 0.03 if part in ("shoulder", "elbow", "wrist") else 0.06
        hit = 0.95 if part in ("shoulder", "ankle") else 0.9  # the others are swapped and missed
        assert swapped[part].mean() == pytest.approx(rate * hit, rel=0.15), part
    legs = (swapped["hip"] & swapped["knee"] & swapped["ankle"]).mean()
    assert legs == pytest.approx((1 - np.sqrt(0.94)) * 0.95 * 0.9**2, rel=0.25)  # half of the swaps are of whole legs


def test_confidence_tells_of_the_error_and_is_zero_in_gaps():
    clean = standing(3000)
    seen = DetectorErrors().apply(clean, 5)
    assert ((seen.confidence == 0) == np.isnan(seen.positions).any(axis=-1)).all()
    error = np.linalg.norm(seen.positions - clean.positions, axis=-1) / HEIGHT
    knee = np.isfinite(error[:, KNEE])
    far = error[:, KNEE] > 0.09
    assert seen.confidence[knee & far, KNEE].mean() < seen.confidence[knee & ~far, KNEE].mean() - 0.2


def test_gaps_of_the_points_stay_and_truth_and_unit_too():
    positions = standing(80).positions.copy()
    positions[10:20, KNEE] = np.nan
    metres = Points(positions * [1.75 / HEIGHT, -1.75 / HEIGHT], FPS, "m", name="walk")
    seen = DetectorErrors(missing=0).apply(metres, 0)
    assert np.isnan(seen.positions[10:20, KNEE]).all()
    assert (seen.unit, seen.name, seen.fps) == ("m", "walk", FPS)
    assert np.nanstd(seen.positions - metres.positions) < 0.1
    given = DetectorErrors(missing=0).apply(metres, 0, height=1.75)
    np.testing.assert_allclose(given.positions, seen.positions, atol=1e-2)


def test_what_is_impossible_is_named():
    with pytest.raises(MotionError, match=r"DetectorErrors\.missing"):
        DetectorErrors(missing=1.0)
    with pytest.raises(MotionError, match=r"DetectorErrors\.memory"):
        DetectorErrors(memory=-1)
    for height in (0, [1, 2], "tall", np.nan):
        with pytest.raises(MotionError, match="height must"):
            DetectorErrors().apply(standing(5), 0, height=height)
    with pytest.raises(MotionError, match="head and both ankles"):
        DetectorErrors().apply(Points(np.full((5, 15, 2), np.nan), 30, "px"), 0)
    with pytest.raises(MotionError, match="seed"):
        DetectorErrors().apply(standing(5), "x")


def test_the_tables_derivations_hold():
    """What `detector_errors.toml` derives from published figures, derived again."""
    area = np.mean([np.sqrt(share * 1.8) / 1.75 for share in (0.35, 0.23)])
    assert area == pytest.approx(0.41, abs=0.01)
    # The scale at which 10 of 83 good or jittering keypoints exceed an OKS of 0.85: P(d > r) = (1 + r² / (ν τ²))^(-ν/2)
    reach = np.sqrt(-2 * np.log(0.85)) * 2 * 0.41
    assert reach / np.sqrt(4 * ((0.10 / 0.83) ** (-2 / 4) - 1)) == pytest.approx(0.17, abs=0.005)
    assert np.hypot(DetectorErrors().bias, DetectorErrors().jitter) == pytest.approx(0.17, abs=0.001)
    # Second differences of first-order autoregression have a variance of 6 - 8 ρ + 2 ρ² times its own
    for mean, acceleration, seconds in ((6.67, 2.91, 0.2), (4.59, 1.01, 0.8), (5.14, 0.90, 1.3), (9.42, 1.54, 1.5)):
        ratio = acceleration**2 / (mean**2 / 2)
        keep = (8 - np.sqrt(64 - 8 * (6 - ratio))) / 4
        assert -1 / 50 / np.log(keep) == pytest.approx(seconds, abs=0.05)
