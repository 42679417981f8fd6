"""Shared parts of the lifting benchmarks: folds of left-out people, models, and errors of lifted walks."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks import Arguments, scratch
from benchmarks.captured_walks import cmu_markers
from benchmarks.lifting.walker_errors import walker_error
from motionenv.lifting.view_geometry import depth, project
from motionenv.lifting.views.known_view import least_squares, maximum_a_posteriori
from motionenv.models.eigenwalkers.extraction import fourier_walker
from motionenv.models.eigenwalkers.fourier_series import FourierWalker, columns
from motionenv.models.eigenwalkers.model import Eigenwalkers
from motionenv.models.eigenwalkers.walker_prior import WalkerPrior

VIEWS = np.radians(np.arange(-90, 91))
VARIANCE = 70e-6  # [m²], paper B's σ² = 70 mm²
CURVED = "38_02"  # not straight: left out of the 55
FPS = 30.0  # frames per second of the 2D sequences to which noise is added


def options(doc: str, *mocap: str) -> Arguments:
    """The command line of these scripts, which need folders of motion capture."""
    parser = Arguments(doc, mocap=mocap)
    parser.add_argument("--out", type=Path, quick=scratch(), help="folder for figures (PNG) and all numbers (JSON)")
    return parser


@dataclass(frozen=True)
class Fold:
    """The walks of one left-out person, and those of all others."""

    person: str
    test: list[FourierWalker]
    others: list[FourierWalker]
    people: list[str]  # of the others
    coefficients: np.ndarray = field(init=False)  # (n, 5, 15, 3) [m] of the person's walks

    def __post_init__(self):
        object.__setattr__(self, "coefficients", np.stack([w.coefficients for w in self.test]))


def cmu_folds(mocap: Path) -> list[Fold]:
    """The 54 straight CMU walks, each of the 11 people left out in turn."""
    markers, people = cmu_markers(mocap)
    kept = [(fourier_walker(m), p) for m, p in zip(markers, people, strict=True) if m.name != CURVED]
    return [
        Fold(
            person,
            [w for w, p in kept if p == person],
            [w for w, p in kept if p != person],
            [p for _, p in kept if p != person],
        )
        for person in dict.fromkeys(p for _, p in kept)
    ]


def paper_models(folds: list[Fold], n: int) -> list[Eigenwalkers]:
    """Paper B's model without each person: a column per walk, N = `n`."""
    return [Eigenwalkers(n).fit(fold.others) for fold in folds]


def our_models(folds: list[Fold]) -> list[WalkerPrior]:
    """Our prior without each person."""
    return [WalkerPrior().fit(fold.others, fold.people) for fold in folds]


def approach_one(n: int | None = None) -> Callable:
    """Paper B's approach I with `n` components (eq. 3.9)."""
    return partial(least_squares, n_components=n)


def approach_two(n: int | None = None, variance: float | None = VARIANCE) -> Callable:
    """Paper B's approach II (eq. 3.15) with `n` components; `variance` [m²], None for the model's own."""
    return partial(maximum_a_posteriori, variance=variance, n_components=n)


@dataclass(frozen=True)
class Lifted:
    """Estimate and truth of the missing dimension: coefficients (walks, views, 5, 15) [m]."""

    estimate: np.ndarray
    truth: np.ndarray
    person: np.ndarray  # (walks,)

    @property
    def errors(self) -> np.ndarray:
        """E_a (walks, views) [m²] (eq. 4.2)."""
        return walker_error(self.estimate, self.truth)

    @property
    def rms(self) -> float:
        """Rms error over walks and views [mm]."""
        return 1e3 * float(np.sqrt(self.errors.mean()))

    @property
    def rms_of_people(self) -> float:
        """Rms error with every person weighted equally [mm]."""
        by_walk = self.errors.mean(axis=1)
        return 1e3 * float(np.sqrt(np.mean([by_walk[self.person == p].mean() for p in np.unique(self.person)])))

    @property
    def distance(self) -> float:
        """MPJPE [mm] over the cycle; only the missing dimension has errors."""
        over_time = np.einsum("th,wvhm->twvm", columns(np.arange(16) * (2 * np.pi / 16)), self.estimate - self.truth)
        return 1e3 * float(np.abs(over_time).mean())


def from_known_views(folds: list[Fold], models: list, lift: Callable, views: np.ndarray) -> Lifted:
    """Lift every left-out walk from each of the `views` (n,) [rad], which are known."""
    estimates = [
        lift(model, project(fold.coefficients[:, None], views), views).depth
        for fold, model in zip(folds, models, strict=True)
    ]
    return Lifted(np.concatenate(estimates), true_depth(folds, views), persons(folds))


def true_depth(folds: list[Fold], views: np.ndarray) -> np.ndarray:
    """True missing dimension: coefficients (walks, views, 5, 15) [m]."""
    return np.concatenate([depth(fold.coefficients[:, None], views) for fold in folds])


def persons(folds: list[Fold]) -> np.ndarray:
    """The person of each walk, in the folds' order (walks,)."""
    return np.concatenate([[fold.person] * len(fold.test) for fold in folds])


def noisy(fold: Fold, w2: np.ndarray, deviation: float, rng: np.random.Generator) -> np.ndarray:
    """2D coefficients (walks, views, 5, 15, 2) [m] fitted to frames with noise of `deviation` [m] on each point.

    T is the number of frames of the walk's steady stretch at 30 per second. White noise on T frames is, in the
    coefficients, N(0, deviation² (Bᵀ B)⁻¹), with B (T, 5) the functions of eq. 3.1.
    """
    out = w2.copy()
    for one, walker in zip(out, fold.test, strict=True):
        frames = np.arange(round(FPS * walker.strides / walker.frequency))
        basis = columns(2 * np.pi * walker.frequency / FPS * frames)
        root = np.linalg.cholesky(np.linalg.inv(basis.T @ basis))
        one += deviation * np.einsum("ij,vjmc->vimc", root, rng.standard_normal(one.shape))
    return out
