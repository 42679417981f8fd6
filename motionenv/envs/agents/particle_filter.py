"""A particle filter that plays the tracking environments of pictures."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from copy import copy, deepcopy
from functools import partial
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.validation import random_generator
from motionenv.body.arm_reaching import RIGHT_ARM
from motionenv.envs.agents.action_adapter import Actions
from motionenv.envs.agents.baselines import walking_poses
from motionenv.envs.base import Observation
from motionenv.errors import MotionError
from motionenv.likelihoods.base import ImageLikelihood, Likelihood
from motionenv.likelihoods.silhouette import SilhouetteLikelihood
from motionenv.models.people import usual_adult
from motionenv.models.registry import load
from motionenv.models.walking.model import WalkingModel
from motionenv.tracking.initialization import automatic_start
from motionenv.tracking.particle_filter import Belief, ParticleFilter, check_filter
from motionenv.tracking.priors.base import Prior, Start, systematic
from motionenv.tracking.priors.fpca import FPCAPrior
from motionenv.types import Camera, Skeleton

_SEARCHED = 4000  # hypotheses of an automatic start
_NEAR = 2.5  # [m] farthest from where they were lost that people are found again
_AHEAD = 5.0  # [m] from the camera, where somebody is expected who isn't in the picture yet
_ANYWHERE = np.concatenate([np.full(2, 2.0), np.zeros(3), [2.0], np.full(19, 0.1)])  # [m, rad] and his spread
_DISTANCES = 0.3  # standard deviation of the log of people's distances, relative to that of the world's origin
_STRAYED = 1.0  # [m] standard deviation of how far somebody strays from where he was lost
_MISTAKEN = -5.0  # log density, relative to the highest, at which somebody who was lost had been somewhere else
_CHILDREN = 0.15  # share of children of 6 to 17 years among people
_SIZE = 0.06  # standard deviation of the log of adults' statures
# Rates by which a start is chosen, and somebody who was lost is found: of who is in plain view, and of who walks behind
# things that nobody knows. Once found, people are followed with less certainty, behind things with _HIDDEN.
_CLEAR = {"misses": 0.1, "false_alarms": 0.02}
_BEHIND = {"misses": 0.49, "false_alarms": 0.02, "hidden": 0.9}
_FOLLOWED = {"misses": 0.2, "false_alarms": 0.1}
_HIDDEN = {"hidden": 0.5}
_LOOKS = 1, 4, 12, 36  # numbers of frames after which the automatic start is made again, from all of them
# Who is followed is searched for again after so many frames, in the last ones, and followed from there if that explains
# them by so much log evidence better: the search has seen what it is to explain. Chosen on split "train".
_AGAIN, _REVIEWED, _BETTER = 18, 24, 10.0


def truth_start(env: Any, slot: int) -> Start:
    """The first pose from the truth of the unwrapped `env`, for benchmarks whose trackers are given the start.

    `slot` is which of a vector's episodes; 0 of a single one.
    """
    truths = env.truth()
    return Start.at((truths[slot] if isinstance(truths, list) else truths)["pose"])


def adults_prior(fps: float, *, sized: bool = True) -> FPCAPrior:
    """The default prior at `fps` [Hz]: an adult of mean proportions and build, of unknown size if `sized`."""
    model = cast(WalkingModel, load("walk/fpca"))
    return FPCAPrior(model, skeleton=usual_adult(model.proportions_), fps=fps, size=_SIZE if sized else 0.0)


class TrackingAgent:
    """Plays a picture environment through `reset` and `act`: one particle filter for each episode that runs.

    It knows the spaces, the camera, and whether the camera stands still. Whatever else it is to know, the first pose
    or the body, is handed to it by the callables below; none of its own reads the truth, only `truth_start` does.

    Args:
        env: WalkerTracking, ArmTracking or a vector of them.
        prior: of motion, or a callable (unwrapped env, slot) that gives one as an episode begins; None is an
            `FPCAPrior` of an adult of unknown size, or of mean size where only depths are seen.
        n, resample, layers, hidden, keep: of the `ParticleFilter`; `keep` lets `smoothed` look back.
        likelihood: callable (camera, skeleton) that gives what scores the prior's bodies; None is an
            `SilhouetteLikelihood`.
        start: callable (unwrapped env, slot) that gives the first pose, such as `truth_start`; None searches pictures:
            in the first one, and better once 4, 12 and 36 have come. A walker is searched for in any case when lost,
            and every 18 frames, in case the wrong motion was followed.
        seed: int or Generator.
        threads: of the default likelihood; None is one per core. The same seed says the same with any number.

    Raises:
        MotionError: an environment of markers, no start or prior for an arm, or an option out of range.
    """

    def __init__(
        self, env: Any, prior: Prior | Callable[[Any, int], Prior] | None = None, n: int = 1000, *,
        likelihood: Callable[[Camera, Skeleton], Likelihood] | None = None,
        start: Callable[[Any, int], Start] | None = None, seed: int | np.random.Generator | None = None,
        threads: int | None = None, resample: float = 0.5, layers: int = 1, hidden: float = 0.02, keep: bool = False,
    ) -> None:  # fmt: skip
        self._actions = Actions(env)
        if self._actions.points or self._actions.names == ["joints"]:
            raise MotionError("TrackingAgent follows people in pictures: use WalkerTracking or ArmTracking with some")
        if self._actions.arm and start is None:
            raise MotionError("an arm's first pose can't be found: give a start like motionenv.envs.agents.truth_start")
        if self._actions.arm and prior is None:
            raise MotionError('walkers don\'t move as arms do: give prior, such as VelocityPrior(part="right_arm")')
        self._options: dict[str, Any] = {"n": n, "resample": resample, "layers": layers, "hidden": hidden}
        check_filter(**self._options)
        self._options["keep"] = keep
        # Depths alone tell where a body of any size is.
        sized = "depth" not in self._actions.names or "mask" in self._actions.names
        self._prior = adults_prior(self._actions.env.world.fps, sized=sized) if prior is None else prior
        self._likelihood, self._start, self._threads = likelihood, start, threads
        self._rng = random_generator(seed)
        self._tracks: list[_Track | None] = [None] * self._actions.n

    def __repr__(self) -> str:
        prior = "a prior for each episode" if callable(self._prior) else repr(self._prior)
        return f"TrackingAgent({prior}, n={self._options['n']})"

    @property
    def beliefs(self) -> list[Belief]:
        """What is believed of the frame estimated last, one belief per episode that runs at a time."""
        return [track.belief for track in self._tracks if track is not None and track.belief is not None]

    def smoothed(self, n: int = 200) -> list[list[Belief]]:
        """Beliefs about the frames of each episode that runs, since its first pose, given all of them.

        They are `n` equally weighted walkers each, see `ParticleFilter.smoothed`.

        Raises:
            MotionError: made without `keep`, or no frame yet.
        """
        return [track.filter.smoothed(n) for track in self._tracks if track is not None]

    def reset(self, observation: Observation, began: ArrayLike | None = None) -> None:
        """Start new filters; see `motionenv.envs.agents.evaluation.Agent` for `observation` and `began`.

        Raises:
            MotionError: a prior of another frame rate, or one that moves more than the arm where only that moves.
        """
        began = np.ones(self._actions.n, dtype=bool) if began is None else np.asarray(began, dtype=bool)
        for slot in np.flatnonzero(began).tolist():
            self._tracks[slot] = self._begun(slot)

    def act(self, observation: Observation) -> np.ndarray:
        """The estimate for the frame just observed: the expected joints or pose, or poses drawn from the belief.

        Args:
            observation: as the environment gives it.

        Raises:
            MotionError: not reset yet, or nobody in the picture from which to start.
        """
        seen = self._actions.batched(observation)
        poses = np.empty((self._actions.n, self._actions.samples, 25))
        joints = np.empty((self._actions.n, 1, 15, 3))
        for slot, track in enumerate(self._tracks):
            if track is None:
                raise MotionError("the agent has not begun: call reset(observation) first")
            names = track.filter.likelihood.accepted(seen)
            belief = track.step({name: _picture(name, seen[name][slot], self._actions.far) for name in names})
            poses[slot] = _said(belief, self._actions, self._rng)
            if self._actions.form == "joints":
                joints[slot, 0] = belief.expected_joints(track.filter.prior.skeleton)
        return self._actions.of(poses, joints)

    def _begun(self, slot: int) -> _Track:
        env = self._actions.env
        known = env.world.observation_model(slot)
        prior: Prior = self._prior(env, slot) if callable(self._prior) else self._prior
        if prior.fps != env.world.fps:
            raise MotionError(f"the prior has {prior.fps:g} fps, the environment {env.world.fps:g}: give both the same")
        if self._likelihood is None:
            models: list[Likelihood] = [
                SilhouetteLikelihood(known.camera, prior.skeleton, still=known.still, threads=self._threads, **rates)
                for rates in ((_CLEAR, _BEHIND) if self._start is None else ({},))
            ]
        else:
            models = [self._likelihood(known.camera, prior.skeleton)]
        likelihood = deepcopy(models[0])
        start = None if self._start is None else self._start(env, slot)
        if self._actions.arm and start is not None:
            _check_moves_an_arm(prior, start)
        rng = self._rng.spawn(1)[0]
        track = ParticleFilter(prior, likelihood, seed=rng, **self._options)
        if start is None and not isinstance(likelihood, ImageLikelihood):
            raise MotionError(f"{likelihood!r} shows no foreground in which to find the first pose: give start")
        walks = not self._actions.arm and isinstance(likelihood, ImageLikelihood)
        return _Track(track, start, walks, rng, models)


class _Track:
    """One episode: a filter, and its first pose; None searches for it, with the generator `rng`.

    A walker who is lost is searched for, too. `models` are the likelihoods of which the one that explains the first
    frames best is kept.
    """

    def __init__(self, tracker: ParticleFilter, start: Start | None, walks: bool, rng, models: list[Likelihood]):
        self.filter, self._models, self._rng, self._given = tracker, models, rng, start is not None
        self.belief: Belief | None = None
        self._waiting: list[dict[str, np.ndarray]] | None = [] if start is None else None
        self._evidence, self._walks, self._steps = 0.0, walks, 0
        self._recent: deque[tuple[dict[str, np.ndarray], Belief]] = deque(maxlen=_REVIEWED)
        if start is not None:
            tracker.start(start)
        if walks:
            tracker.restart = self._found

    def step(self, observation: dict[str, np.ndarray]) -> Belief:
        if self._waiting is not None:
            return self._wait(observation)
        self.belief = self.filter.step(**observation)
        self._recent.append((observation, self.belief))
        self._steps += 1
        if self._walks and self._steps % _AGAIN == 0 and "rgb" not in observation:  # its background is still learned
            self._review()
        return self.belief

    def _wait(self, observation: dict[str, np.ndarray]) -> Belief:
        """As `step`, while the start may still become better."""
        assert self._waiting is not None
        self._waiting.append(observation)
        seen = len(self._waiting)
        if self.belief is not None:
            self.belief = self.filter.step(**observation)
            self._evidence += self.belief.log_evidence
        if seen in _LOOKS:
            self._look(list(self._waiting))
        if seen == _LOOKS[-1]:
            self._waiting = None
            behind = getattr(self.filter.likelihood, "hidden", None) is not None
            self._rate(self.filter.likelihood, _FOLLOWED | _HIDDEN if behind else _FOLLOWED)
        assert self.belief is not None
        return self.belief

    def _look(self, frames: Sequence[dict[str, np.ndarray]]) -> None:
        """Follow from the first of the `frames` on, now knowing more, unless what was followed explains them better."""
        for model in self._models:
            if (start := self._first(model, frames)) is not None:
                tried, beliefs, evidence = self._tried(model, start, frames)
                if self.belief is None or evidence >= self._evidence:
                    self.filter, self.belief, self._evidence = tried, beliefs[-1], evidence

    def _tried(self, model: Likelihood, start: Start, frames: Sequence[dict[str, np.ndarray]], before=()):
        """A filter that has followed the `frames` from a `start`, its beliefs, and the frames' log evidence."""
        tried = copy(self.filter)
        tried.likelihood = deepcopy(model)
        tried.start(start)
        tried.beliefs = [*before]
        beliefs = [tried.step(**frame) for frame in frames]
        return tried, beliefs, sum(belief.log_evidence for belief in beliefs)

    def _review(self) -> None:
        """Follow whom a search in the last frames finds, if that explains them much better."""
        frames, beliefs = zip(*self._recent, strict=True)
        if 2 * sum(belief.lost for belief in beliefs) > len(beliefs):
            return
        try:
            start = self._searched(self._rate(copy(self.filter.likelihood), _BEHIND), frames, beliefs[0])
        except MotionError:
            return
        before = self.filter.beliefs[: -len(frames)]
        tried, anew, evidence = self._tried(self.filter.likelihood, start, frames, before)
        if evidence > sum(belief.log_evidence for belief in beliefs) + _BETTER:
            self.filter, self.belief = tried, anew[-1]
            self._recent = deque(zip(frames, anew, strict=True), maxlen=_REVIEWED)

    def _first(self, model: Likelihood, frames: Sequence[dict[str, np.ndarray]]) -> Start | None:
        """A start from `frames`; None where they show less than before.

        While nobody has come into view, he may be anywhere before the camera, and the next picture is the first one.
        """
        try:
            return self._searched(model, frames, None)
        except MotionError:
            if len(frames) > 1:
                return None
        self._waiting, self._evidence = [], -np.inf
        camera = cast(ImageLikelihood, model).camera
        pose = walking_poses(1)[0].copy()
        pose[:2] = camera.centre[:2] + _AHEAD * camera.R[2, :2]
        return Start.at(pose, spread=_ANYWHERE)

    def _searched(self, model: Likelihood, observations: Sequence[Mapping[str, Any]], lost: Belief | None) -> Start:
        prior, seen = self.filter.prior, cast(ImageLikelihood, model)
        place = None if self._given and lost is None else partial(_log_place, seen.camera, lost)
        return automatic_start(
            seen, observations, fps=prior.fps, n=_SEARCHED, size=prior.size, children=_CHILDREN, place=place,
            seed=self._rng,
        )  # fmt: skip

    def _rate(self, likelihood: Likelihood, rates: dict[str, float]) -> Likelihood:
        """Give `rates` to a `likelihood`, unless it is the user's."""
        for name, rate in rates.items() if len(self._models) > 1 else ():
            setattr(likelihood, name, rate)
        return likelihood

    def _found(self, observation: Mapping[str, Any]) -> Start | None:
        """A new start from one picture, or None where it shows nobody, or nobody near one whose start was given."""
        lost = None if self._given or self._waiting is not None else self.belief
        try:
            found = self._searched(self._rate(copy(self.filter.likelihood), _BEHIND), [observation], lost)
        except MotionError:
            return None
        if not self._given or self.belief is None:
            return found
        # A head above a bush looks like somebody far away.
        away = np.hypot(*(found.poses - self.belief.mean)[:, :2].T)
        return found if np.median(away) < _NEAR else None


def _log_place(camera: Camera, lost: Belief | None, places: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Log density (n,) of places (n, 2) [m] and `sizes` (n,).

    People are about as far away as the world's origin, and near one who was lost, whose size they have.
    """
    centre = camera.centre
    away = np.log(np.maximum(np.hypot(*(places - centre[:2]).T), 0.1) / np.linalg.norm(centre))
    usual = -0.5 * (away / _DISTANCES) ** 2
    if lost is None:
        return usual
    weights, where = np.exp(lost.log_weights), lost.poses[:, :2]
    spread = np.sqrt(_STRAYED**2 + weights @ ((where - lost.mean[:2]) ** 2).sum(axis=1) / 2)
    apart = np.hypot(*(places - lost.mean[:2]).T) / spread
    grown = 0.0 if lost.state.sizes is None else np.log(sizes) - weights @ np.log(lost.state.sizes)
    return usual + np.logaddexp(-0.5 * (apart**2 + (grown / _SIZE) ** 2), _MISTAKEN)


def _check_moves_an_arm(prior: Prior, start: Start) -> None:
    """Make sure that a prior moves the right arm and nothing else, as the body of an arm's pictures stands still."""
    rng = np.random.default_rng(0)
    before = prior.initial(start, 2, rng)
    moved = (prior.propagate(before, rng).poses != before.poses).any(axis=0)
    if not set(np.flatnonzero(moved)) <= set(RIGHT_ARM):
        told = 'only the right arm moves in these pictures: take VelocityPrior(part="right_arm"), or a TreePrior of it'
        raise MotionError(f"{type(prior).__name__} moves more, while {told}")


def _picture(name: str, picture: np.ndarray, far: float) -> np.ndarray:
    if name == "rgb":
        return picture
    return np.where(picture < far, picture, np.inf)[..., 0] if name == "depth" else picture[..., 0]


def _said(belief: Belief, actions: Actions, rng: np.random.Generator) -> np.ndarray:
    """Poses (samples, 25), angles within half a turn: the mean, or drawn by weight where a belief is asked for."""
    if actions.form == "belief":
        poses = belief.poses[systematic(np.exp(belief.log_weights), actions.samples, rng)]
    else:
        poses = belief.mean[None].copy()
    poses[:, 3:] = np.remainder(poses[:, 3:] + np.pi, 2 * np.pi) - np.pi
    return poses
