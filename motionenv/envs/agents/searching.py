"""Searching for a walker in pictures, and following one before a background that nobody knows."""

from collections import deque
from collections.abc import Mapping, Sequence
from copy import copy, deepcopy
from functools import partial
from typing import Any, cast

import numpy as np

from motionenv.envs.agents.baselines import walking_poses
from motionenv.errors import MotionError
from motionenv.likelihoods.base import ImageLikelihood
from motionenv.likelihoods.pixel_history import PixelHistory
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
# Rates by which a start is chosen, and somebody who was lost is found: of who is in plain view, and of who walks behind
# things that nobody knows. Once found, people are followed with less certainty (see `followed`).
CLEAR = {"misses": 0.1, "false_alarms": 0.02}
BEHIND = {"misses": 0.49, "false_alarms": 0.02, "hidden": 0.9}
# In clutter, chosen on episodes of WalkerTracking-Hard's split "train": after how many frames he is searched for, in
# how many last ones at most, how often from then on, and log evidence by which whoever is found must then be better.
_LOOKS, _IN, _AGAIN, _BETTER = (3, 6, 12, 24), 36, 18, 10.0
_IN_CLUTTER = 0.15  # as _DISTANCES: passers-by are farther away, or nearer
_HIDDEN = BEHIND | {"hidden": 0.7}  # more takes many in plain view for somebody nearer whose legs are hidden
_FEW, _MIDDLE = 8, 1.0  # frames in which somebody else is searched for when one is given up; [m] a body's middle
_FAR = 0.65  # farthest log of a distance, relative to the world's origin's, at which somebody isn't something else


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


def followed(likelihood: Any) -> dict[str, float]:
    """Rates of a `likelihood` once somebody was found with it, in plain view or behind things."""
    rates = {"misses": 0.2, "false_alarms": 0.1}
    return rates if getattr(likelihood, "hidden", None) is None else rates | {"hidden": 0.5}


class ClutterTrack:
    """One episode of a walker in colours before a still camera and a background that nobody has seen.

    Until somebody is found, he is about the origin. Every now and then, the last pictures are seen anew by what is now
    known of the background, and whoever explains them best is followed: who was before, or whom a search finds with one
    of the `models`, of people in plain view and behind things. Who leaves the picture, or is believed far from where
    people walk, was a passer-by.
    """

    def __init__(self, tracker: ParticleFilter, models: list[SilhouetteLikelihood], rng: np.random.Generator) -> None:
        self.filter, self._models, self._rng = tracker, models, rng
        vars(models[-1]).update(_HIDDEN)
        self.belief: Belief | None = None
        self._history, self._found, self._settled = PixelHistory(), False, False
        self._recent: deque[tuple[np.ndarray, Belief]] = deque(maxlen=_IN)
        tracker.start(anywhere(0.0, 0.0))

    def step(self, observation: dict[str, np.ndarray]) -> Belief:
        rgb = observation["rgb"]
        mask = self._history.observe(rgb)
        self.belief = self.filter.step(mask=mask if self._found else np.full(mask.shape, 0.5))
        self._recent.append((rgb, self.belief))
        if self._history.frames in _LOOKS or self._history.frames % _AGAIN == 0:
            self._look(mask)
        if self._found and not self._plausible(self.belief):
            self._give_up()
            self._look(mask)
        return self.belief

    def _give_up(self) -> None:
        """Expect him somewhere about the origin again."""
        self._found = self._settled = False
        self._recent = deque(list(self._recent)[-_FEW:], maxlen=_IN)
        rgb, _ = self._recent[-1]
        self.filter.start(anywhere(0.0, 0.0), self.filter.beliefs[:-1])
        self.belief = self.filter.step(mask=np.full(rgb.shape[:2], 0.5))
        self._recent[-1] = rgb, self.belief

    def _look(self, mask: np.ndarray) -> None:
        """Follow whoever explains the last pictures best, the last one by its foreground `mask` (height, width)."""
        pictures, beliefs = map(list, zip(*self._recent, strict=True))
        frames = [{"mask": self._history.foreground(rgb)} for rgb in pictures[:-1]] + [{"mask": mask}]
        kept = self.filter.beliefs[: -len(frames)] if self._history.frames > len(frames) else None
        least = -np.inf
        if self._found:
            old = copy(self.filter)
            old.resume(beliefs[0])
            old.beliefs = self.filter.beliefs[: 1 - len(frames)]
            beliefs = [beliefs[0], *(old.step(**frame) for frame in frames[1:])]
            least = _evidence(beliefs) + (_BETTER if self._settled else 0.0)
            self.filter = old
        for model in [self.filter.likelihood] if self._settled else self._models:
            seen, new = cast(ImageLikelihood, copy(model)), copy(self.filter)
            vars(seen).update(_HIDDEN if self._settled else {})
            if start := find(seen, frames, new.prior, None, self._rng, _IN_CLUTTER):
                new.likelihood = deepcopy(model)
                new.start(start, kept)
                anew = [new.step(**frame) for frame in frames]
                if (evidence := _evidence(anew)) > least and self._plausible(anew[-1]):
                    self.filter, beliefs, least, self._found = new, anew, evidence, True
        self.belief = beliefs[-1]
        self._recent = deque(zip(pictures, beliefs, strict=True), maxlen=_IN)
        if self._found and not self._settled and len(frames) == _IN:
            self._settled = True
            vars(self.filter.likelihood).update(followed(self.filter.likelihood))

    def _plausible(self, belief: Belief) -> bool:
        camera, centre = self._models[0].camera, self._models[0].camera.centre[:2]
        pixels, depths = camera.project(np.array([[*belief.mean[:2], _MIDDLE]]))
        away, usual = np.log(np.maximum(np.linalg.norm([belief.mean[:2] - centre, centre], axis=1), 0.1))
        return bool(depths[0] > 0 and 0 <= pixels[0, 0] + 0.5 < camera.width and abs(away - usual) < _FAR)


def _evidence(beliefs: list[Belief]) -> float:
    """Log evidence of all frames but the first, in which a search chose who is believed."""
    return sum(belief.log_evidence for belief in beliefs[1:])
