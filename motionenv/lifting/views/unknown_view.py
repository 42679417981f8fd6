r"""Unknown view: paper B's eqs. 4.5 and 4.6 over the full circle, also for unknown phase, elevation, scale and offset.

    (α, k) = argmin ‖ŵ - w̄(α) - Ê(α) k‖²                                (4.5)
    (α, k) = argmin ‖ŵ - w̄(α) - Ê(α) k‖² / 2σ² + Σ k² / 2λ               (4.6)

For a given view the scores have a closed form, so the cost is a smooth function of the angles alone. It is evaluated
on a grid, and each local minimum is refined by Newton's method. Beyond the paper's α, these may
be unknown:

- phase φ: the phase at which the sequence starts. It rotates each harmonic. As noise doesn't depend on phase, the cost
  is a polynomial of degree 4 in sin φ and cos φ.
- elevation ε: the angle by which the camera looks down.
- scale s, pixels per metre: with τ = 1/s the density of τ ŵ is maximised, n log τ included, which has a closed form.
- offset of the image's origin: eliminated by subtracting the weighted mean of p0 from data and model.

A symmetric walker looks the same from opposite sides, except for depth. `Views.alternatives` therefore holds all other
minima; exp(objective - alternative) is the probability of each relative to the best.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.representation import OneLine
from motionenv._core.validation import checked_number
from motionenv.errors import ModelError, MotionError
from motionenv.lifting.view_geometry import axes
from motionenv.lifting.views import _gaussian as seen_from
from motionenv.lifting.views._search import Cost, search
from motionenv.models.eigenwalkers.fourier_model import FourierModel
from motionenv.models.eigenwalkers.fourier_series import later

ELEVATIONS = (np.radians(-15.0), np.radians(45.0))  # search range of an unknown elevation
_STEP = np.radians([3.0, 7.5, 15.0])  # grid spacing of α, ε, φ
_MOST = 16  # most minima kept per sequence


@dataclass(frozen=True, eq=False, repr=False)
class Views(OneLine):
    """Estimated views of sequences, the most probable view of each; leading axes are those of the sequences.

    Attributes:
        alpha: (...) [rad] in (-π, π].
        elevation: (...) [rad].
        phase: (...) [rad] in (-π, π], ωt of the sequence at which the walker has phase 0.
        scale: (...) units of `w2` (such as pixels) per metre.
        offset: (..., 2) [m], to be added to p0 of every marker after division by the scale; 0 if it is known.
        scores: (..., N) [m].
        objective: (...) negative log density: ‖ŵ - w̄ - Êk‖² / 2σ² + Σ k² / 2λ, the second term for "map" only.
        alpha_deviation: (...) [rad], standard deviation of alpha from the curvature of the objective; NaN at a bound.
            On held-out people it is too small by a third to a half, and by more if w2 is noisier than `measurement`.
        alternatives: the other local minima, with one more axis (..., K) sorted by objective and padded with NaN.
    """

    alpha: np.ndarray
    elevation: np.ndarray
    phase: np.ndarray
    scale: np.ndarray
    offset: np.ndarray
    scores: np.ndarray
    objective: np.ndarray
    alpha_deviation: np.ndarray
    alternatives: Views | None = None

    def aligned(self, w2: ArrayLike) -> np.ndarray:
        """`w2` (..., 5, 15, 2) converted to the model's metres, phase and origin, as `maximum_a_posteriori` expects."""
        w2 = later(np.asarray(w2, dtype=np.float64) / self.scale[..., None, None, None], self.phase)
        w2[..., 0, :, :] += self.offset[..., None, :]
        return w2


def find_view(
    model: FourierModel, w2: ArrayLike, *, approach: str = "map", variance: float | None = seen_from.VARIANCE,
    n_components: int | None = None, phase: float | str = 0.0, elevation: float | str | tuple[float, float] = 0.0,
    scale: float | str = 1.0, offset: str = "known", alphas: float | tuple[float, float] | None = None,
    measurement: float = 0.0,
) -> Views:  # fmt: skip
    """Estimate the view of each sequence (eqs. 4.5, 4.6).

    Args:
        model: `Eigenwalkers` or `WalkerPrior`.
        w2: (..., 5, 15, 2) 2D coefficients across and upwards, in metres × scale; NaN for a missing marker.
        approach: "map" (4.6) or "ls" (4.5).
        variance: σ² [m²]; None uses the model's own, per harmonic and marker.
        n_components: number of leading components to use; None for all.
        phase: ωt [rad] at which the walker has phase 0, or "unknown".
        elevation: [rad], a search range (low, high), or "unknown" for -15 to 45 degrees.
        scale: units of w2 per metre, or "unknown".
        offset: "known" if p0 has the model's origin (`motionenv.models.eigenwalkers.fourier_series`), or "unknown".
        alphas: [rad], or a search range (low, high); None for the full circle.
        measurement: variance [m²] of the error of w2, broadcast to (5, 15); added to σ², the walker's own.

    Raises:
        MotionError: bad shapes or values; too few markers to determine N components by least squares.
        ModelError: the model has no noise estimate, or its noise depends on phase while phase is unknown.
    """
    if approach not in ("map", "ls") or offset not in ("known", "unknown"):
        raise MotionError(
            f'approach must be "map" or "ls", offset "known" or "unknown"; got {approach!r} and {offset!r}'
        )
    g = seen_from.gaussian(model, variance, n_components, approach == "map", measurement)
    y, seen = seen_from.checked_sequences(w2)
    noise = g.noise + g.measurement
    if _is_unknown(phase) and not np.allclose(noise[1::2], noise[2::2], rtol=1e-9):
        raise ModelError('variance and measurement must be equal for sine and cosine if phase is "unknown"')
    grid = _Grid.of(alphas, elevation, phase)
    y = y / (1.0 if _is_unknown(scale) else checked_number(scale, "scale", above=0))
    y = y if _is_unknown(phase) else later(y, float(seen_from.checked_angle(phase, "phase", ())))
    shape, n = seen.shape[:-1], int(np.prod(seen.shape[:-1]))
    y, seen = y.reshape(n, *seen_from.SHAPE, 2), seen.reshape(n, -1)
    found = _Found.of(n, len(g.precision))
    for pattern, rows in seen_from.patterns(seen):
        _search(g, grid, y, pattern, rows, _is_unknown(scale), offset == "unknown", found)
    if not _is_unknown(phase):
        found.angles[..., 2] += float(phase)
    if not _is_unknown(scale):
        found.tau[:] /= float(scale)
    return found.views(shape)


def _is_unknown(value) -> bool:
    return isinstance(value, str) and value == "unknown"


@dataclass(frozen=True, eq=False)
class _Grid:
    """Search grid of α, ε, φ, and bounds (3,), equal where an angle is given."""

    alphas: np.ndarray
    elevations: np.ndarray
    phases: np.ndarray
    low: np.ndarray
    high: np.ndarray

    @classmethod
    def of(cls, alphas, elevation, phase) -> _Grid:
        """The grid for the arguments of `find_view`."""
        circle, ends = (-np.pi, np.pi), (-np.inf, np.inf)
        across = circle if alphas is None else _range(alphas, "alphas")
        up = _range(ELEVATIONS if _is_unknown(elevation) else elevation, "elevation")
        turns = circle if _is_unknown(phase) else (0.0, 0.0)
        bounds = ends if alphas is None else across, up, ends if _is_unknown(phase) else turns
        spans = zip((across, up, turns), _STEP, (alphas is None, False, _is_unknown(phase)), strict=True)
        steps = [np.linspace(*s, max(1, int(np.ceil(np.ptp(s) / step - 1e-9)) + (not whole)), endpoint=not whole)
                 for s, step, whole in spans]  # fmt: skip
        return cls(*steps, *np.array(bounds, dtype=np.float64).T.copy())


def _range(given, name: str) -> tuple[float, float]:
    if isinstance(given, str) or np.size(given) > 2:
        raise MotionError(f'{name} must be an angle [rad], a range (low, high) or "unknown"; got {given!r}')
    low, high = seen_from.checked_angle(given, name, (2,))
    if low > high or (np.size(given) == 2 and low == high):
        raise MotionError(f"{name} must be a range (low, high) with low < high, got {given!r}")
    return float(low), float(high)


@dataclass(frozen=True, eq=False)
class _Found:
    """Minima of n sequences, padded with NaN."""

    angles: np.ndarray
    tau: np.ndarray
    cost: np.ndarray
    variance: np.ndarray
    scores: np.ndarray
    offset: np.ndarray

    @classmethod
    def of(cls, n: int, components: int) -> _Found:
        """Allocate for n sequences."""
        return cls(*(np.full((n, _MOST, *more), np.nan) for more in ((3,), (), (), (), (components,), (2,))))

    def views(self, shape: tuple) -> Views:
        """The lowest minima as `Views` of `shape`, the others as alternatives."""
        k = int(np.isfinite(self.cost).sum(axis=1).max())
        circular = np.pi - (np.pi - self.angles[..., [0, 2]]) % (2 * np.pi)
        fields = {
            "alpha": circular[..., 0], "elevation": self.angles[..., 1], "phase": circular[..., 1],
            "scale": 1 / self.tau, "offset": self.offset, "scores": self.scores, "objective": self.cost,
            "alpha_deviation": np.sqrt(self.variance),
        }  # fmt: skip
        others = Views(**{name: f[:, 1:k].reshape((*shape, k - 1, *f.shape[2:])) for name, f in fields.items()})
        best = {name: f[:, 0].reshape((*shape, *f.shape[2:])) for name, f in fields.items()}
        return Views(**best, alternatives=others)


def _search(g: seen_from.Gaussian, grid: _Grid, y, seen, rows, any_scale: bool, any_place: bool, found: _Found) -> None:
    """Write the minima of the sequences `rows` of `y` (n, 5, 15, 2), which show the markers `seen` (15,)."""
    terms = seen_from.data_terms(g, y[rows], seen, len(grid.phases) > 1, any_place)
    cost = Cost(terms, g.precision, terms.count if any_scale else 0)
    try:
        minima = search(cost, (grid.alphas, grid.elevations, grid.phases), grid.low, grid.high, _STEP, _MOST)
    except np.linalg.LinAlgError:
        raise MotionError(
            f"{int(seen.sum())} markers don't determine {len(g.precision)} components by least squares: lower "
            'n_components, or use approach="map"'
        ) from None
    for i, (row, (angles, variance)) in enumerate(zip(rows, minima, strict=True)):
        kept = slice(len(angles))
        height, tau, scores = cost.at(angles, np.full(len(angles), i))
        found.angles[row, kept], found.variance[row, kept] = angles, variance
        found.cost[row, kept], found.tau[row, kept], found.scores[row, kept] = height, tau, scores
        shown = axes(angles[:, 0], angles[:, 1])[:, :2]
        centres = terms.model_centre[0] + scores @ terms.model_centre[1:]
        found.offset[row, kept] = np.einsum("kij,kj->ki", shown, centres) - tau[:, None] * terms.centres[i]
