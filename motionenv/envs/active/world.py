"""The world of motionenv/ActiveTracking-v0: people on a square, and a camera in their midst that the agent turns."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from gymnasium import spaces
from scipy.ndimage import gaussian_filter1d
from scipy.special import i0e, i1e

from motionenv._core.validation import checked_number, checked_whole
from motionenv.envs.active.pictures import camera_of, draw
from motionenv.envs.active.scene_kernel import INNER, OUTER, look, steer_all, wander
from motionenv.envs.simulation.motion_sources import SPLITS
from motionenv.errors import MotionError
from motionenv.models.eigenwalkers.batch import WalkerBatch, draw_walkers
from motionenv.models.registry import load
from motionenv.types import FPS_RANGE, MARKERS

#: Positions in actions are in units of this length [m].
REACH = 15.0
#: Fourier walkers per split.
WALKERS = 4096

_LEAST, _MOST = 0.05, 10.0  # [m] standard deviations of beliefs
_LIMITS = {
    "people": (1, 8), "pillars": (0, 24), "noise": (0.001, 0.2), "colour_noise": (0.01, 10), "dropout": (0, 0.9),
    "turn_seconds": (0.5, 1000), "effort": (0, 10), "fps": FPS_RANGE, "horizon": (1, 100_000),
}  # fmt: skip
_SMOOTH = 0.25  # [s] of a turn
_RADII = (0.4, 1.0)  # [m] of pillars
_APART = 0.25  # variation of hues, relative to their distance
_TILT = -0.4  # [rad] of the camera at the start


@dataclass(frozen=True)
class Scene:
    """Settings of the task; `motionenv.envs.active.ActiveTracking` describes them."""

    people: int = 4
    pillars: int = 8
    noise: float = 0.05
    colour_noise: float = 0.2
    dropout: float = 0.1
    turn_seconds: float = 6.0
    effort: float = 0.05
    fps: float = 10.0
    horizon: int = 200
    split: str = "train"

    def __post_init__(self):
        for name, limits in _LIMITS.items():
            checked = checked_whole if isinstance(getattr(Scene, name), int) else checked_number
            object.__setattr__(self, name, checked(getattr(self, name), name, *limits))
        if self.split not in SPLITS:
            raise MotionError(f"split must be one of {', '.join(SPLITS)}, got {self.split!r}")


class ActiveWorld:
    """A `motionenv.envs.World` of n squares.

    Args:
        n: number of episodes.
        scene: settings.
    """

    def __init__(self, n: int, scene: Scene):
        self.n, self.scene, self.horizon, self.fps = n, scene, scene.horizon, scene.fps
        k, p = scene.people, scene.pillars
        box = lambda high, *shape: spaces.Box(-high, high, shape, np.float32)
        self.observation_space = spaces.Dict(
            {
                "points": box(2.0, k, 15, 2),
                "seen": spaces.MultiBinary((k, 15)),
                "colours": box(1.0, k, 2),
                "camera": box(4.0, 6),
                "roster": box(3.0, k, 3),
                "pillars": box(REACH, p, 3),
                "time_left": spaces.Box(0.0, 1.0, (1,), np.float32),
            }
        )
        self.action_space = box(1.0, 3 + 3 * k)
        self.time = np.zeros(n, dtype=np.intp)
        self._bodies, self._which = walkers(scene.split), np.zeros((n, k), dtype=np.intp)
        self._hues, self._keys = np.zeros((n, k)), np.zeros(n, dtype=np.uint64)
        self._pillars = np.zeros((n, p, 3))
        self._walks = np.zeros((n, k, scene.horizon + 1, 4))
        self._cameras, self._commands = np.zeros((n, 6)), np.zeros((n, 3))
        self._points, self._colours = np.zeros((n, k, 15, 2), np.float32), np.zeros((n, k, 2), np.float32)
        self._seen = np.zeros((n, k, 15), np.int8)
        self._before = self._cameras, self._points, self._seen

    def begin(self, slots: np.ndarray, rngs: Sequence[np.random.Generator]) -> None:
        """As `World.begin`, for `slots` with their `rngs`."""
        scene, k = self.scene, self.scene.people
        self.time[slots] = 0
        for slot, rng in zip(slots, rngs, strict=True):
            keys = rng.integers(2**64, size=k + 1, dtype=np.uint64)
            self._keys[slot] = keys[k]
            self._pillars[slot] = _pillars(scene.pillars, rng)
            self._which[slot] = rng.integers(WALKERS, size=k)
            self._hues[slot] = 2 * np.pi / k * (rng.permutation(k) + rng.uniform(-_APART, _APART, k))
            self._cameras[slot] = rng.uniform(-np.pi, np.pi), _TILT, 0, 0, 0, 0
            walks = self._walks[slot]
            wander(keys[:k], self._pillars[slot], 1 / (scene.turn_seconds * scene.fps), 1 / scene.fps, walks)
            phases = 2 * np.pi * rng.random(k)
            self._walks[slot] = _walked(walks, phases, self._bodies.strides[self._which[slot]], scene.fps)
        self._look(slots)

    def observe(self, slots: np.ndarray) -> dict[str, np.ndarray]:
        """As `World.observe`, of `slots`."""
        heights, hues = self._bodies.heights[self._which[slots]], self._hues[slots]
        return {
            "points": self._points[slots],
            "seen": self._seen[slots],
            "colours": self._colours[slots],
            "camera": self._cameras[slots].astype(np.float32),
            "roster": np.stack([heights, np.cos(hues), np.sin(hues)], axis=-1).astype(np.float32),
            "pillars": self._pillars[slots].astype(np.float32),
            "time_left": (1.0 - self.time[slots, None] / self.horizon).astype(np.float32),
        }

    def judge(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """As `World.judge`, of `actions`; keeps the commands, which `advance` obeys."""
        self._commands[:] = actions[:, :3]
        means, sigmas = unpacked(actions)
        away = np.linalg.norm(means - self._walks[np.arange(self.n), :, self.time, :2], axis=-1)
        cost = self.scene.effort * np.square(self._commands).mean(axis=-1)
        return away.mean(axis=-1), -energy_score(away, sigmas).mean(axis=-1) - cost

    def advance(self, slots: np.ndarray) -> None:
        """As `World.advance`, for `slots`."""
        self._before = self._cameras.copy(), self._points.copy(), self._seen.copy()
        self.time[slots] += 1
        steer_all(slots, self._cameras, self._commands, 1 / self.fps)
        self._look(slots)

    def truth(self, slot: int) -> dict[str, Any]:
        """As `World.truth`, of `slot`."""
        places, joints = self._walks[slot, :, self.time[slot], :2].copy(), self._joints(np.array([slot]), self.time)[0]
        return {"positions": places, "joints": joints, "camera": camera_of(self._cameras[slot])}

    def render(self, slot: int, estimate: np.ndarray | None) -> np.ndarray:
        """As `World.render`, of `slot` with its `estimate`."""
        now = estimate is None
        cameras, points, seen = (self._cameras, self._points, self._seen) if now else self._before
        beliefs = None if now else [part[0] for part in unpacked(estimate[None])]
        time = self.time - (not now)
        walks, joints = self._walks[slot, :, time[slot]], self._joints(np.array([slot]), time)[0]
        shown = points[slot][seen[slot] > 0]
        return draw(cameras[slot], self._pillars[slot], walks, joints, self._hues[slot], shown, beliefs)

    def close(self) -> None:
        """Nothing to release."""

    def _joints(self, slots: np.ndarray, time: np.ndarray) -> np.ndarray:
        """True joints (k, people, 15, 3) [m] of `slots` in the frames `time` (n,)."""
        walks = self._walks[slots, :, time[slots]].reshape(-1, 4)
        body = self._bodies.positions(self._which[slots].ravel(), walks[:, 3], np.ones(len(walks)))
        c, s = np.cos(walks[:, 2, None]), np.sin(walks[:, 2, None])
        x, y = walks[:, :1] + c * body[..., 0] - s * body[..., 1], walks[:, 1:2] + s * body[..., 0] + c * body[..., 1]
        return np.stack([x, y, body[..., 2]], axis=-1).reshape(len(slots), self.scene.people, len(MARKERS), 3)

    def _look(self, slots: np.ndarray) -> None:
        """Observe the current frames."""
        noise = self.scene.noise, self.scene.colour_noise, self.scene.dropout
        drawn = self._keys, self.time, self._cameras, self._pillars, self._joints(slots, self.time), self._hues
        look(slots, *drawn, noise, self._points, self._seen, self._colours)


def packed(commands, means, sigmas) -> np.ndarray:
    """Actions (n, 3 + 3 people), float32, clipped to the action space.

    Args:
        commands: (n, 3) rates of pan, tilt and zoom, from -1 to 1.
        means: (n, people, 2) [m] believed positions.
        sigmas: (n, people) [m] standard deviations of each coordinate.
    """
    scales = 2 * np.log(np.maximum(sigmas, _LEAST) / _LEAST) / np.log(_MOST / _LEAST) - 1
    people = np.concatenate([means / REACH, scales[..., None]], axis=-1)
    return np.clip(np.concatenate([commands, people.reshape(len(people), -1)], axis=-1), -1, 1).astype(np.float32)


def unpacked(actions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Means (n, people, 2) and standard deviations (n, people) [m] of beliefs.

    Args:
        actions: (n, 3 + 3 people).
    """
    people = actions[:, 3:].reshape(len(actions), -1, 3)
    return REACH * people[..., :2], _LEAST * (_MOST / _LEAST) ** ((people[..., 2] + 1) / 2)


def energy_score(away: np.ndarray, sigmas: np.ndarray) -> np.ndarray:
    """Energy score [m] of the belief N(m, σ² I) about a position in the plane; proper (Gneiting & Raftery 2007).

    E|X - y| - E|X - X'| / 2, with E|X - y| = σ √(π/2) L½(-d² / 2σ²) (Rice 1945) and E|X - X'| = σ √π.

    Args:
        away: (...) distances d of the true positions from the means [m].
        sigmas: (...) standard deviations [m].
    """
    half = np.square(away / sigmas) / 4  # i0e and i1e carry the factor exp(-half) of L½(-2 half)
    rice = np.sqrt(np.pi / 2) * ((1 + 2 * half) * i0e(half) + 2 * half * i1e(half))
    return sigmas * (rice - np.sqrt(np.pi) / 2)


def _pillars(n: int, rng: np.random.Generator) -> np.ndarray:
    """Pillars (n, 3) of x, y and radius [m], anywhere that leaves a way around the camera and along the edge."""
    radii = rng.uniform(*_RADII, n)
    ways, far = rng.uniform(-np.pi, np.pi, n), np.sqrt(rng.uniform((INNER + 2) ** 2, (OUTER - 2) ** 2, n))
    return np.stack([far * np.cos(ways), far * np.sin(ways), radii], axis=-1)


def _walked(walks: np.ndarray, phases: np.ndarray, strides: np.ndarray, fps: float) -> np.ndarray:
    """Walks (people, frames, 4) with rounded turns: x, y [m], heading of the body and phase of its gait [rad].

    `phases` (people,) are those of the first frame, `strides` (people,) stride lengths [m].
    """
    path = gaussian_filter1d(walks[..., :2], _SMOOTH * fps, axis=1, mode="nearest")
    step = np.gradient(path, axis=1)
    gone = np.cumsum(np.linalg.norm(step, axis=-1), axis=1)
    turned = phases[:, None] + 2 * np.pi * gone / strides[:, None]
    return np.stack([path[..., 0], path[..., 1], np.arctan2(step[..., 1], step[..., 0]), turned], axis=-1)


@lru_cache(maxsize=2)
def walkers(split: str) -> WalkerBatch:
    """The Fourier walkers of a split, the same in every process.

    Args:
        split: "train" or "eval".
    """
    seed = np.random.SeedSequence(0, spawn_key=(SPLITS.index(split),))
    return draw_walkers(load("walk/eigenwalkers"), WALKERS, np.random.default_rng(seed))
