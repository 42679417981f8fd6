"""What lifting refuses, and why: too little, another unit, no walk. And left and right told apart where mixed up."""

import numpy as np

from motionenv.body.kinematics import markers
from motionenv.body.skeleton import from_height
from motionenv.errors import GapError, MotionError
from motionenv.estimation.lifting.series import LEAST_CYCLES, Series, fourier_points
from motionenv.types import MARKERS, Points

#: Pairs whose left and right a detector mixes up together: the columns of what `swapped_frames` gives.
GROUPS = {"arms": ("shoulder", "elbow", "wrist"), "legs": ("hip", "knee", "ankle")}

_MARKERS, _FRAMES = 4, 8  # how many must be seen, and in how many frames
_LONGEST = 3600  # frames: beyond, exchanged sides take long to find
_UPRIGHT = 0.3  # [m] of a standing body between the lowest and the highest marker, from which sizes can be told
_FASTEST = 2.0  # strides per second
#: Units per metre between a child seen steeply from above and a tall adult, as shares of a body of 1.75 m.
_SIZES = (0.3, 1.6)
_UNITS = {"metres": 1.0, "centimetres": 100.0, "millimetres": 1000.0}

_EXPLAINED = 0.45  # least share of the variance; see `check_series`
_TURNS = 0.7  # least share of the power of what moves in turn
_SWITCH = 5.0  # log-odds against left and right changing places from one frame to the next
_ODD = 20.0  # the most that one pair in one frame can say [log-likelihood]
_ROUNDS = 4
_LEGS = tuple([MARKERS.index(f"{side}_{n}") for n in GROUPS["legs"]] for side in ("left", "right"))  # ankles last


def check_points(points: Points, scale: float | None = None) -> None:
    """Refuse points from which no walk can be made, before any work.

    Metres are told from other units by how the markers' mean heights go with those of a standing body.

    Args:
        points: what one camera saw.
        scale: pixels per metre, where it is known.

    Raises:
        GapError: too few frames or markers.
        MotionError: another unit than the points say, another direction of the vertical axis, or a scale by which they
            are no size of a person.
    """
    who = points.name or "this walk"
    if len(points.positions) > _LONGEST:
        raise MotionError(
            f"{who} holds {len(points.positions)} frames, and up to {_LONGEST} are lifted at a time: cut out some "
            "strides, or take fewer frames per second"
        )
    seen = np.isfinite(points.positions).all(axis=-1)
    enough = seen.sum(axis=0) >= _FRAMES
    if enough.sum() < _MARKERS:
        names = ", ".join(name for name, some in zip(MARKERS, enough, strict=True) if some) or "none"
        raise GapError(
            f"{who} shows {enough.sum()} of the 15 markers in {_FRAMES} frames or more ({names}); it takes {_MARKERS}: "
            "lower confidence=, or take another sequence"
        )
    seconds = (np.flatnonzero(seen.any(axis=1))[[0, -1]] @ [-1, 1] + 1) / points.fps
    if seconds * _FASTEST < LEAST_CYCLES:
        raise GapError(
            f"{who} shows {seconds:.2f} s, too short for {LEAST_CYCLES:g} strides at any pace: take a longer sequence, "
            f"or correct fps={points.fps:g}"
        )
    _check_unit(points, enough, who, scale)


def check_series(series: Series) -> None:
    """Refuse a series that is no walk.

    Two things are asked: that the series accounts for 0.45 of the variance, and, where both ankles are seen, that 0.7
    of the legs' vertical power lies where left and right move in turn (see `turns`). CMU's walks have at least 0.84 and
    0.91 at any view, with 20 mm of noise at 30 frames per second 0.51 and 0.87.

    Args:
        series: what `motionenv.estimation.lifting.series.fourier_points` gave.

    Raises:
        MotionError: it isn't periodic, or left and right don't take turns.
    """
    who = series.name or "this walk"
    if series.explained < _EXPLAINED:
        raise MotionError(
            f"{who} isn't periodic: the best series, of {series.frequency:.2f} strides per second, accounts for "
            f"{series.explained:.0%} of the motion, a walk's for at least {_EXPLAINED:.0%}. Cut out a steady stretch "
            "of walking, and see that left and right are told apart"
        )
    share = turns(series)
    if share < _TURNS:
        raise MotionError(
            f"{who} is no walk: left and right legs move in turn in {share:.0%} of their motion, in a walk in at least "
            f"{_TURNS:.0%}. Cut out a stretch of walking"
        )


def turns(series: Series) -> float:
    """The share of the legs' vertical power where left and right move in turn; NaN where an ankle isn't seen.

    That is the fundamental of their differences and the second harmonic of their sums. Sideways it is the other way
    round, since left and right mirror each other, so only the vertical says it at every view. From above, what goes
    sideways shows in it too, and for arms or knees alone that is more; ankles have at least 0.96 in every view.

    Args:
        series: a walk as one camera shows it.
    """
    left, right = (series.coefficients[1:, side, 1] for side in _LEGS)
    if np.isnan(left[0, -1] + right[0, -1]):
        return np.nan
    power = [np.nansum(((left + sign * right) ** 2).reshape(2, -1), axis=1) for sign in (-1, 1)]
    total = power[0].sum() + power[1].sum()
    return float((power[0][0] + power[1][1]) / total) if total > 0 else np.nan


def swapped_frames(points: Points) -> np.ndarray:
    """Frames in which left and right are mixed up: (frames, 2) of arms and legs.

    A swap turns the difference of left and right about. The likeliest labels of all frames are found together (Viterbi)
    under noise that lasts from frame to frame, about differences that are periodic and that the labels themselves give
    in turn: a swap breaks both continuity and period.

    What is mixed up throughout can't be found so: a walker with left and right exchanged is, but for asymmetries, the
    same walker at view -α instead of α. Nor can what doesn't matter: where left and right lie at the same place.

    Args:
        points: what one camera saw, fewer than half of the frames mixed up.

    Raises:
        GapError: as `motionenv.estimation.lifting.series.fourier_points`.
    """
    starts = [np.zeros((len(points.positions), len(GROUPS)), dtype=bool), _continuous(points)]
    return min((_settled(points, labels) for labels in starts), key=lambda found: found[0])[1]


def unswapped(points: Points) -> tuple[Points, np.ndarray]:
    """The same points with left and right as in most frames, and where they were exchanged: (frames, 2) of arms, legs.

    Args:
        points: what one camera saw; see `swapped_frames` for what can be found.

    Raises:
        GapError: as `motionenv.estimation.lifting.series.fourier_points`.
    """
    labels = swapped_frames(points)
    return _exchanged(points, labels), labels


def _check_unit(points: Points, enough: np.ndarray, who: str, known: float | None) -> None:
    """Compare the markers' mean heights with those of a standing body, in pixels by the `known` scale.

    Raises:
        MotionError: they are in another unit, or upside down.
    """
    standing = markers(np.zeros(25), from_height(1.75))[enough, 2]
    if np.ptp(standing) < _UPRIGHT:
        return
    heights = np.nanmean(points.upward[:, enough, 1], axis=0)
    about = standing - standing.mean()
    scale = float(heights @ about / (about @ about))
    like = [unit for unit, n in _UNITS.items() if _SIZES[0] * n <= abs(scale) < _SIZES[1] * n]
    if points.unit == "px":
        if scale < 0:
            raise MotionError(f'{who} stands on its head: pixels count downwards. Turn y about, or say unit="m"')
        if like == ["metres"]:
            raise MotionError(f'{who} is {1.75 * scale:.2g} pixels tall: this looks like metres: say unit="m"')
        if known is not None and not _SIZES[0] <= scale / known < _SIZES[1]:
            raise MotionError(
                f"{who} is {1.75 * scale:.0f} pixels tall, at scale {known:g} that is {1.75 * scale / known:.2g} m: "
                "correct the scale, or leave it out to have it found"
            )
    elif scale < 0:
        raise MotionError(f'{who} stands on its head: this looks like pixels, which count downwards: say unit="px"')
    elif like != ["metres"]:
        short = {"centimetres": '"cm"', "millimetres": '"mm"'}.get(like[0] if like else "", '"px" or what it is')
        looks = f"looks like {like[0]}" if like else "is no size of a person"
        raise MotionError(f"{who} is {1.75 * scale:.3g} m tall: this {looks}: say unit={short}")


def _exchanged(points: Points, labels: np.ndarray) -> Points:
    """The points with left and right exchanged where `labels` (frames, 2) of arms and legs say so."""
    positions = points.positions.copy()
    for g, pairs in enumerate(GROUPS.values()):
        left, right = _columns(pairs)
        rows = np.flatnonzero(labels[:, g])[:, None]
        positions[rows, left], positions[rows, right] = points.positions[rows, right], points.positions[rows, left]
    return Points(positions, points.fps, points.unit, points.truth, points.name)


def _columns(pairs: tuple[str, ...]) -> tuple[list[int], list[int]]:
    """Indices of the left and of the right markers."""
    left, right = ([MARKERS.index(f"{side}_{name}") for name in pairs] for side in ("left", "right"))
    return left, right


def _between(positions: np.ndarray, pairs: tuple[str, ...]) -> np.ndarray:
    """Left less right of each pair (frames, pairs, 2)."""
    left, right = _columns(pairs)
    return positions[:, left] - positions[:, right]


def _continuous(points: Points) -> np.ndarray:
    """Labels (frames, 2) that make left and right jump least, False in most frames."""
    labels = np.zeros((len(points.positions), len(GROUPS)), dtype=bool)
    for g, pairs in enumerate(GROUPS.values()):
        between = _between(points.upward, pairs)
        steps = np.linalg.norm([between[1:] - between[:-1], between[1:] + between[:-1]], axis=-1).min(axis=0)
        known = np.isfinite(steps).sum(axis=0) >= _FRAMES
        if known.any():
            near = between[:, known] / np.maximum(np.nanmedian(steps[:, known], axis=0), 1e-9)[:, None]
            labels[:, g] = _viterbi(np.stack([near, -near]), 1.0, 1.0)[0]
    return labels ^ (labels.mean(axis=0) > 0.5)


def _settled(points: Points, labels: np.ndarray) -> tuple[float, np.ndarray]:
    """Labels (frames, 2) that the series made with them gives again, from others, and their cost."""
    # What is mixed up may look slower than it is: no slower than can be told.
    least = 1.001 * LEAST_CYCLES * points.fps / len(points.positions)
    low, high = min(max(0.5, least), 0.99 * _FASTEST), _FASTEST
    for _ in range(_ROUNDS):
        series = fourier_points(_exchanged(points, labels), frequencies=(low, high))
        low, high = max(0.85 * series.frequency, low), min(1.15 * series.frequency, _FASTEST)
        found = [_labels(points, series, pairs, labels[:, g]) for g, pairs in enumerate(GROUPS.values())]
        before, labels = labels, np.stack([path for path, _ in found], axis=1)
        if np.array_equal(before, labels):
            break
    return sum(cost for _, cost in found), labels


def _labels(points: Points, series: Series, pairs: tuple[str, ...], before: np.ndarray) -> tuple[np.ndarray, float]:
    """The likeliest labels (frames,) of one group, True where swapped, given those from `before`, and their cost."""
    between = _between(points.upward, pairs)
    expected = _between(series.positions_at(np.arange(len(between)) / points.fps), pairs)
    off = np.stack([between - expected, -between - expected])  # as it is, swapped: (2, frames, pairs, 2)
    now = np.where(before[:, None, None], off[1], off[0])
    size = np.linalg.norm(now, axis=-1)
    known = np.isfinite(size).sum(axis=0) >= _FRAMES
    if not known.any():
        return np.zeros(len(between), dtype=bool), 0.0
    off, now, size = off[:, :, known], now[:, known], size[:, known]
    noise = np.nanmedian(size, axis=0) / np.sqrt(2 * np.log(2))
    noise = np.maximum(noise, 1e-6 * np.nanmax(np.abs(between)))
    lasting = _lasting(now / noise[:, None])
    path, cost = _viterbi(off / noise[:, None], lasting, 1 - lasting**2)
    return path, cost + 2 * float((np.isfinite(size).sum(axis=0) * np.log(noise)).sum())


def _lasting(now: np.ndarray) -> float:
    """Correlation from one frame to the next of residuals (frames, pairs, 2) in units of their deviation."""
    now = np.clip(now, -3, 3)
    both = np.isfinite(now[1:] * now[:-1])
    power = np.where(both, now[1:] ** 2 + now[:-1] ** 2, 0.0).sum() / 2
    return float(np.clip(np.where(both, now[1:] * now[:-1], 0.0).sum() / max(power, 1e-300), 0.0, 0.99))


def _viterbi(off: np.ndarray, lasting: float, spread: float) -> tuple[np.ndarray, float]:
    """The path (frames,) of least cost through residuals (2, frames, pairs, 2) of the two labels, and its cost.

    What stays of the residual from frame to frame is `lasting`, and `spread` the variance of what comes new.
    """
    frames = off.shape[1]
    before = np.nan_to_num(off[:, None, :-1])  # after a gap nothing is expected to last
    spreads = np.where(np.isnan(off[0, :-1]).any(axis=-1), 1.0, spread)
    step = _cost(off[None, :, 1:] - lasting * before, spreads)  # (from, to, frames - 1)
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
    """Minus log-likelihood (...) of residuals (..., pairs, 2), each pair capped, 0 where it isn't seen."""
    return np.minimum(np.nan_to_num((off**2).sum(axis=-1)) / (2 * variance), _ODD).sum(axis=-1)
