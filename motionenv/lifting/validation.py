"""Input checks of lifting (amount of data, unit, periodicity), and correction of swapped left and right labels."""

from dataclasses import replace

import numpy as np

from motionenv.body.kinematics import markers
from motionenv.body.skeleton import from_height
from motionenv.errors import GapError, MotionError
from motionenv.lifting.fourier_fit import LEAST_CYCLES, Series, fourier_points
from motionenv.lifting.free.swaps import GROUPS, exchanged
from motionenv.types import MARKERS, Points

_MARKERS, _FRAMES = 4, 8  # least number of markers, each in at least so many frames
LONGEST = 3600  # [frames] of a steady walk: beyond this, finding swapped sides takes too long
LEAST_SECONDS, LEAST_RATE = 0.5, 8.0  # [s], [Hz] of any motion
_SMALLEST = 8  # [pixels]
_UPRIGHT = 0.3  # [m] vertical extent of the markers on a standing body that is needed to estimate the unit
_FASTEST = 2.0  # strides per second
#: Apparent size relative to a body of 1.75 m: from a child seen steeply from above to a tall adult.
_SIZES = (0.3, 1.6)
_UNITS = {"metres": 1.0, "centimetres": 100.0, "millimetres": 1000.0}

_EXPLAINED = 0.45  # least explained fraction of the variance; see `check_series`
_ALTERNATION = 0.7  # least fraction of alternating power; see `alternation`
_SWITCH = 5.0  # log-odds against a swap from one frame to the next
_ODD = 20.0  # cap on the log-likelihood of one pair in one frame
_ROUNDS = 4
_LEGS = tuple([MARKERS.index(f"{side}_{n}") for n in GROUPS["legs"]] for side in ("left", "right"))  # ankles last


def check_points(points: Points, scale: float | None = None) -> None:
    """Reject image `points` that can't be lifted, before any expensive work; `scale` is pixels per metre, if known.

    The unit is checked by regressing the markers' mean heights on those of a standing body.

    Raises:
        GapError: too few frames or markers, or less than `LEAST_SECONDS`.
        MotionError: fewer than `LEAST_RATE` frames per second, a wrong unit, an inverted vertical axis, or a scale that
            implies an impossible body height.
    """
    who = points.name or "this sequence"
    if points.fps < LEAST_RATE:
        raise MotionError(f"{who} has {points.fps:g} frames per second; at least {LEAST_RATE:g} are needed")
    seen = np.isfinite(points.positions).all(axis=-1)
    enough = seen.sum(axis=0) >= _FRAMES
    if enough.sum() < _MARKERS:
        names = ", ".join(name for name, some in zip(MARKERS, enough, strict=True) if some) or "none"
        raise GapError(
            f"{who} shows {enough.sum()} of the 15 markers in {_FRAMES} frames or more ({names}); {_MARKERS} are "
            "needed: lower the confidence threshold, or use another sequence"
        )
    if (seconds := _seconds(seen, points.fps)) < LEAST_SECONDS:
        raise GapError(
            f"{who} shows {seconds:.2f} s; at least {LEAST_SECONDS:g} s are needed: use a longer sequence, or correct "
            f"fps={points.fps:g}"
        )
    _check_unit(points, enough, who, scale)
    rows = points.positions[seen.any(axis=1), :, 1]
    tall = float(np.median(np.nanmax(rows, axis=1) - np.nanmin(rows, axis=1)))
    if points.unit == "px" and tall < _SMALLEST:
        raise MotionError(f"{who} is {tall:.2g} pixels tall; at least {_SMALLEST} are needed: use a larger picture")


def check_strides(points: Points) -> None:
    """Reject `points` in which nobody can have walked enough strides (`GapError`), or too many (`MotionError`)."""
    who = points.name or "this walk"
    if len(points.positions) > LONGEST:
        raise MotionError(
            f"{who} has {len(points.positions)} frames; at most {LONGEST} are allowed: cut out some strides, or lower "
            "the frame rate"
        )
    seconds = _seconds(np.isfinite(points.positions).all(axis=-1), points.fps)
    if seconds * _FASTEST < LEAST_CYCLES:
        raise GapError(
            f"{who} shows {seconds:.2f} s, too short for {LEAST_CYCLES:g} strides at any pace: use a longer sequence, "
            f"or correct fps={points.fps:g}"
        )


def _seconds(seen: np.ndarray, fps: float) -> float:
    """Time from the first frame in which anything is `seen` (frames, 15) to the last [s]."""
    return float((np.flatnonzero(seen.any(axis=1))[[0, -1]] @ [-1, 1] + 1) / fps)


def check_series(series: Series) -> None:
    """Reject a `series` that isn't a walk: a `MotionError` if it isn't periodic, or the legs don't alternate.

    The series must explain 0.45 of the variance. If both ankles are seen, 0.7 of the legs' vertical power must
    alternate between left and right (see `alternation`). CMU walks have at least 0.84 and 0.91 at any view, and 0.51
    and 0.87 with 20 mm of noise at 30 frames per second.
    """
    who = series.name or "this walk"
    if series.explained < _EXPLAINED:
        raise MotionError(
            f"{who} isn't periodic: the best series, at {series.frequency:.2f} strides per second, explains "
            f"{series.explained:.0%} of the motion; a walk needs at least {_EXPLAINED:.0%}. Cut out a stretch of "
            "steady walking, and check the left and right labels"
        )
    share = alternation(series)
    if share < _ALTERNATION:
        raise MotionError(
            f"{who} isn't a walk: the legs alternate in {share:.0%} of their motion; a walk needs at least "
            f"{_ALTERNATION:.0%}. Cut out a stretch of walking"
        )


def alternation(series: Series) -> float:
    """Fraction of the legs' vertical power in a `series` in which left and right alternate; NaN if an ankle isn't seen.

    It is the power of the fundamental of left minus right and of the second harmonic of left plus right. Horizontal
    motion is excluded because its parity is the opposite. Ankles, which have at least 0.96 in every view, are required:
    in views from above, horizontal motion leaks into the vertical of the other markers.
    """
    left, right = (series.coefficients[1:, side, 1] for side in _LEGS)
    if np.isnan(left[0, -1] + right[0, -1]):
        return np.nan
    power = [np.nansum(((left + sign * right) ** 2).reshape(2, -1), axis=1) for sign in (-1, 1)]
    total = power[0].sum() + power[1].sum()
    return float((power[0][0] + power[1][1]) / total) if total > 0 else np.nan


def swapped_frames(points: Points) -> np.ndarray:
    """Find frames of `points` in which left and right labels are swapped: (frames, 2) for arms and legs.

    A swap negates the difference left minus right, which breaks its continuity and its period. The Viterbi algorithm
    finds the most probable labels of all frames under autoregressive noise about a periodic difference; labels and
    periodic difference are estimated alternately.

    Labels that are swapped throughout or in most frames can't be detected: apart from asymmetries, that is the same
    walker at view -α. Frames in which left and right coincide can't be decided, and do not matter.

    Raises:
        GapError: as `motionenv.lifting.fourier_fit.fourier_points`.
    """
    starts = [np.zeros((len(points.positions), len(GROUPS)), dtype=bool), continuous_labels(points)]
    return min((_alternating_fit(points, labels) for labels in starts), key=lambda found: found[0])[1]


def unswapped(points: Points) -> tuple[Points, np.ndarray]:
    """`points` with left and right labelled as in most frames, and `swapped_frames`, with its limits and errors."""
    labels = swapped_frames(points)
    return swapped_back(points, labels), labels


def swapped_back(points: Points, labels: np.ndarray) -> Points:
    """`points` with left and right of arms and legs exchanged where `labels` (frames, 2) are True."""
    confidence = None if points.confidence is None else exchanged(points.confidence, labels)
    return replace(points, positions=exchanged(points.positions, labels), confidence=confidence)


def _check_unit(points: Points, enough: np.ndarray, who: str, known: float | None) -> None:
    """Compare the markers' mean heights with those of a standing body, in pixels by the `known` scale."""
    standing = markers(np.zeros(25), from_height(1.75))[enough, 2]
    if np.ptp(standing) < _UPRIGHT:
        return
    heights = np.nanmean(points.upward[:, enough, 1], axis=0)
    about = standing - standing.mean()
    scale = float(heights @ about / (about @ about))
    like = [unit for unit, n in _UNITS.items() if _SIZES[0] * n <= abs(scale) < _SIZES[1] * n]
    if points.unit == "px":
        if scale < 0:
            raise MotionError(f'{who} is upside down: pixel rows count downwards. Negate y, or set unit="m"')
        if like == ["metres"]:
            raise MotionError(f'{who} is {1.75 * scale:.2g} pixels tall, which looks like metres: set unit="m"')
        if known is not None and not _SIZES[0] <= scale / known < _SIZES[1]:
            raise MotionError(
                f"{who} is {1.75 * scale:.0f} pixels tall, which at scale {known:g} is {1.75 * scale / known:.2g} m: "
                "correct the scale, or omit it to have it estimated"
            )
    elif scale < 0:
        raise MotionError(f'{who} is upside down, which looks like pixels: set unit="px"')
    elif like != ["metres"]:
        short = {"centimetres": '"cm"', "millimetres": '"mm"'}.get(like[0] if like else "", '"px" or the actual unit')
        looks = f"looks like {like[0]}" if like else "isn't the height of a person"
        raise MotionError(f"{who} is {1.75 * scale:.3g} m tall, which {looks}: set unit={short}")


def _columns(pairs: tuple[str, ...]) -> tuple[list[int], list[int]]:
    left, right = ([MARKERS.index(f"{side}_{name}") for name in pairs] for side in ("left", "right"))
    return left, right


def _between(positions: np.ndarray, pairs: tuple[str, ...]) -> np.ndarray:
    """Left minus right of each pair (frames, pairs, 2)."""
    left, right = _columns(pairs)
    return positions[:, left] - positions[:, right]


def continuous_labels(points: Points) -> np.ndarray:
    """Labels (frames, 2) of `points` that minimise the jumps of left minus right; False in most frames."""
    labels = np.zeros((len(points.positions), len(GROUPS)), dtype=bool)
    for g, pairs in enumerate(GROUPS.values()):
        between = _between(points.upward, pairs)
        steps = np.linalg.norm([between[1:] - between[:-1], between[1:] + between[:-1]], axis=-1).min(axis=0)
        known = np.isfinite(steps).sum(axis=0) >= _FRAMES
        if known.any():
            near = between[:, known] / np.maximum(np.nanmedian(steps[:, known], axis=0), 1e-9)[:, None]
            labels[:, g] = _viterbi(np.stack([near, -near]), 1.0, 1.0)[0]
    return labels ^ (labels.mean(axis=0) > 0.5)


def _alternating_fit(points: Points, labels: np.ndarray) -> tuple[float, np.ndarray]:
    """Alternate between fitting the series and the labels (frames, 2), from initial labels; the cost and the labels."""
    # Swapped labels can make the stride look slower; stay above the slowest frequency that can be fitted.
    least = 1.001 * LEAST_CYCLES * points.fps / len(points.positions)
    low, high = min(max(0.5, least), 0.99 * _FASTEST), _FASTEST
    for _ in range(_ROUNDS):
        series = fourier_points(swapped_back(points, labels), frequencies=(low, high))
        low, high = max(0.85 * series.frequency, low), min(1.15 * series.frequency, _FASTEST)
        found = [_labels(points, series, pairs, labels[:, g]) for g, pairs in enumerate(GROUPS.values())]
        before, labels = labels, np.stack([path for path, _ in found], axis=1)
        if np.array_equal(before, labels):
            break
    return sum(cost for _, cost in found), labels


def _labels(points: Points, series: Series, pairs: tuple[str, ...], before: np.ndarray) -> tuple[np.ndarray, float]:
    """Most probable labels (frames,) of one group, True where swapped, given those `before`; and their cost."""
    between = _between(points.upward, pairs)
    expected = _between(series.positions_at(np.arange(len(between)) / points.fps), pairs)
    off = np.stack([between - expected, -between - expected])  # unswapped, swapped: (2, frames, pairs, 2)
    now = np.where(before[:, None, None], off[1], off[0])
    size = np.linalg.norm(now, axis=-1)
    known = np.isfinite(size).sum(axis=0) >= _FRAMES
    if not known.any():
        return np.zeros(len(between), dtype=bool), 0.0
    off, now, size = off[:, :, known], now[:, known], size[:, known]
    noise = np.nanmedian(size, axis=0) / np.sqrt(2 * np.log(2))
    noise = np.maximum(noise, 1e-6 * np.nanmax(np.abs(between)))
    correlation = _autocorrelation(now / noise[:, None])
    path, cost = _viterbi(off / noise[:, None], correlation, 1 - correlation**2)
    return path, cost + 2 * float((np.isfinite(size).sum(axis=0) * np.log(noise)).sum())


def _autocorrelation(now: np.ndarray) -> float:
    """Lag-1 correlation of standardised residuals (frames, pairs, 2)."""
    now = np.clip(now, -3, 3)
    both = np.isfinite(now[1:] * now[:-1])
    power = np.where(both, now[1:] ** 2 + now[:-1] ** 2, 0.0).sum() / 2
    return float(np.clip(np.where(both, now[1:] * now[:-1], 0.0).sum() / max(power, 1e-300), 0.0, 0.99))


def _viterbi(off: np.ndarray, correlation: float, variance: float) -> tuple[np.ndarray, float]:
    """The path (frames,) of least cost through residuals (2, frames, pairs, 2) of the two labels, and its cost.

    Residuals are autoregressive of order 1 with coefficient `correlation` and innovation `variance`.
    """
    frames = off.shape[1]
    before = np.nan_to_num(off[:, None, :-1])  # after a gap, predict 0
    variances = np.where(np.isnan(off[0, :-1]).any(axis=-1), 1.0, variance)
    step = _cost(off[None, :, 1:] - correlation * before, variances)  # (from, to, frames - 1)
    cost = _cost(off[:, 0], np.ones(off.shape[2])) + np.array([0.0, _SWITCH])
    back = np.zeros((frames, 2), dtype=np.intp)
    change = _SWITCH * (1 - np.eye(2))
    for i in range(1, frames):
        ways = cost[:, None] + step[:, :, i - 1] + change
        back[i] = ways.argmin(axis=0)
        cost = ways.min(axis=0)
    path = np.empty(frames, dtype=np.intp)
    path[-1] = cost.argmin()
    for i in range(frames - 1, 0, -1):
        path[i - 1] = back[i, path[i]]
    return path == 1, float(cost.min())


def _cost(off: np.ndarray, variance) -> np.ndarray:
    """Negative log-likelihood (...) of residuals (..., pairs, 2), capped for each pair, 0 where a pair isn't seen."""
    return np.minimum(np.nan_to_num((off**2).sum(axis=-1)) / (2 * variance), _ODD).sum(axis=-1)
