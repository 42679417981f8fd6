r"""Parameters θ of a scene, such as a body's height, by particle marginal Metropolis-Hastings (Andrieu et al. 2010).

A bootstrap filter estimates the evidence p(J_1 ... J_T | θ) of a clip without bias. A Metropolis-Hastings chain on such
estimates has the exact posterior p(θ | J_1 ... J_T), whatever the number of particles; with few, it accepts little.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from motionenv._core.validation import checked_number, checked_whole, random_generator
from motionenv.errors import MotionError
from motionenv.tracking.particle_filter import ParticleFilter

_ACCEPTED = 0.25  # acceptance rate at which warming up aims; noisy evidences favour less than 0.44 (Doucet et al. 2015)
_REMEMBERED = 20  # steps before the proposal takes the chain's covariance


@dataclass(frozen=True)
class Unknown:
    """A positive parameter's prior: log-normal between bounds.

    Attributes:
        median: in the parameter's unit, and where the chain begins.
        spread: standard deviation of the log.
        low, high: bounds.

    Raises:
        MotionError: a number out of range.
    """

    median: float
    spread: float
    low: float = 0.0
    high: float = np.inf

    def __post_init__(self) -> None:
        checked_number(self.spread, "spread", above=0)
        checked_number(self.median, "median", max(self.low, 1e-300), self.high)


class Build(Protocol):
    """Makes a filter, started before the clip's first frame, for values of the parameters."""

    def __call__(self, seed: np.random.Generator, **values: float) -> ParticleFilter: ...


@dataclass(frozen=True, eq=False)
class Scene:
    """Posterior of parameters.

    Attributes:
        samples: (steps,) of each parameter, of the chain after warming up.
        log_evidences: (steps,) estimates of the clip's log evidence at the samples.
        accepted: share of the proposals that the chain took.
    """

    samples: dict[str, np.ndarray]
    log_evidences: np.ndarray
    accepted: float

    def __repr__(self) -> str:
        said = ", ".join(f"{name} {x.mean():.3g} ± {x.std():.2g}" for name, x in self.samples.items())
        return f"Scene({said}; {self.accepted:.0%} accepted)"

    @property
    def mean(self) -> dict[str, float]:
        """Posterior mean of each parameter."""
        return {name: float(x.mean()) for name, x in self.samples.items()}


def estimate_scene(
    build: Build, observations: Iterable[Mapping[str, Any]], unknown: Mapping[str, Unknown], *, steps: int = 300,
    warm_up: int = 100, seed: int | np.random.Generator | None = None,
    on_progress: Callable[[int], None] | None = None,
) -> Scene:  # fmt: skip
    """Sample the posterior of a scene's parameters given a short clip.

    The filter should have one layer, and so many particles that repeated log evidences differ by about 1. Its
    likelihood must be normalised as far as it depends on the parameters: a `SilhouetteLikelihood` must count the same
    share of its pixels (`temper`) for all heights and cameras, as `silhouettes` sees to.

    Args:
        build: called with `seed` and a value for each name in `unknown`; see `Build`.
        observations: arguments of the likelihood's `observe`, one per frame.
        unknown: prior of each parameter.
        steps: length of the chain.
        warm_up: steps before it, in which the proposals adapt to the posterior (Haario et al. 2001).
        seed: int or Generator.
        on_progress: called with the number of steps that are done, `warm_up` included.

    Raises:
        MotionError: no observations or parameters, or a number out of range, and what `build` and the filter raise.
    """
    clip = list(observations)
    if not clip or not unknown:
        raise MotionError("estimate_scene needs at least one observation and one unknown parameter")
    steps, warm_up = checked_whole(steps, "steps", 1), checked_whole(warm_up, "warm_up", 0)
    rng, names = random_generator(seed), list(unknown)
    middle = np.log([unknown[name].median for name in names])
    spread = np.array([unknown[name].spread for name in names])
    low, high = (np.array([getattr(unknown[name], bound) for name in names]) for bound in ("low", "high"))

    def scored(logs: np.ndarray) -> tuple[float, float]:
        """Log posterior up to a constant, and the estimated log evidence, at the parameters' logs."""
        if not ((np.exp(logs) >= low) & (np.exp(logs) <= high)).all():
            return -np.inf, -np.inf
        tracker = build(rng.spawn(1)[0], **dict(zip(names, np.exp(logs).tolist(), strict=True)))
        evidence = sum(tracker.step(**seen).log_evidence for seen in clip)
        return evidence - 0.5 * float((((logs - middle) / spread) ** 2).sum()), evidence

    here, (score, evidence) = middle, scored(middle)
    root, scale = np.diag(spread), 0.5
    path, evidences, taken = np.empty((warm_up + steps, len(names))), np.empty(warm_up + steps), 0
    for step in range(warm_up + steps):
        there = here + scale * root @ rng.standard_normal(len(names))
        proposed, its_evidence = scored(there)
        chance = float(np.exp(min(0.0, proposed - score))) if np.isfinite(proposed) else 0.0
        if rng.random() < chance:
            here, score, evidence, taken = there, proposed, its_evidence, taken + (step >= warm_up)
        path[step], evidences[step] = here, evidence
        if step < warm_up:
            scale *= float(np.exp((chance - _ACCEPTED) / np.sqrt(step + 1)))
            if step >= _REMEMBERED:
                recent = np.atleast_2d(np.cov(path[step // 2 : step + 1].T))
                root = np.linalg.cholesky(recent + 1e-4 * np.diag(spread**2))
        if on_progress is not None:
            on_progress(step + 1)
    samples = dict(zip(names, np.exp(path[warm_up:]).T, strict=True))
    return Scene(samples, evidences[warm_up:], taken / steps)
