"""Searching for a walker in pictures, and following one before a background that nobody knows."""

from collections import deque
from collections.abc import Mapping, Sequence
from copy import copy
from functools import partial
from typing import Any

import numpy as np

from motionenv.envs.agents.baselines import walking_poses
from motionenv.errors import MotionError
from motionenv.likelihoods.background import Background, foreground_probability
from motionenv.likelihoods.base import ImageLikelihood, log_nobody
from motionenv.likelihoods.silhouette import SilhouetteLikelihood
from motionenv.tracking.initialization import automatic_start
from motionenv.tracking.particle_filter import Belief, ParticleFilter
from motionenv.tracking.priors.base import Prior, Start
from motionenv.types import Camera

STATURES = 0.06  # standard deviation of the log of adults' statures
_HYPOTHESES = 4000
_DISTANCES = 0.3  # standard deviation of the log of people's distances, relative to that of the world's origin
_STRAYED = 1.0  # [m] standard deviation of how far somebody strays from where he was lost
_MISTAKEN = -5.0  # log density, relative to the highest, at which somebody who was lost had been somewhere else
_CHILDREN = 0.15  # share of children of 6 to 17 years among people
_ANYWHERE = np.concatenate([np.full(2, 2.0), np.zeros(3), [2.0], np.full(19, 0.1)])  # [m, rad] spread of a pose
# In clutter. All settings were chosen on episodes 1000 to 1047 of WalkerTracking-Hard's split "train".
_REMEMBERED = 99  # frames of which the background is the median
_FIRST, _AGAIN, _IN = 8, 12, 36  # after how many frames he is searched for, how often from then on, and in how many
# What hides somebody hides him in each frame, so frames agree too well, and together say less about his distance.
_IN_CLUTTER = 0.05  # as _DISTANCES
_FAR = 0.5  # farthest log of a distance, relative to the world's origin's, at which somebody isn't something else
_LEAST = 3.0  # least log evidence per frame, against nobody, of who is followed
_BETTER = 30.0  # log evidence by which who is found must explain the frames better than who was followed
_SEARCHED, _FOLLOWED = {"misses": 0.1, "false_alarms": 0.02}, {"misses": 0.4, "false_alarms": 0.05}


def anywhere(x: float, y: float) -> Start:
    """The start of somebody at any phase and heading, who may be 2 m from a point on the ground [m]."""
    pose = walking_poses(1)[0].copy()
    pose[:2] = x, y
    return Start.at(pose, spread=_ANYWHERE)


def find(
    likelihood: ImageLikelihood, frames: Sequence[Mapping[str, Any]], prior: Prior, near: Belief | None,
    rng: np.random.Generator, distances: float = _DISTANCES,
) -> Start | None:  # fmt: skip
    """A walker of `prior` in the first of `frames`, by an automatic search; None where they don't show enough.

    He is expected `near` who was believed in that frame, and the world's origin: the log of his distance from the
    camera, relative to the origin's, has the standard deviation `distances`.
    """
    place = partial(_log_place, likelihood.camera, near, distances)
    try:
        return automatic_start(
            likelihood, frames, fps=prior.fps, n=_HYPOTHESES, size=prior.size, children=_CHILDREN, place=place, seed=rng
        )
    except MotionError:
        return None


def size_of(belief: Belief) -> np.ndarray:
    """The body size (1,) that is believed, relative to the prior's."""
    sizes = belief.state.sizes
    return np.ones(1) if sizes is None else np.exp([np.exp(belief.log_weights) @ np.log(sizes)])


def _log_place(camera: Camera, lost: Belief | None, distances: float, places: np.ndarray, sizes: np.ndarray):
    """Log density (n,) of places (n, 2) [m] and `sizes` (n,).

    People are about as far away as the world's origin, and near one who was lost, whose size they have.
    """
    centre = camera.centre
    away = np.log(np.maximum(np.hypot(*(places - centre[:2]).T), 0.1) / np.linalg.norm(centre))
    usual = -0.5 * (away / distances) ** 2
    if lost is None:
        return usual
    weights, where = np.exp(lost.log_weights), lost.poses[:, :2]
    spread = np.sqrt(_STRAYED**2 + weights @ ((where - lost.mean[:2]) ** 2).sum(axis=1) / 2)
    apart = np.hypot(*(places - lost.mean[:2]).T) / spread
    grown = np.log(sizes / size_of(lost))
    return usual + np.logaddexp(-0.5 * (apart**2 + (grown / STATURES) ** 2), _MISTAKEN)


class ClutterTrack:
    """One episode of a walker in colours before a still camera.

    The background is the median of the pictures so far, which tells something from the eighth on. Until somebody is
    found, and when he explains no more than nobody, he is somewhere about the origin. So that early pictures are judged
    by what is known now, both who was followed and who is found in the last ones are followed through these again.
    """

    def __init__(self, tracker: ParticleFilter, likelihood: SilhouetteLikelihood, rng: np.random.Generator) -> None:
        self.filter, self._searching, self._rng = tracker, likelihood, rng
        self.belief: Belief | None = None
        self._background, self._frames, self._found = Background(_REMEMBERED), 0, False
        self._recent: deque[tuple[np.ndarray, Belief]] = deque(maxlen=_IN)
        tracker.likelihood = copy(likelihood)
        for model, rates in ((likelihood, _SEARCHED), (tracker.likelihood, _FOLLOWED)):
            vars(model).update(rates)
        tracker.start(anywhere(0.0, 0.0))

    def step(self, observation: dict[str, np.ndarray]) -> Belief:
        rgb = observation["rgb"]
        self._background.observe(rgb)
        self._frames += 1
        self.belief = self.filter.step(**self._shown([rgb], self._found)[0])
        self._recent.append((rgb, self.belief))
        if self._frames >= _FIRST and (self._frames - _FIRST) % _AGAIN == 0:
            self._look()
        return self.belief

    def _shown(self, pictures: list[np.ndarray], known: bool) -> list[dict[str, np.ndarray]]:
        """Probabilities of `pictures` (height, width, 3) that a pixel isn't background; ½ unless that is `known`."""
        if not known:
            return [{"mask": np.full(rgb.shape[:2], 0.5)} for rgb in pictures]
        background = self._background.estimate()
        return [{"mask": foreground_probability(rgb, background)} for rgb in pictures]

    def _look(self) -> None:
        """Follow whoever explains the last frames best: who was followed, who a search finds, or nobody."""
        pictures, beliefs = map(list, zip(*self._recent, strict=True))
        frames = self._shown(pictures, True)
        kept = self.filter.beliefs[: -len(pictures)] if self._frames > len(pictures) else None
        least = self._nobody(frames[1:], beliefs[0].poses[0]) + _LEAST * (len(frames) - 1)
        best: tuple[ParticleFilter, list[Belief]] | None = None
        if self._found:
            old = copy(self.filter)
            old.resume(beliefs[0])
            if (evidence := self._evidence([old.step(**frame) for frame in frames[1:]])) > least:
                best, least = (self.filter, beliefs), evidence + _BETTER
        new = copy(self.filter)
        if start := find(self._searching, frames, new.prior, None, self._rng, _IN_CLUTTER):
            new.start(start, kept)
            anew = [new.step(**frame) for frame in frames]
            if self._evidence(anew[1:]) > least:
                best = new, anew
        self._found = best is not None
        if best is None:
            new.start(anywhere(0.0, 0.0), kept)
            best = new, [new.step(**frame) for frame in self._shown(pictures, False)]
        self.filter, beliefs = best
        self.belief = beliefs[-1]
        self._recent = deque(zip(pictures, beliefs, strict=True), maxlen=_IN)

    def _nobody(self, frames: list[dict[str, np.ndarray]], pose: np.ndarray) -> float:
        """Log evidence of the `frames` if nobody is in them, whatever his `pose`."""
        model, total = self.filter.likelihood, 0.0
        for frame in frames:
            model.observe(**frame)
            total += log_nobody(model, pose)
        return total

    def _evidence(self, beliefs: list[Belief]) -> float:
        """Log evidence of the frames of `beliefs`; minus infinity if who is believed has gone too far."""
        centre = self._searching.camera.centre[:2]
        away, usual = np.log(np.maximum(np.linalg.norm([beliefs[-1].mean[:2] - centre, centre], axis=1), 0.1))
        return sum(belief.log_evidence for belief in beliefs) if abs(away - usual) < _FAR else -np.inf
