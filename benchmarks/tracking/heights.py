"""Parameters of a scene, such as a person's height, by particle marginal Metropolis-Hastings (Andrieu et al. 2010).

A Metropolis-Hastings chain on a bootstrap filter's unbiased estimates of the evidence p(J_1 ... J_T | θ) samples the
exact posterior with any number of particles; with few, it accepts little.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from motionenv.body import from_height
from motionenv.errors import MotionError
from motionenv.likelihoods.silhouette import EFFECTIVE, SilhouetteLikelihood
from motionenv.tracking.particle_filter import ParticleFilter
from motionenv.tracking.priors.base import Start
from motionenv.tracking.priors.fpca import FPCAPrior
from motionenv.types import Camera

_Build = Callable[..., ParticleFilter]
_ACCEPTED, _SETTLED = 0.25, 20  # acceptance rate that is aimed at; steps before proposals follow the chain's covariance


@dataclass(frozen=True)
class Unknown:
    """Prior of a positive parameter: log-normal with a `median` and a `spread` of the log, cut off at `low` and `high`.

    Raises:
        MotionError: a spread that isn't above 0, or a median out of bounds.
    """

    median: float
    spread: float
    low: float = 0.0
    high: float = np.inf

    def __post_init__(self) -> None:
        if not self.spread > 0:
            raise MotionError(f"spread must be above 0, got {self.spread!r}")
        if not (0 < self.median and self.low <= self.median <= self.high):
            raise MotionError(f"median must be above 0, and from {self.low:g} to {self.high:g}, got {self.median!r}")


@dataclass(frozen=True, eq=False)
class Scene:
    """Posterior of parameters: `samples` (steps,) of each, and the share of proposals that the chain `accepted`."""

    samples: dict[str, np.ndarray]
    accepted: float

    def __repr__(self) -> str:
        said = ", ".join(f"{name} {x.mean():.3g} ± {x.std():.2g}" for name, x in self.samples.items())
        return f"Scene({said}; {self.accepted:.0%} accepted)"

    @property
    def mean(self) -> dict[str, float]:
        """Posterior mean of each parameter."""
        return {name: float(x.mean()) for name, x in self.samples.items()}


def estimate_scene(
    build: _Build, observations: Iterable[Mapping[str, Any]], unknown: Mapping[str, Unknown], *,
    steps: int = 200, warm_up: int = 100, seed: int | np.random.Generator | None = None,
    on_progress: Callable[[int], None] | None = None,
) -> Scene:  # fmt: skip
    """Sample the posterior of a scene's parameters, given a short clip.

    Take so many particles that log evidences vary by about 1, and a likelihood that is normalised for all parameters.

    Args:
        build: given a Generator and parameters by name, makes a filter of one layer and starts it before the clip.
        observations: arguments of the likelihood's `observe`, one per frame.
        unknown: prior of each parameter.
        steps, warm_up: of the chain, and before it, in which proposals adapt to the posterior (Haario et al. 2001).
        seed: int or Generator.
        on_progress: called with the number of steps that are done, those of warming up included.

    Raises:
        MotionError: no observation or parameter, or a number out of range; and what `build` and its filters raise.
    """
    clip, names = list(observations), list(unknown)
    if not clip or not names:
        raise MotionError("estimate_scene needs at least one observation and one unknown parameter")
    if steps < 1 or warm_up < 0:
        raise MotionError(f"steps must be at least 1 and warm_up 0, got {steps!r} and {warm_up!r}")
    rng = np.random.default_rng(seed)
    here, path, taken = np.zeros(len(names)), np.empty((warm_up + steps, len(names))), 0
    root: np.ndarray = np.eye(len(names))
    now, scale = _score(build, clip, unknown, here, rng), 1.0
    for step in range(warm_up + steps):
        there = here + scale * root @ rng.standard_normal(len(names))
        then = _score(build, clip, unknown, there, rng)
        chance = float(np.exp(min(0.0, then - now))) if then > -np.inf else 0.0
        if rng.random() < chance:
            here, now, taken = there, then, taken + (step >= warm_up)
        path[step] = here
        if step < warm_up:
            scale *= float(np.exp((chance - _ACCEPTED) / np.sqrt(step + 1)))
            if step >= _SETTLED:
                recent = np.cov(path[step // 2 : step + 1].T)
                root = np.linalg.cholesky(recent.reshape(root.shape) + 1e-4 * np.eye(len(root)))
        if on_progress is not None:
            on_progress(step + 1)
    samples = [list(_values(unknown, z).values()) for z in path[warm_up:]]
    return Scene(dict(zip(names, np.array(samples).T, strict=True)), taken / steps)


def _values(unknown: Mapping[str, Unknown], z: np.ndarray) -> dict[str, float]:
    """Parameters that are z (k,) standard deviations from their medians."""
    pairs = zip(unknown.items(), z, strict=True)
    return {name: one.median * float(np.exp(one.spread * off)) for (name, one), off in pairs}


def _score(build: _Build, clip: list, unknown: Mapping[str, Unknown], z, rng) -> float:
    """Estimated log posterior at z (k,), up to a constant."""
    values = _values(unknown, z)
    if not all(unknown[name].low <= value <= unknown[name].high for name, value in values.items()):
        return -np.inf
    tracker = build(rng.spawn(1)[0], **values)
    return sum(tracker.step(**seen).log_evidence for seen in clip) - 0.5 * float(z @ z)


def walker_filters(camera: Camera, start: Start, *, n: int = 1000, fps: float = 30.0) -> _Build:
    """`build` of `estimate_scene` for walkers' silhouettes; parameters are `height`, `girth` and `camera_height`.

    Heights are in metres, `girth` is a factor on limbs' thickness. All count the same share of a picture's pixels, as
    evidences are comparable only then. The `camera` stands still, at its own height by default. Candidates of the first
    frame's `start` that have heights move away as they grow. `n` is the number of particles, `fps` in Hz.
    """
    temper = SilhouetteLikelihood(camera).temper

    def build(rng: np.random.Generator, height: float, girth=1.0, camera_height=camera.centre[2]) -> ParticleFilter:
        centre, body = np.array([*camera.centre[:2], camera_height]), from_height(height, girth=girth)
        likelihood = SilhouetteLikelihood(replace(camera, t=-camera.R @ centre), body, threads=1)
        likelihood.effective = EFFECTIVE * temper / likelihood.temper
        tracker = ParticleFilter(FPCAPrior(skeleton=body, fps=fps), likelihood, n, seed=rng)
        tracker.start(start if start.heights is None else _grown(start, height, centre))
        return tracker

    return build


def _grown(start: Start, height: float, centre: np.ndarray) -> Start:
    """The `start` with bodies of a `height` [m], as much farther from the `centre` (3,) [m], on the ground."""
    factors = height / np.asarray(start.heights)[:, None]
    poses, previous = (
        np.hstack([centre[:2] + factors * (p[:, :2] - centre[:2]), factors * p[:, 2:3], p[:, 3:]])
        for p in (start.poses, start.previous)
    )
    return replace(start, poses=poses, previous=previous, heights=None)
