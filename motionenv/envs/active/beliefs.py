"""Where everybody is, given what the camera of ActiveTracking has seen: the estimator that its agents share."""

from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from motionenv.envs.active.filter_kernel import renew, scatter, share, weigh
from motionenv.envs.active.scene_kernel import OUTER
from motionenv.envs.base import Observation
from motionenv.envs.simulation.marker_world import fourier_walkers


class Beliefs:
    """Particle filters (Gordon et al. 1993), one per person, for one or many squares.

    Particles stroll as people do, among the same pillars. Who is who among detections is weighed by position and colour
    over all assignments (Bar-Shalom & Fortmann 1988). Where somebody should have been seen and wasn't, he or she is
    less probable.

    Args:
        env: ActiveTracking, single or vector.
        particles: per person.
        seed: of the particles.

    Attributes:
        particles: (n, people, particles, 4) x, y [m], heading [rad] and speed [m/s], predicted for the next frame.
        means: (n, people, 2) [m], positions in the last observed frame.
        sigmas: (n, people) [m], standard deviation of a coordinate.
        seen: (n, people) probability that a person was detected in the last observed frame.
    """

    def __init__(self, env: Any, particles: int = 256, seed: int | None = 0) -> None:
        self._vector, world = hasattr(env, "num_envs"), env.unwrapped.world
        self._env, self._scene, n, k, m = env.unwrapped, world.scene, world.n, world.scene.people, particles
        train = fourier_walkers("train")
        self._levels = (train.coefficients[:, 0, :, 2] / train.heights[:, None]).mean(axis=0)  # of the 15 markers
        self._rng, self._keys, self._time = np.random.default_rng(seed), np.zeros(n, np.uint64), np.zeros(n, np.intp)
        self.particles, self._widths = np.zeros((n, k, m, 4)), np.zeros((n, k))  # [m] of kernels about particles
        self.means, self.sigmas, self.seen = np.zeros((n, k, 2)), np.zeros((n, k)), np.zeros((n, k))

    def __repr__(self) -> str:
        return f"Beliefs({self._env!r}, particles={self.particles.shape[2]})"

    def reset(self, observation: Observation, began: ArrayLike | None = None) -> None:
        """Forget ended episodes: anybody may be anywhere. `observation` and `began` are as of `Still.reset`."""
        slots = np.arange(len(self._keys)) if began is None else np.flatnonzero(began)
        self._keys[slots], self._time[slots] = self._rng.integers(2**64, size=len(slots), dtype=np.uint64), 0
        self._widths[slots] = OUTER / 2 * self.particles.shape[2] ** (-1 / 6)
        scatter(slots, self._keys, self.batched(observation)["pillars"], self.particles)

    def update(self, observation: Observation) -> None:
        """Take account of an `observation` of the environment, once per frame."""
        seen = self.batched(observation)
        found = self._found(seen)
        n, k, m = self.particles.shape[:3]
        hues, heights = np.arctan2(seen["roster"][..., 2], seen["roster"][..., 1]), seen["roster"][..., 0].copy()
        weights, unseen, gains = np.zeros((n, k, k, 1 + m)), np.zeros((n, k, m)), np.zeros((n, k, k))
        shares, sums, noise = np.zeros((n, k, 1 + k)), np.zeros((n, k, 3)), self._scene.sensor
        given, cloud = (seen["camera"], seen["pillars"], heights), (self._widths, self.particles)
        weigh(*given, hues, found, noise, *cloud, weights, unseen, gains)
        share(gains, (found[..., 3] > 0).sum(axis=-1), shares)
        found_so = found, shares, weights, unseen, noise, self._scene.pace
        renew(self._keys, self._time, *given, *found_so, *cloud, sums)
        self._time += 1
        self.means, self.sigmas, self.seen = sums[..., :2], sums[..., 2], 1 - shares[..., 0]

    def action(self, commands: ArrayLike) -> np.ndarray:
        """The environment's action: the beliefs, and `commands` (n, 3), rates of pan, tilt and zoom from -1 to 1."""
        beliefs = np.concatenate([self.means, self.sigmas[..., None]], axis=-1)
        said = np.concatenate([np.reshape(commands, (-1, 3)), beliefs.reshape(len(beliefs), -1)], axis=-1)
        return self._env.action(said if self._vector else said[0])

    def batched(self, observation: Observation) -> dict[str, np.ndarray]:
        """An `observation` of the environment, single or vector, with a leading axis, float64."""
        rows = {name: np.asarray(value, np.float64) for name, value in cast(dict, observation).items()}
        return rows if self._vector else {name: value[None] for name, value in rows.items()}

    def _found(self, seen: dict[str, np.ndarray]) -> np.ndarray:
        """Detections (n, people, 5): u, v, relative height, number of points, hue."""
        count = seen["seen"].sum(axis=-1)
        weights = seen["seen"] / np.maximum(count, 1)[..., None]
        middle = (weights[..., None] * seen["points"]).sum(axis=-2)
        hue = np.arctan2(seen["colours"][..., 1], seen["colours"][..., 0])
        return np.concatenate([middle, np.stack([weights @ self._levels, count, hue], axis=-1)], axis=-1)
