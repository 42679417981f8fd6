"""Policies of ActiveTracking: they share the estimator `Beliefs`, and differ in where they look."""

import numpy as np

from benchmarks.envs.active.beliefs import Beliefs
from benchmarks.envs.active.planner_kernel import STEP, best_goals, towards
from motionenv.envs.active.scene_kernel import NARROW, WIDE

PARTICLES = 128  # of each person


class Policy:
    """An agent that estimates with `Beliefs` and looks by `commands`; by default it never moves the camera.

    Args:
        env: ActiveTracking, single or vector.
        seed: of particles and of whatever else is random.
        particles: per person.
    """

    def __init__(self, env, seed: int = 0, particles: int = PARTICLES):
        self.beliefs, self.scene = Beliefs(env, particles, seed), env.unwrapped.world.scene
        self.rng = np.random.default_rng(seed)

    def reset(self, observation, began=None) -> None:
        """Forget ended episodes."""
        self.beliefs.reset(observation, began)

    def act(self, observation) -> np.ndarray:
        """Estimate, and look."""
        self.beliefs.update(observation)
        return self.beliefs.action(self.commands(self.beliefs.batched(observation)))

    def commands(self, seen: dict[str, np.ndarray]) -> np.ndarray:
        """Rates (n, 3) of pan, tilt and zoom from -1 to 1, given an observation with a leading axis."""
        return np.zeros((len(seen["camera"]), 3))


class Random(Policy):
    """Random rates, drawn anew every half second."""

    def commands(self, seen: dict[str, np.ndarray]) -> np.ndarray:
        """As `Policy.commands`."""
        if not hasattr(self, "_kept") or self.rng.random() < 2 / self.scene.fps:
            self._kept = self.rng.uniform(-1, 1, (len(seen["camera"]), 3))
        return self._kept


class Sweep(Policy):
    """Turns at a constant rate, with the widest view."""

    rate = 0.8

    def commands(self, seen: dict[str, np.ndarray]) -> np.ndarray:
        """As `Policy.commands`."""
        return np.tile([self.rate, 0.0, 0.0], (len(seen["camera"]), 1))


class Greedy(Policy):
    """Centres the most uncertain person, where the belief is now, with a view as wide as the belief.

    A belief wider than `lost` [m] has no place to look at: then it turns at the rate of `Sweep`.
    """

    wide, lost = 2.5, 6.0  # standard deviations in half the image

    def commands(self, seen: dict[str, np.ndarray]) -> np.ndarray:
        """As `Policy.commands`."""
        beliefs, commands = self.beliefs, np.zeros((len(seen["camera"]), 3))
        for e, k in enumerate(beliefs.sigmas.argmax(axis=-1)):
            x, y = beliefs.particles[e, k, :, :2].mean(axis=0)
            half = self.wide * beliefs.sigmas[e, k] / max(np.hypot(x, y), 1.0)
            zoom = np.clip(np.log(half / WIDE) / np.log(NARROW), 0, 1)
            towards(seen["camera"][e], x, y, zoom, 1 / self.scene.fps, commands[e])
            if beliefs.sigmas[e, k] > self.lost:
                commands[e] = Sweep.rate, 0.0, -1.0
        return commands


class Planner(Policy):
    """Looks ahead: the plan of two goals, one after the other, that keeps the expected error of all beliefs least.

    Goals are people, single particles of them, and directions. The lookahead knows how the camera turns and where
    pillars hide people; it takes them to walk straight on. It plans anew every `STEP`.
    """

    seconds, particles, breadth, zooms = 3.0, 12, 6, (0.0, 0.5)

    def __init__(self, env, seed: int = 0, particles: int = PARTICLES):
        super().__init__(env, seed, particles)
        self.kept, self.age = np.zeros((env.unwrapped.world.n, 3)), 0

    def commands(self, seen: dict[str, np.ndarray]) -> np.ndarray:
        """As `Policy.commands`."""
        self.age += 1
        if (self.age - 1) % max(round(STEP * self.scene.fps), 1):
            return self.kept
        beliefs, n = self.beliefs, self.beliefs.particles.shape[2]
        some = beliefs.particles[:, :, self.rng.choice(n, self.particles, replace=False)]
        goals = [(k, i, z) for k in range(self.scene.people) for i in (-1, 0, 1, 2) for z in self.zooms]
        goals += [(-1, way, 0.0) for way in np.linspace(-np.pi, np.pi, 8, endpoint=False)]
        best_goals(seen["camera"], seen["pillars"], some, beliefs.sigmas, np.array(goals), round(self.seconds / STEP),
                   self.breadth, self.scene.noise, self.scene.dropout, self.kept, STEP)  # fmt: skip
        return self.kept


class Myopic(Planner):
    """The planner with a lookahead of half a second: what can be seen at once."""

    seconds = 0.6


#: By name.
POLICIES = {"still": Policy, "random": Random, "sweep": Sweep, "greedy": Greedy, "myopic": Myopic, "planner": Planner}
