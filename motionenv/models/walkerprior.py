r"""A prior of walkers for lifting: eigenwalkers of every walk and its mirror image, and how they err on new people.

Paper B takes one column per person and one noise variance for all that the components leave out. Here:

- Each walk is a column of its own, and so is its mirror image (left and right changed, half a stride later): nothing
  in how people walk on average is left-handed, and few people say little about what differs.
- The noise is learned from people left out, for each harmonic and marker: wrists stray further than hips. It is alike
  for sine and cosine, so that it doesn't depend on the phase, for left and right, and for x, y and z, so that it
  doesn't depend on the view.
- How much surer the posterior is than it should be is learned from people left out, too.

So w ~ N(w̄, Eᵀ diag(λ) E + diag(noise)), over the 225 coefficients.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from motionenv.errors import ModelError, MotionError
from motionenv.models.eigenwalkers import Eigenwalkers, labelled, mean_walkers
from motionenv.models.harmonics import OTHER_SIDE, PARTS, columns, mirrored
from motionenv.models.regression import shrunk_regression
from motionenv.types import MARKERS

_USUAL = 20  # components: from 15 to 25 no worse
_FOLDS = 12  # at most
_VIEWS = np.arange(-90, 90, 15) * (np.pi / 180)  # the other half of the circle shows the same, from behind
_CYCLE = columns(np.arange(12) * (2 * np.pi / 12))  # over time
_FACTORS = np.geomspace(0.5, 8, 9)  # of the noise, to choose from
_FLOOR = 1e-8  # [m²], a tenth of a millimetre: exact walkers have a posterior too
_LEAST_INFLATION = 0.01  # where a marker never leaves its place, as the pelvis that others are measured from
_BAND, _NORMAL = 0.9, 1.6448536269514722  # bands that shall hold, and how many deviations wide a normal one is
_NOISE_SHAPE = (len(PARTS), len(MARKERS))


@dataclass(frozen=True)
class _LeftOut:
    """People who were left out, and the components of all others."""

    w: np.ndarray  # (n, 5, 15, 3) their walks
    weights: np.ndarray  # (n,) 1 / walks of that person: a person counts once
    mean: np.ndarray
    components: np.ndarray
    variance: np.ndarray
    squares: np.ndarray  # (2, 5, 15) weighted sums of what the components leave, squared, and of the weights


class WalkerPrior(Eigenwalkers):
    r"""Eigenwalkers that know how they err on people they never saw: w ~ N(w̄, Eᵀ diag(λ) E + diag(noise)).

    Decomposed are all walks and their mirror images, each a column of its own.

    Args:
        n_components: N; None takes 20, or one less than there are columns if that is fewer.
        tol: as of `Eigenwalkers`.
        max_iter: as of `Eigenwalkers`.
        merge: average each person's walks first, for walks that show one side each, and together both. Unmerged,
            hundreds of incomplete walks take minutes.

    Attributes:
        noise_: (5, 15) [m²], variance of each coordinate of what the components leave out of a coefficient.
        inflation_: (15,) by which to multiply the posterior variance of a marker's unseen coordinates, so that bands of
            90 % hold 90 % of the time on new people.
        scores_: (2 n, N) [m] of the n walks (or, merged, people), and then of their mirror images.
        people_: (2 n,) the label of the person of each.

    The other attributes are those of `Eigenwalkers`. Frequencies are regressed on people's mean scores.
    """

    kind = "walker-prior"
    _settings = (*Eigenwalkers._settings, "merge")
    _stored = (*Eigenwalkers._stored, "noise_", "inflation_")
    _shapes = Eigenwalkers._shapes | {"noise_": _NOISE_SHAPE, "inflation_": (len(MARKERS),)}

    def __init__(self, n_components: int | None = None, tol: float = 1e-7, max_iter: int = 500, merge: bool = False):
        super().__init__(n_components, tol, max_iter)
        self.merge = merge

    def fit(self, walkers, subjects=None) -> "WalkerPrior":
        """Learn from `walkers` and their mirror images, and from leaving people out.

        Args:
            walkers: `Walker`s, from `fourier_walker`; NaN in the coefficients of markers that were not seen.
            subjects: a person's label for each, who is left out with all of his walks; None takes each for a person of
                its own.

        Raises:
            MotionError: fewer than three people, or not enough for n_components; labels and walkers don't match.
            GapError: a marker that nobody shows, or nobody but people who are left out together; names it.
        """
        walkers, subjects = labelled(walkers, subjects)
        own = subjects if self.merge else [str(i) for i in range(len(walkers))]
        w, log_frequencies, _ = mean_walkers(walkers, own)
        labels = tuple(dict.fromkeys(subjects)) if self.merge else tuple(subjects)
        self.people_ = labels * 2
        self.n_people_, self.n_walkers_ = len(set(labels)), len(walkers)
        if self.n_people_ < 3:
            raise MotionError(
                f"a prior learns how it errs by leaving people out, so needs three; the walks are of {self.n_people_}: "
                "add other people's (subjects= says who is who; of files, the name up to the first '_')"
            )
        self._learn(_with_mirror_images(w), self._columns_rank(2 * len(w)))
        self._learn_pace(log_frequencies)
        left_out = self._leave_out(w, np.array(labels))
        factor = _best_factor(left_out)
        self.noise_ = _noise(_total(left_out), factor)
        self.inflation_ = _inflation(left_out, factor)
        return self

    @classmethod
    def from_arrays(cls, arrays: dict[str, np.ndarray], meta: dict) -> Self:
        """The model that `to_arrays` took apart into `arrays` and `meta`; without labels and scores of the people.

        Raises:
            ModelError: shapes that don't belong together, or variances that aren't.
        """
        for name in ("noise_", "inflation_"):
            if not (arrays[name] > 0).all():
                raise ModelError(f"{name} must be above 0: fit the model again")
        return super().from_arrays(arrays, meta)

    def _columns_rank(self, n_columns: int) -> int:
        """N.

        Raises:
            MotionError: more are asked for than there can be.
        """
        most = n_columns - 1
        rank = min(_USUAL, most) if self.n_components is None else self.n_components
        if not (1 <= rank <= most and rank == int(rank)):
            raise MotionError(
                f"{n_columns} walks and mirror images can have 1 to {most} components, asked for {rank}: "
                "fit more walks, or fewer components"
            )
        return int(rank)

    def _learn_pace(self, log_frequencies: np.ndarray) -> None:
        """Regress people's mean log frequency on their mean scores; with the mirror images', what is one-sided is 0."""
        who, of = np.unique(self.people_, return_inverse=True)
        mean = np.stack([np.bincount(of, column) for column in self.scores_.T], axis=1) / np.bincount(of)[:, None]
        frequencies = np.bincount(of, np.tile(log_frequencies, 2), len(who)) / np.bincount(of)
        fitted = shrunk_regression(mean / np.sqrt(self.explained_variance_), frequencies)
        self.log_frequency_mean_, self.log_frequency_weights_, self.log_frequency_deviation_ = fitted

    def _leave_out(self, w: np.ndarray, labels: np.ndarray) -> list[_LeftOut]:
        """Leave out whole people, some at a time; walks w (n, 5, 15, 3), of the person of each label (n,)."""
        _, of, walks = np.unique(labels, return_inverse=True, return_counts=True)
        fold, weights = of % _FOLDS, 1 / walks[of]
        found = []
        for out in (fold == i for i in range(fold.max() + 1)):
            others = _with_mirror_images(w[~out])
            rank = min(len(self.components_), len(others) - 1)
            mean, components, variance, _ = self._decomposed(others, rank)
            squares = _rest(w[out], weights[out], mean, components)
            found.append(_LeftOut(w[out], weights[out], mean, components, variance, squares))
        return found


def _with_mirror_images(w: np.ndarray) -> np.ndarray:
    return np.concatenate([w, mirrored(w)])


def _rest(w, weights, mean, components) -> np.ndarray:
    """Weighted sums over walks w (n, 5, 15, 3) and axes of what `components` leave, squared, and of the weights.

    Sine and cosine, left and right share theirs.
    """
    deviations = (w - mean).reshape(len(w), -1)
    flat = components.reshape(len(components), -1)
    rest, known = np.zeros_like(deviations), np.isfinite(deviations)
    for one, some, deviation in zip(rest, known, deviations, strict=True):
        e = flat[:, some]
        one[some] = deviation[some] - np.linalg.lstsq(e.T, deviation[some], rcond=None)[0] @ e
    sums = np.stack([np.tensordot(weights, part, 1).reshape(w.shape[1:]).sum(axis=-1) for part in (rest**2, known)])
    for pair in (slice(1, 3), slice(3, 5)):
        sums[:, pair] = sums[:, pair].sum(axis=1, keepdims=True)
    return sums + sums[..., OTHER_SIDE]


def _lifted(out: _LeftOut, noise: np.ndarray, alpha: float, seen: np.ndarray, w: np.ndarray):
    """What a level view at `alpha` of walks w (n, 5, 15, 3) tells of the dimension that it doesn't show.

    Args:
        out: the components to lift with (eq. 3.15, with noise (5, 15) for each harmonic and marker).
        noise: [m²].
        alpha: [rad].
        seen: (15,) which markers are.
        w: the walks, with these markers known.

    Returns:
        error (n, 5, seen) [m] of the coefficients, and variance (phases, seen) [m²] over time.
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
    """Yields, for each view of those left out who show the same markers: which these are, weights, error, variance."""
    for out, noise in zip(left_out, _noises(left_out, factor), strict=True):
        patterns, which = np.unique(np.isfinite(out.w).all(axis=(1, 3)), axis=0, return_inverse=True)
        for i, seen in enumerate(patterns):
            rows = which.reshape(-1) == i
            for alpha in _VIEWS:
                yield seen, out.weights[rows], *_lifted(out, noise, alpha, seen, out.w[rows])


def _noises(left_out: list[_LeftOut], factor: float) -> list[np.ndarray]:
    """For each fold the noise (5, 15) [m²], times `factor`, that the other folds tell."""
    total = _total(left_out)
    return [_noise(total - out.squares, factor) for out in left_out]


def _total(left_out: list[_LeftOut]) -> np.ndarray:
    return np.sum([out.squares for out in left_out], axis=0)


def _noise(squares: np.ndarray, factor: float) -> np.ndarray:
    return np.maximum(factor * squares[0] / squares[1], _FLOOR)


def _best_factor(left_out: list[_LeftOut]) -> float:
    """Of the noise: under which the missing dimension of left-out people is likeliest, lifted from views all around.

    Paper B's fig. 3 chooses σ² by the squared error, of which the least is flat and hangs on who is left out.
    """
    return float(min(_FACTORS, key=lambda factor: _unlikeliness(left_out, factor)))


def _unlikeliness(left_out: list[_LeftOut], factor: float) -> float:
    """Weighted sum over views and markers of -2 log-density of the missing dimension, averaged over the cycle."""
    total = 0.0
    for _, weights, error, variance in _every_lift(left_out, factor):
        square = np.einsum("th,nhm->ntm", _CYCLE, error) ** 2
        total += weights @ (square / variance + np.log(variance)).mean(axis=1).sum(axis=-1)
    return total


def _inflation(left_out: list[_LeftOut], factor: float) -> np.ndarray:
    """By marker (15,), what variances must be multiplied by so that bands hold on left-out people; left is as right."""
    found: list[list[tuple[np.ndarray, np.ndarray]]] = [[] for _ in MARKERS]
    for seen, weights, error, variance in _every_lift(left_out, factor):
        z = np.abs(np.einsum("th,nhm->ntm", _CYCLE, error)) / np.sqrt(variance)
        for i, marker in enumerate(np.flatnonzero(seen)):
            found[marker].append((z[..., i].ravel(), np.repeat(weights, len(_CYCLE))))
    z90 = [_quantile(found[i] + found[j]) for i, j in enumerate(OTHER_SIDE)]
    return np.maximum((np.array(z90) / _NORMAL) ** 2, _LEAST_INFLATION)


def _quantile(parts: list[tuple[np.ndarray, np.ndarray]]) -> float:
    """The weighted quantile `_BAND` of values and their weights, both in `parts`."""
    values, weights = (np.concatenate(some) for some in zip(*parts, strict=True))
    order = np.argsort(values)
    share = np.cumsum(weights[order]) / weights.sum()
    return float(values[order[np.searchsorted(share, _BAND)]])
