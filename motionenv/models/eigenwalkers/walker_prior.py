r"""A prior of walkers for lifting: eigenwalkers of walks and their mirror images, with errors learned on new people.

Paper B has one column per person and one noise variance for all residuals. This model differs:

- Each walk is a column, and so is its mirror image (left and right swapped, half a stride later). The average walk is
  symmetric, and a few people tell little about individual asymmetry.
- The noise is estimated by cross-validation over people, for each harmonic and marker, since wrists vary more than
  hips. Sine and cosine share it, so that it doesn't depend on the phase; so do left and right, and x, y and z, so that
  it doesn't depend on the view.
- The same cross-validation corrects the posterior's overconfidence.

So w ~ N(w̄, Eᵀ diag(λ) E + diag(noise)), over the 225 coefficients.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from motionenv.errors import MotionError
from motionenv.models.eigenwalkers.fourier_model import FourierModel
from motionenv.models.eigenwalkers.fourier_series import OTHER_SIDE, PARTS, FourierWalker, columns
from motionenv.models.eigenwalkers.regression import shrunk_regression
from motionenv.models.eigenwalkers.speed import learn_speed
from motionenv.models.eigenwalkers.table import mean_higher, mean_walkers, read_walks, with_mirror_images
from motionenv.types import MARKERS, Markers, Motion

_USUAL = 20  # components; 15 to 25 give equal errors
_FOLDS = 12  # at most
_VIEWS = np.arange(-90, 90, 15) * (np.pi / 180)  # the opposite views show the same from behind
_CYCLE = columns(np.arange(12) * (2 * np.pi / 12))  # over time
_FACTORS = np.geomspace(0.5, 8, 9)  # candidate factors on the noise
_FLOOR = 1e-8  # [m²], (0.1 mm)²: keeps the posterior of exact walkers defined
_LEAST_INFLATION = 0.01  # for markers without error, such as the pelvis, the origin
_BAND, _NORMAL = 0.9, 1.6448536269514722  # coverage of the bands, and the half-width of a normal one [deviations]
_NOISE_SHAPE = (len(PARTS), len(MARKERS))


@dataclass(frozen=True)
class _LeftOut:
    """One fold of the cross-validation: the walks left out, and the components of all others."""

    rows: np.ndarray  # (n, 5, 15, 3) walks left out
    weights: np.ndarray  # (n,) 1 / number of the person's walks: each person counts once
    mean: np.ndarray
    components: np.ndarray
    variance: np.ndarray

    @cached_property
    def squares(self) -> np.ndarray:
        """Weighted sums of squared residuals, and sums of the weights, (2, 5, 15)."""
        return _rest(self.rows, self.weights, self.mean, self.components)


class WalkerPrior(FourierModel):
    r"""Eigenwalkers with errors calibrated on new people: w ~ N(w̄, Eᵀ diag(λ) E + diag(noise)).

    Each walk and each mirror image is one column of the decomposed matrix.

    Args:
        n_components: N; None takes 20, or one less than the number of columns if that is fewer.
        tol, max_iter: see `FourierModel`.
        merge: average each person's walks first, for walks that each show one side of the body. Unmerged, hundreds of
            incomplete walks take minutes.

    Attributes:
        noise_: (5, 15) [m²], residual variance of each coordinate of a coefficient.
        inflation_: (15,) factors on the posterior variance of a marker's unseen coordinates, with which 90 % bands
            cover 90 % on new people.
        scores_: (2 n, N) [m] scores of the n walks (of the n people if merged), then of their mirror images.
        people_: (2 n,) the person's label of each row of `scores_`.

    `FourierModel` describes the other attributes. Frequencies are regressed on people's mean scores.
    """

    kind: ClassVar[str] = "walker-prior"
    about: ClassVar[str] = "Eigenwalkers of every walk and its mirror image, which know how they err: for lifting."
    _settings = (*FourierModel._settings, "merge")
    _stored = (*FourierModel._stored, "noise_", "inflation_")
    _shapes: ClassVar = FourierModel._shapes | {"noise_": _NOISE_SHAPE, "inflation_": (len(MARKERS),)}
    _positive = ("noise_", "inflation_")

    def __init__(
        self, n_components: int | None = None, tol: float = 1e-7, max_iter: int = 500, merge: bool = False
    ) -> None:
        super().__init__(n_components, tol, max_iter)
        self.merge = merge

    def fit(
        self, motions: Iterable[FourierWalker | Markers | Motion], subjects: Sequence[str] | None = None,
    ) -> "WalkerPrior":  # fmt: skip
        """Fit components to walks and their mirror images; estimate errors by cross-validation over people.

        Args:
            motions, subjects: as of `Eigenwalkers.fit`. Cross-validation leaves out all walks of a person together.

        Raises:
            MotionError: fewer than three people, too few columns for `n_components`, or labels that don't match the
                walks.
            GapError: a marker is missing in all walks, or in all walks outside one fold: lifting needs to know how each
                one errs.
        """
        walks = read_walks(motions, subjects)
        merged = mean_walkers(walks, walks.people if self.merge else tuple(map(str, range(len(walks)))))
        labels = merged.people if self.merge else walks.people
        self.people_ = labels * 2
        self.n_people_, self.n_walkers_ = len(set(labels)), len(walks)
        if self.n_people_ < 3:
            raise MotionError(
                f"a prior needs walks of three people for its cross-validation, got {self.n_people_}: add other "
                "people's walks (subjects= labels the person; for files, the name up to the first '_')"
            )
        self._learn(with_mirror_images(merged.rows), self._columns_rank(2 * len(merged)))
        self._learn_pace(np.log(merged.frequencies))
        learn_speed(self, walks, merged)
        self.higher_ = mean_higher(walks)
        left_out = self._leave_out(merged.rows, np.array(labels))
        # Paper B (fig. 3) chooses σ² by the squared error, whose minimum is flat and depends on who is left out.
        factor = float(min(_FACTORS, key=lambda factor: _unlikeliness(left_out, factor)))
        self.noise_ = _noise(_total(left_out), factor)
        self.inflation_ = _inflation(left_out, factor)
        return self

    def _columns_rank(self, n_columns: int) -> int:
        most = n_columns - 1
        rank = min(_USUAL, most) if self.n_components is None else self.n_components
        if not (1 <= rank <= most and rank == int(rank)):
            raise MotionError(
                f"{n_columns} walks and mirror images can have 1 to {most} components, got {rank}: "
                "fit more walks, or fewer components"
            )
        return int(rank)

    def _learn_pace(self, log_frequencies: np.ndarray) -> None:
        """Regress people's mean log frequency on their mean scores; mirror images cancel asymmetric scores."""
        who, of = np.unique(self.people_, return_inverse=True)
        mean = np.stack([np.bincount(of, column) for column in self.scores_.T], axis=1) / np.bincount(of)[:, None]
        frequencies = np.bincount(of, np.tile(log_frequencies, 2), len(who)) / np.bincount(of)
        fitted = shrunk_regression(mean / np.sqrt(self.explained_variance_), frequencies)
        self.log_frequency_mean_, self.log_frequency_weights_, self.log_frequency_deviation_ = fitted

    def _leave_out(self, rows: np.ndarray, labels: np.ndarray) -> list[_LeftOut]:
        """Cross-validation folds over people, from n walks and their people's labels (n,)."""
        _, of, walks = np.unique(labels, return_inverse=True, return_counts=True)
        fold, weights = of % _FOLDS, 1 / walks[of]
        found = []
        for out in (fold == i for i in range(fold.max() + 1)):
            others = with_mirror_images(rows[~out])
            rank = min(len(self.components_), len(others) - 1)
            mean, components, variance, _ = self._decomposed(others, rank)
            found.append(_LeftOut(rows[out], weights[out], mean, components, variance))
        return found


def _rest(w, weights, mean, components) -> np.ndarray:
    """Weighted sums of squared residuals of walks w (n, 5, 15, 3) over walks and axes, and sums of the weights.

    Sine and cosine are pooled, and so are left and right.
    """
    deviations = (w - mean).reshape(len(w), -1)
    flat = components.reshape(len(components), -1)
    rest, known = np.zeros_like(deviations), np.isfinite(deviations)
    patterns, which = np.unique(known, axis=0, return_inverse=True)
    for i, some in enumerate(patterns):
        rows, e = which.reshape(-1) == i, flat[:, some]
        deviation = deviations[np.ix_(rows, some)]
        rest[np.ix_(rows, some)] = deviation - deviation @ np.linalg.pinv(e) @ e
    sums = np.stack([np.tensordot(weights, part, 1).reshape(w.shape[1:]).sum(axis=-1) for part in (rest**2, known)])
    for wave in (slice(1, 3), slice(3, 5)):
        sums[:, wave] = sums[:, wave].sum(axis=1, keepdims=True)
    return sums + sums[..., OTHER_SIDE]


def _lifted(out: _LeftOut, noise: np.ndarray, alpha: float, seen: np.ndarray, w: np.ndarray):
    """Error and posterior variance of the depth of walks w (n, 5, 15, 3) [m], lifted from a level view (eq. 3.15).

    The components of `out` lift them from the view angle `alpha` [rad], with `noise` (5, 15) [m²]; all walks show the
    markers in `seen` (15,). The error is (n, 5, seen) [m] of the coefficients, the variance (phases, seen) [m²].
    """
    c, s = np.cos(alpha), np.sin(alpha)
    shown, away = np.array([[c, s, 0.0], [0.0, 0.0, 1.0]]).T, np.array([-s, c, 0.0])
    e, deviation, noise = out.components[:, :, seen], (w - out.mean)[:, :, seen], noise[:, seen]
    flat = (e @ shown / np.sqrt(noise)[..., None]).reshape(len(e), -1)
    measured = (deviation @ shown / np.sqrt(noise)[..., None]).reshape(len(w), -1)
    covariance = np.linalg.inv(flat @ flat.T + np.diag(1 / out.variance))
    scores, unseen = measured @ flat.T @ covariance, e @ away
    over_time = np.einsum("th,khm->tmk", _CYCLE, unseen)
    variance = ((over_time @ covariance) * over_time).sum(axis=-1) + _CYCLE**2 @ noise
    return np.tensordot(scores, unseen, 1) - deviation @ away, variance


def _every_lift(left_out: list[_LeftOut], factor: float):
    """Yield visible markers, weights, error and variance for each view, and each group of walks with equal gaps."""
    total = _total(left_out)
    for out in left_out:
        noise = _noise(total - out.squares, factor)  # of the other folds
        patterns, which = np.unique(np.isfinite(out.rows).all(axis=(1, 3)), axis=0, return_inverse=True)
        for i, seen in enumerate(patterns):
            rows = which.reshape(-1) == i
            for alpha in _VIEWS:
                yield seen, out.weights[rows], *_lifted(out, noise, alpha, seen, out.rows[rows])


def _total(left_out: list[_LeftOut]) -> np.ndarray:
    return np.sum([out.squares for out in left_out], axis=0)


def _noise(squares: np.ndarray, factor: float) -> np.ndarray:
    return np.maximum(factor * squares[0] / squares[1], _FLOOR)


def _unlikeliness(left_out: list[_LeftOut], factor: float) -> float:
    """Weighted sum over views all around and markers of -2 log-density of the depth, averaged over the cycle."""
    total = 0.0
    for _, weights, error, variance in _every_lift(left_out, factor):
        square = np.einsum("th,nhm->ntm", _CYCLE, error) ** 2
        total += weights @ (square / variance + np.log(variance)).mean(axis=1).sum(axis=-1)
    return total


def _inflation(left_out: list[_LeftOut], factor: float) -> np.ndarray:
    """Factors (15,) on the variances with which bands cover left-out people; equal for left and right.

    They come from weighted quantiles of |error| / deviation over walks, views and phases.
    """
    found: list[list[tuple[np.ndarray, np.ndarray]]] = [[] for _ in MARKERS]
    for marker, z, weights in _deviates(left_out, factor):
        found[marker].append((z, weights))
    z90 = np.empty(len(MARKERS))
    for i, j in enumerate(OTHER_SIDE):
        values, weights = (np.concatenate(some) for some in zip(*found[i], *found[j], strict=True))
        order = np.argsort(values, kind="stable")
        reached = np.cumsum(weights[order])
        z90[i] = values[order[np.searchsorted(reached, _BAND * reached[-1])]]
    return np.maximum((z90 / _NORMAL) ** 2, _LEAST_INFLATION)


def _deviates(left_out: list[_LeftOut], factor: float):
    """Yield markers, |error| / deviation of some walks' depths over views and phases (k,), and weights (k,)."""
    for seen, weights, error, variance in _every_lift(left_out, factor):
        z = np.abs(np.einsum("th,nhm->ntm", _CYCLE, error)) / np.sqrt(variance)
        for i, marker in enumerate(np.flatnonzero(seen)):
            yield marker, z[..., i].ravel(), np.repeat(weights, len(_CYCLE))
