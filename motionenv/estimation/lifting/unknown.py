r"""Unknown view: paper B's eqs. 4.5 and 4.6 over the full circle, and phase, elevation, scale and place with it.

    (α, k) = argmin ‖ŵ - w̄(α) - Ê(α) k‖²                                (4.5)
    (α, k) = argmin ‖ŵ - w̄(α) - Ê(α) k‖² / 2σ² + Σ k² / 2λ               (4.6)

For a given view the scores have a closed form, so the cost is a smooth function of the angles alone. It is looked
through on a grid, and each of its local minima is polished by Newton's method with exact derivatives. More may be
unknown than the paper's angle:

- phase φ: where in the stride the sequence starts. It turns each harmonic, and as noise doesn't depend on phase, the
  cost is a polynomial of degree 4 in sin φ and cos φ.
- elevation ε: how steeply the camera looks down.
- scale s, pixels per metre: with τ = 1/s the density of τ ŵ is maximised, n log τ included, which has a closed form.
- offset: where the picture's origin is; it takes the (weighted) mean of p0 out of data and model.

A view and the one from the opposite side show a walker who leans neither way alike but for depth. `Views.alternatives`
holds all other minima, with objectives that tell how much worse they are: exp(objective - alternative) is how probable
each is beside the best.
"""

from dataclasses import dataclass

import numpy as np

from motionenv.errors import ModelError, MotionError
from motionenv.estimation.lifting._data_terms import data_terms
from motionenv.estimation.lifting._gaussian import (
    SHAPE,
    VARIANCE,
    Gaussian,
    checked_angle,
    checked_sequences,
    gaussian,
    is_positive,
    patterns,
)
from motionenv.estimation.lifting.geometry import axes
from motionenv.models._threads import in_chunks
from motionenv.models.harmonics import columns, later

ELEVATIONS = (np.radians(-15.0), np.radians(45.0))  # looked through where elevation is unknown
_STEP = np.radians([3.0, 7.5, 15.0])  # of the grid of α, ε, φ
_MOST = 16  # minima of one sequence


@dataclass(frozen=True, eq=False)
class Views:
    """From where sequences were seen, most probable view first; leading axes are the sequences'.

    Attributes:
        alpha: (...) [rad] in (-π, π].
        elevation: (...) [rad].
        phase: (...) [rad] in (-π, π], ωt of the sequence where the walker has zero phase.
        scale: (...) pixels, or whatever `w2` came in, per metre.
        offset: (..., 2) [m], to be added to p0 of every marker after the scale is taken out; 0 where it is known.
        scores: (..., N) [m].
        objective: (...) minus the log-density: ‖ŵ - w̄ - Êk‖² / 2σ² + Σ k² / 2λ, the second term for "map" only.
        alpha_deviation: (...) [rad], standard deviation of alpha by the curvature of the objective; NaN at a bound. On
            people left out it is too small by a third to a half, and more where w2 is noisier than `measurement` says.
        alternatives: the other local minima, with one more axis (..., K) in order of objective, filled with NaN.
    """

    alpha: np.ndarray
    elevation: np.ndarray
    phase: np.ndarray
    scale: np.ndarray
    offset: np.ndarray
    scores: np.ndarray
    objective: np.ndarray
    alpha_deviation: np.ndarray
    alternatives: "Views | None" = None

    def aligned(self, w2) -> np.ndarray:
        """`w2` (..., 5, 15, 2) in the model's metres, phase and place, as `maximum_a_posteriori` takes it."""
        w2 = later(np.asarray(w2, dtype=np.float64) / self.scale[..., None, None, None], self.phase)
        w2[..., 0, :, :] += self.offset[..., None, :]
        return w2


def find_view(
    model,
    w2,
    *,
    approach: str = "map",
    variance: float | None = VARIANCE,
    n_components: int | None = None,
    phase: float | str = 0.0,
    elevation: float | str | tuple[float, float] = 0.0,
    scale: float | str = 1.0,
    offset: str = "known",
    alphas: float | tuple[float, float] | None = None,
    measurement=0.0,
) -> Views:
    """The view of each sequence (eqs. 4.5, 4.6).

    Args:
        model: `Eigenwalkers` or `WalkerPrior`.
        w2: (..., 5, 15, 2) 2D coefficients across and upwards, metres × scale; NaN for a marker missing throughout.
        approach: "map" (4.6) or "ls" (4.5).
        variance: σ² [m²]; None takes the model's own, per harmonic and marker.
        n_components: the first N of the model's; None for all.
        phase: ωt [rad] where the walker has zero phase, or "unknown".
        elevation: [rad], a range (low, high) to look in, or "unknown" for -15 to 45 degrees.
        scale: of w2 per metre, or "unknown".
        offset: "known" where p0 stands in the model's place (`motionenv.models.harmonics`), or "unknown".
        alphas: [rad], or a range (low, high) to look in; None for the full circle.
        measurement: variance [m²] of errors in w2, fits (5, 15); on top of σ², which is the walker's own.

    Raises:
        MotionError: bad shapes or values; too few markers to tell N components by least squares.
        ModelError: the model's noise is asked for and isn't known, or depends on phase while phase is unknown.
    """
    if approach not in ("map", "ls") or offset not in ("known", "unknown"):
        raise MotionError(f"approach must be map or ls, offset known or unknown, got {approach!r} and {offset!r}")
    g = gaussian(model, variance, n_components, approach == "map", measurement)
    y, seen = checked_sequences(w2)
    noise = g.noise + g.measurement
    if _is_unknown(phase) and not np.allclose(noise[1::2], noise[2::2], rtol=1e-9):
        raise ModelError("variance or measurement differs between sine and cosine: that can't tell an unknown phase")
    grid = _Grid.of(alphas, elevation, phase)
    y = y / (1.0 if _is_unknown(scale) else _checked_scale(scale))
    y = y if _is_unknown(phase) else later(y, float(checked_angle(phase, "phase", ())))
    shape, n = seen.shape[:-1], int(np.prod(seen.shape[:-1]))
    y, seen = y.reshape(n, *SHAPE, 2), seen.reshape(n, -1)
    found = _Found.of(n, len(g.precision))
    for pattern, rows in patterns(seen):
        _search(g, grid, y, pattern, rows, _is_unknown(scale), offset == "unknown", found)
    if not _is_unknown(phase):
        found.angles[..., 2] += float(phase)
    if not _is_unknown(scale):
        found.tau[:] /= float(scale)
    return found.views(shape)


def _is_unknown(value) -> bool:
    """Whether `value`, a number or the like, is the word "unknown"."""
    return isinstance(value, str) and value == "unknown"


def _checked_scale(scale) -> float:
    if not is_positive(scale):
        raise MotionError(f"scale must be a number above 0 per metre, or unknown, got {scale!r}")
    return float(scale)


@dataclass(frozen=True, eq=False)
class _Grid:
    """Where to look: α, ε, φ of a grid, and bounds (3,), equal where an angle is given."""

    alphas: np.ndarray
    elevations: np.ndarray
    phases: np.ndarray
    low: np.ndarray
    high: np.ndarray

    @classmethod
    def of(cls, alphas, elevation, phase) -> "_Grid":
        """Of what `find_view` was asked for."""
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
    """(low, high) of a number or a pair."""
    if isinstance(given, str) or np.size(given) > 2:
        raise MotionError(f"{name} must be a number of radians, a range (low, high) or unknown, got {given!r}")
    low, high = checked_angle(given, name, (2,))
    if low > high or (np.size(given) == 2 and low == high):
        raise MotionError(f"{name} must go from low to high, got {given!r}")
    return float(low), float(high)


@dataclass(frozen=True, eq=False)
class _Found:
    """Minima of n sequences, NaN where there are fewer than the most."""

    angles: np.ndarray
    tau: np.ndarray
    cost: np.ndarray
    variance: np.ndarray
    scores: np.ndarray
    offset: np.ndarray

    @classmethod
    def of(cls, n: int, components: int) -> "_Found":
        """Room for them."""
        return cls(*(np.full((n, _MOST, *more), np.nan) for more in ((3,), (), (), (), (components,), (2,))))

    def views(self, shape: tuple) -> Views:
        """The best as `Views` of `shape`, the others as alternatives."""
        k = int(np.isfinite(self.cost).sum(axis=1).max())
        circular = np.pi - (np.pi - self.angles[..., [0, 2]]) % (2 * np.pi)
        fields = {
            "alpha": circular[..., 0],
            "elevation": self.angles[..., 1],
            "phase": circular[..., 1],
            "scale": 1 / self.tau,
            "offset": self.offset,
            "scores": self.scores,
            "objective": self.cost,
            "alpha_deviation": np.sqrt(self.variance),
        }
        others = Views(**{name: f[:, 1:k].reshape((*shape, k - 1, *f.shape[2:])) for name, f in fields.items()})
        best = {name: f[:, 0].reshape((*shape, *f.shape[2:])) for name, f in fields.items()}
        return Views(**best, alternatives=others)


def _search(g: Gaussian, grid: _Grid, y, seen, rows, any_scale: bool, any_place: bool, found: _Found) -> None:
    """Writes what is found for the sequences `rows` of `y` (n, 5, 15, 2), which show the markers `seen` (15,)."""
    from motionenv.estimation.lifting._search_kernels import factor_views, search

    terms = data_terms(g, y[rows], seen, len(grid.phases) > 1, any_place)
    size, n = len(grid.alphas) * len(grid.elevations), len(g.precision)
    views = np.empty((size, 5)), np.empty((size, n, n)), np.empty((size, n)), np.empty(size)
    if not factor_views(grid.alphas, grid.elevations, terms.blocks, g.precision, *views):
        raise MotionError(
            f"{int(seen.sum())} markers don't tell {n} components by least squares: lower n_components, or take map"
        )
    count = terms.count if any_scale else 0
    turns = columns(grid.phases) if len(grid.phases) > 1 else np.ones((1, 1))
    where = (grid.alphas, grid.elevations, grid.phases), turns, grid.low, grid.high, _STEP
    given = terms.blocks, g.precision, views
    fields = found.angles, found.tau, found.cost, found.variance, found.scores
    out = [a[rows] for a in fields]
    in_chunks(
        lambda i, j: search(*where, terms.data[i:j], terms.squares[i:j], count, *given, *(a[i:j] for a in out)),
        len(rows),
    )
    for a, b in zip(fields, out, strict=True):
        a[rows] = b
    shown = axes(out[0][..., 0], out[0][..., 1])[..., :2, :]
    centres = terms.model_centre[0] + out[4] @ terms.model_centre[1:]
    found.offset[rows] = np.einsum("...ij,...j->...i", shown, centres) - out[1][..., None] * terms.centres[:, None]
