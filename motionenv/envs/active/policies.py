"""Agents of ActiveTracking: `Still`, `Sweep`, `Greedy` and `Planner` share an estimator, and differ in where they look.

    >>> import gymnasium, motionenv.envs
    >>> from motionenv.envs.active import Planner
    >>> from motionenv.envs.agents import evaluate
    >>> env = gymnasium.make("motionenv/ActiveTracking-v1", horizon=20)
    >>> error = evaluate(env, Planner(env), episodes=1, seed=0).errors.mean()  # [m] per person

`Oracle` knows where everybody is. To write another one, subclass `Still` and override `aims`. Settings were chosen on
split "train".
"""

from typing import Any

import numpy as np

from motionenv._core.validation import checked_whole
from motionenv.envs.active.beliefs import Beliefs
from motionenv.envs.active.planner_kernel import LEVEL, look_at, plan, turn_to
from motionenv.envs.active.scene_kernel import MAST, NARROW, WIDE
from motionenv.envs.active.tracking import ActiveWorld
from motionenv.envs.base import Observation
from motionenv.errors import MotionError

PARTICLES = 128  # of each person
_SURE = 0.05  # [m] standard deviation of the oracle's beliefs


class Oracle:
    """Says where everybody is, and never moves the camera.

    Args:
        env: ActiveTracking, single or vector.

    Raises:
        MotionError: another environment.
    """

    def __init__(self, env: Any) -> None:
        self._env = _checked(env)

    def reset(self, observation: Observation, began: np.ndarray | None = None) -> None:
        """Nothing to reset; see `motionenv.envs.agents.evaluation.Agent` for `observation` and `began`."""

    def act(self, observation: Observation) -> np.ndarray:
        """The true positions; `observation` is ignored."""
        truths = self._env.truth()
        places = [truth["positions"] for truth in (truths if isinstance(truths, list) else [truths])]
        rows = [np.insert(place, 2, _SURE, axis=-1).ravel() for place in places]
        said = np.insert(rows, [0, 0, 0], 0.0, axis=-1)
        return self._env.action(said if isinstance(truths, list) else said[0])


class Still:
    """Estimates with `Beliefs`, and never moves the camera.

    Args:
        env: ActiveTracking, single or vector.
        seed: of particles and of whatever else is random.
        particles: per person.

    Raises:
        MotionError: another environment, or less than 2 particles.
    """

    def __init__(self, env: Any, seed: int | None = 0, particles: int = PARTICLES) -> None:
        world = _checked(env).world
        self.beliefs, self.scene = Beliefs(env, checked_whole(particles, "particles", 2), seed), world.scene
        self._rng = np.random.default_rng(seed)
        self._age, self._first = np.zeros(world.n, np.intp), np.zeros(world.n)  # frames, and pan in the first one

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.beliefs!r})"

    def reset(self, observation: Observation, began: np.ndarray | None = None) -> None:
        """Forget ended episodes; see `motionenv.envs.agents.evaluation.Agent` for `observation` and `began`."""
        self.beliefs.reset(observation, began)
        slots = np.arange(len(self._age)) if began is None else np.flatnonzero(began)
        self._age[slots], self._first[slots] = 0, self.beliefs.batched(observation)["camera"][slots, 0]

    def act(self, observation: Observation) -> np.ndarray:
        """The beliefs about the frame just observed, and commands to the camera; `observation` is the environment's."""
        self.beliefs.update(observation)
        commands = self.commands(self.beliefs.batched(observation))
        self._age += 1
        return self.beliefs.action(commands)

    def commands(self, seen: dict[str, np.ndarray]) -> np.ndarray:
        """Rates (n, 3) of pan, tilt and zoom from -1 to 1 that turn the camera to `aims`; see there for `seen`."""
        commands = np.zeros((len(self._age), 3))
        turn_to(seen["camera"], self.aims(seen), 1 / self.scene.fps, commands)
        return commands

    def aims(self, seen: dict[str, np.ndarray]) -> np.ndarray:
        """Pan, tilt [rad] and zoom (n, 3) to turn to, given an observation `seen` with a leading axis."""
        return seen["camera"][:, :3]


class Sweep(Still):
    """Looks around in steps: the best open-loop policy that `benchmarks.envs.active.open_loop` found."""

    step, seconds, tilts, zoom = 0.45, 0.43, (-0.38, -0.45), 0.0  # of pan [rad], of a step, of every other step [rad]

    def aims(self, seen: dict[str, np.ndarray]) -> np.ndarray:
        """The next place; of what is `seen` nothing matters."""
        steps = np.floor(self._age / (self.scene.fps * self.seconds)).astype(int)
        zooms = np.full(len(steps), self.zoom)
        return np.stack([self._first + self.step * steps, np.array(self.tilts)[steps % 2], zooms], axis=-1)


class Greedy(Sweep):
    """Centres whom it knows least about, where the belief is now, with a view as wide as the belief.

    A belief wider than `lost` [m] has no place to look at: then it looks around as `Sweep` does.
    """

    wide, lost = 2.0, 2.0  # standard deviations in half the image, [m]

    def aims(self, seen: dict[str, np.ndarray]) -> np.ndarray:
        """Where the widest belief is; see `Still.aims` for `seen`."""
        rows, who = np.arange(len(self._age)), self.beliefs.sigmas.argmax(axis=-1)
        x, y = np.moveaxis(self.beliefs.particles[rows, who, :, :2].mean(axis=1), -1, 0)
        sigmas, far = self.beliefs.sigmas[rows, who], np.hypot(x, y)
        half = self.wide * sigmas / np.maximum(far, 1.0)
        zoom = np.clip(np.log(half / WIDE) / np.log(NARROW), 0, 1)
        aims = np.stack([np.arctan2(y, x), np.arctan2(LEVEL - MAST, far), zoom], axis=-1)
        return np.where((sigmas > self.lost)[:, None], super().aims(seen), aims)


class Planner(Still):
    """Looks ahead: next where the errors of all beliefs are expected to become least.

    Goals are people, single particles of them, and directions. Those with most expected error in view for the time that
    it takes to turn there are tried by a rollout (Bertsekas & Castañon 1999), in which each goal is followed by what is
    then most worthwhile. The rollout knows how the camera turns and blurs, and whom pillars hide; it takes people to
    walk straight on. A new goal is chosen once the last one has been seen, or after `patience` [s].
    `env`, `seed` and the number of `particles` are as of `Still`.
    """

    seconds, step = 3.2, 0.2  # of rollouts, and of their steps [s]
    drawn, some, ways, tilts = 64, 8, 20, (-0.36, -0.5)  # particles, goals among them, directions, tilts [rad]
    breadth, growth, dwell, patience = 14, 0.3, 0.2, 2.0  # goals tried, [m/s] of errors, [s] a look, [s]

    def __init__(self, env: Any, seed: int | None = 0, particles: int = PARTICLES) -> None:
        super().__init__(env, seed, particles)
        n = len(self._age)
        self._aims, self._looked, self._since = np.zeros((n, 3)), np.zeros(n), np.zeros(n)
        self.drawn, self._steps = min(self.drawn, particles), round(self.seconds / self.step)
        rows = [(k, i, 0.0) for k in range(self.scene.people) for i in (self.drawn, *range(min(self.some, self.drawn)))]
        rows += [(-1, w, t) for t in self.tilts for w in np.linspace(-np.pi, np.pi, self.ways, endpoint=False)]
        self._goals = np.array(rows, dtype=float)

    def aims(self, seen: dict[str, np.ndarray]) -> np.ndarray:
        """The goal of the plan; see `Still.aims` for `seen`."""
        cloud, dt = self.beliefs.particles, 1 / self.scene.fps
        look_at(seen["camera"], self._aims, self.scene.blur, dt, self._looked)
        self._since += dt
        over = (self._looked > self.dwell - dt / 4) | (self._since > self.patience - dt / 4)
        due = np.flatnonzero((self._age == 0) | over)
        some = cloud[:, :, self._rng.choice(cloud.shape[2], self.drawn, replace=False)]
        known = seen["camera"], seen["pillars"], some, self.beliefs.sigmas, self._goals, self.breadth
        plan(due, *known, self._steps, self.scene.sensor, self.growth, self.dwell, self.step, self._aims)
        self._looked[due] = self._since[due] = 0.0
        return self._aims


def _checked(env: Any) -> Any:
    """The unwrapped `env`, if it is ActiveTracking."""
    if not isinstance(getattr(env.unwrapped, "world", None), ActiveWorld):
        raise MotionError(f"env must be ActiveTracking, single or its own vector environment, got {env!r}")
    return env.unwrapped
