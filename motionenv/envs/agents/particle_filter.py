"""A particle filter that plays the tracking environments of pictures."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from copy import copy, deepcopy
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.validation import random_generator
from motionenv.body.arm_reaching import RIGHT_ARM
from motionenv.envs.agents.action_adapter import Actions
from motionenv.envs.agents.searching import BEHIND, CLEAR, STATURES, ClutterTrack, anywhere, find, followed, size_of
from motionenv.envs.base import Observation
from motionenv.errors import MotionError
from motionenv.likelihoods.background import cluttered
from motionenv.likelihoods.base import ImageLikelihood, Likelihood, apparent
from motionenv.likelihoods.silhouette import SilhouetteLikelihood
from motionenv.models.people import usual_adult
from motionenv.models.registry import load
from motionenv.models.walking.model import WalkingModel
from motionenv.tracking.particle_filter import Belief, ParticleFilter, check_filter
from motionenv.tracking.priors.base import Prior, Start, systematic
from motionenv.tracking.priors.fpca import FPCAPrior
from motionenv.types import Camera, Skeleton

_AHEAD = 5.0  # [m] from the camera, where somebody is expected who isn't in the picture yet
_LOOKS = 1, 4, 12, 36  # numbers of frames after which the automatic start is made again, from all of them
# Somebody lost for so long is searched for, and so long after again [s]; and how far away [m] if the start was given.
_PATIENCE, _AFRESH, _NEAR = 0.5, 0.25, 2.5
# Who is followed is searched for every so many frames, in so many last ones, if he explains less than this share of
# what a body that fits would, and followed from there if that is better by so much log evidence (chosen on "train").
_AGAIN, _REVIEWED, _FITS, _BETTER = 18, 24, 0.82, 10.0


def truth_start(env: Any, slot: int) -> Start:
    """The first pose from the truth of the unwrapped `env`, for benchmarks whose trackers are given the start.

    `slot` is which of a vector's episodes; 0 of a single one.
    """
    truths = env.truth()
    return Start.at((truths[slot] if isinstance(truths, list) else truths)["pose"])


def adults_prior(fps: float, *, sized: bool = True) -> FPCAPrior:
    """The default prior at `fps` [Hz]: an adult of mean proportions and build, of unknown size if `sized`."""
    model = cast(WalkingModel, load("walk/fpca"))
    return FPCAPrior(model, skeleton=usual_adult(model.proportions_), fps=fps, size=STATURES if sized else 0.0)


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
            and when masks are explained badly, in case the wrong motion was followed. In cluttered colours before a
            still camera, the search begins with the third picture; until he is found, he is about the origin.
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
        self._tracks: list[_Track | ClutterTrack | None] = [None] * self._actions.n

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
        seen = self._actions.batched(observation)
        for slot in np.flatnonzero(began).tolist():
            self._tracks[slot] = self._begun(slot, {name: pictures[slot] for name, pictures in seen.items()})

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

    def _begun(self, slot: int, seen: dict[str, np.ndarray]) -> _Track | ClutterTrack:
        env = self._actions.env
        known = env.world.observation_model(slot)
        prior: Prior = self._prior(env, slot) if callable(self._prior) else self._prior
        if prior.fps != env.world.fps:
            raise MotionError(f"the prior has {prior.fps:g} fps, the environment {env.world.fps:g}: give both the same")
        if self._likelihood is None:
            models: list[Likelihood] = [
                SilhouetteLikelihood(known.camera, prior.skeleton, still=known.still, threads=self._threads, **rates)
                for rates in ((CLEAR, BEHIND) if self._start is None else ({},))
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
        searched = walks and start is None and self._likelihood is None and likelihood.accepted(seen) == ["rgb"]
        if searched and known.still and isinstance(likelihood, SilhouetteLikelihood) and cluttered(seen["rgb"]):
            return ClutterTrack(track, cast(list[SilhouetteLikelihood], models), rng)
        return _Track(track, start, walks, rng, models)


class _Track:
    """One episode: a filter, and its first pose; None searches for it, with the generator `rng`.

    A walker who is lost is searched for, too. `models` are the likelihoods of which the one that explains the first
    frames best is kept.
    """

    def __init__(self, tracker: ParticleFilter, start: Start | None, walks: bool, rng, models: list[Likelihood]):
        self.filter, self._models, self._rng, self._walks, self._given = tracker, models, rng, walks, start is not None
        self.belief: Belief | None = None
        self._waiting, self._steps, self._lost = start is None, 0, 0  # whether the start may still become better
        self._recent: deque[tuple[dict[str, np.ndarray], Belief | None]] = deque(maxlen=_LOOKS[-1])
        if start is not None:
            tracker.start(start)

    def step(self, observation: dict[str, np.ndarray]) -> Belief:
        if self.belief is not None or not self._waiting:
            self.belief = self.filter.step(**observation)
            self._lost = self._lost + 1 if self.belief.lost else 0
        self._recent.append((observation, self.belief))
        self._steps += 1
        fps, seen = self.filter.prior.fps, len(self._recent)
        if self._waiting and seen in _LOOKS:
            found = self._search(seen, self._models, None)
            if seen == _LOOKS[-1]:
                self._waiting = False
                self._recent.clear()  # evidences of other rates can't be compared
                self._rate(self.filter.likelihood, followed(self.filter.likelihood))
            elif seen == 1 and not found:
                self._recent.clear()  # nobody has come into view: the next picture is the first one
        elif self._walks and self._lost >= _PATIENCE * fps:
            self._lost = int((_PATIENCE - _AFRESH) * fps)
            self._search(1, [self.filter.likelihood], self.belief)
        elif self._walks and not self._waiting and self._steps % _AGAIN == 0 and self._falls_short():
            self._search(_REVIEWED, [self.filter.likelihood], self._recent[-min(seen, _REVIEWED)][1], _BETTER)
        assert self.belief is not None
        return self.belief

    def _falls_short(self) -> bool:
        """Whether the last masks show him, and the figures in some explain them worse than one that fits."""
        model, most, explained = copy(self.filter.likelihood), 0.0, 0.0
        recent = [(observation, cast(Belief, belief)) for observation, belief in self._recent][-_REVIEWED:]
        seen = 2 * sum(belief.lost for _, belief in recent) <= len(recent)
        if not seen or not isinstance(model, SilhouetteLikelihood) or "mask" not in recent[-1][0]:
            return False
        for observation, belief in recent[:: -_REVIEWED // 4]:
            model.observe(mask=observation["mask"])
            odds, nobody = model.odds()
            most += model.temper * np.maximum(odds, 0.0).sum()
            figure = apparent(belief.mean[None], size_of(belief), model.camera)
            explained += max(float(model.log_likelihood(figure)[0]) - model.temper * nobody, 0.0)
        return explained < _FITS * most

    def _search(self, count: int, models: list[Likelihood], near: Belief | None, better: float = 0.0) -> bool:
        """Follow whom a search in the last `count` frames finds, if that explains them better by so much log evidence.

        Each of `models` searches and follows. People are expected near who they were believed to be, if that is given.
        Returns whether anybody was found.
        """
        frames, beliefs = zip(*list(self._recent)[-count:], strict=True)
        # Who was followed without having been found doesn't compete.
        least = sum(belief.log_evidence for belief in beliefs) + better if count > 1 else -np.inf
        before, found, camera = self.filter, False, cast(Camera, self.filter.likelihood.camera)
        ahead = camera.centre[:2] + _AHEAD * camera.R[2, :2]
        for model in models:
            start = self._found(model, frames, near)
            found |= start is not None
            if start is None and (near is not None or len(frames) > 1):
                continue
            tried = copy(before)
            tried.likelihood = deepcopy(model)
            tried.start(start or anywhere(*ahead), None if near is None else before.beliefs[: -len(frames)])
            anew = [tried.step(**frame) for frame in frames]
            evidence = sum(belief.log_evidence for belief in anew)
            if evidence >= least:
                self.filter, self.belief, least = tried, anew[-1], evidence
                for _ in frames:
                    self._recent.pop()
                self._recent.extend(zip(frames, anew, strict=True))
        return found

    def _found(self, model: Likelihood, frames: Sequence[Mapping[str, Any]], near: Belief | None) -> Start | None:
        """A start from `frames`; None where they don't show enough, or one shows somebody far from who was given."""
        seen = cast(ImageLikelihood, model if near is None else self._rate(copy(model), BEHIND))
        if near is None or not self._given or len(frames) > 1:
            return find(seen, frames, self.filter.prior, near, self._rng)
        # Whoever is seen best, wherever that is, must be near: a head above a bush looks like somebody far away.
        start = find(seen, frames, self.filter.prior, None, self._rng, np.inf)
        return start if start and np.median(np.hypot(*(start.poses - near.mean)[:, :2].T)) < _NEAR else None

    def _rate(self, likelihood: Likelihood, rates: dict[str, float]) -> Likelihood:
        """Give `rates` to a `likelihood`, unless it is the user's."""
        for name, rate in rates.items() if len(self._models) > 1 else ():
            setattr(likelihood, name, rate)
        return likelihood


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
