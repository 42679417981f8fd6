"""motionenv/ActiveTracking-v1: several people on a plaza, tracked with a camera that the agent steers."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium import Space, spaces
from scipy.ndimage import gaussian_filter1d
from scipy.special import i0e, i1e

from motionenv._core.validation import checked_choice, checked_number, checked_whole
from motionenv.envs.active.pictures import camera_of, draw
from motionenv.envs.active.scene_kernel import INNER, OUTER, look, steer_all, wander
from motionenv.envs.base import Arguments, TrackingEnv, World, taking
from motionenv.envs.simulation.estimates import ActionScale
from motionenv.envs.simulation.marker_world import WALKERS, fourier_walkers
from motionenv.envs.simulation.motion_sources import SPLITS
from motionenv.envs.vector import TrackingVectorEnv, VectorArguments
from motionenv.types import FPS_RANGE, MARKERS

#: Positions in actions are in units of this length [m].
REACH = 15.0

_LEAST, _MOST = 0.05, 10.0  # [m] standard deviations of beliefs
_LIMITS = {
    "people": (1, 8), "pillars": (0, 24), "noise": (0.001, 0.2), "colour_noise": (0.01, 10), "dropout": (0, 0.9),
    "blur": (0, 10), "turn_seconds": (0.5, 1000), "effort": (0, 10), "fps": FPS_RANGE, "horizon": (1, 100_000),
}  # fmt: skip
_SMOOTH, _TILT = 0.25, -0.4  # [s] of a turn, [rad] of the camera at the start
_RADII, _APART = (0.4, 1.0), 0.25  # [m] of pillars, variation of hues relative to their distance


@dataclass(frozen=True, kw_only=True)
class ActiveArguments(Arguments):
    """Arguments of `motionenv.envs.active.ActiveTracking`, checked."""

    people: int = 3
    pillars: int = 8
    noise: float = 0.05
    colour_noise: float = 0.2
    dropout: float = 0.1
    blur: float = 1.0
    turn_seconds: float = 12.0
    effort: float = 0.05
    fps: float = 10.0
    horizon: int = 600
    split: str = "train"

    def __post_init__(self) -> None:
        for name, limits in _LIMITS.items():
            checked: Any = checked_whole if isinstance(getattr(ActiveArguments, name), int) else checked_number
            object.__setattr__(self, name, checked(getattr(self, name), name, *limits))
        checked_choice(self.split, "split", SPLITS)

    def __str__(self) -> str:
        return f"{self.people} people, {self.pillars} pillars"

    def world(self, n: int) -> "ActiveWorld":
        return ActiveWorld(n, self)

    @property
    def sensor(self) -> tuple[float, float, float, float]:
        """Noise of points and hues, share of people missed, and blur, as `scene_kernel.look` takes them."""
        return self.noise, self.colour_noise, self.dropout, self.blur

    @property
    def pace(self) -> tuple[float, float]:
        """Chance that a person turns in a frame, and the time of a frame [s]."""
        return 1 / (self.turn_seconds * self.fps), 1 / self.fps


class BeliefScale(ActionScale):
    """The map from actions, from -1 to 1, to commands and beliefs about `people`.

    x and y = 15 m · a, σ = 0.05 m · 200^((a + 1) / 2).
    """

    def __init__(self, people: int) -> None:
        self.space, self.reach = spaces.Box(-1.0, 1.0, (3 + 3 * people,), np.float32), REACH

    def estimates(self, actions: np.ndarray) -> np.ndarray:
        """The commands (..., 3), and x, y and σ [m] of each person, that `actions` (..., 3 + 3 people) say."""
        said = np.array(actions)
        said[..., 3::3], said[..., 4::3] = REACH * actions[..., 3::3], REACH * actions[..., 4::3]
        said[..., 5::3] = _LEAST * (_MOST / _LEAST) ** ((actions[..., 5::3] + 1) / 2)
        return said

    def actions(self, estimates: np.ndarray) -> np.ndarray:
        """The actions that say `estimates` (..., 3 + 3 people), float32; out of bounds goes to the bound."""
        said = np.array(estimates, dtype=np.float64)
        said[..., 3::3], said[..., 4::3] = said[..., 3::3] / REACH, said[..., 4::3] / REACH
        said[..., 5::3] = 2 * np.log(np.maximum(said[..., 5::3], _LEAST) / _LEAST) / np.log(_MOST / _LEAST) - 1
        return np.clip(said, -1, 1).astype(np.float32)


class ActiveWorld(World):
    """A `motionenv.envs.World` of n squares, each with the settings `scene`."""

    def __init__(self, n: int, scene: ActiveArguments) -> None:
        self.n, self.scene, self.horizon, self.fps = n, scene, scene.horizon, scene.fps
        k, p = scene.people, scene.pillars
        box = lambda high, *shape: spaces.Box(-high, high, shape, np.float32)
        self.observation_space: Space = spaces.Dict({
            "points": box(2.0, k, 15, 2), "seen": spaces.MultiBinary((k, 15)), "colours": box(1.0, k, 2),
            "camera": box(4.0, 6), "roster": box(3.0, k, 3), "pillars": box(REACH, p, 3),
            "time_left": spaces.Box(0.0, 1.0, (1,), np.float32),
        })  # fmt: skip
        self.scale: ActionScale = BeliefScale(k)
        self.action_space: spaces.Box = self.scale.space
        self.time = np.zeros(n, dtype=np.intp)
        self._bodies, self._which = fourier_walkers(scene.split), np.zeros((n, k), dtype=np.intp)
        self._hues, self._keys = np.zeros((n, k)), np.zeros(n, dtype=np.uint64)
        self._pillars, self._walks = np.zeros((n, p, 3)), np.zeros((n, k, scene.horizon + 1, 4))
        self._cameras, self._commands = np.zeros((n, 6)), np.zeros((n, 3))
        self._points, self._colours = np.zeros((n, k, 15, 2), np.float32), np.zeros((n, k, 2), np.float32)
        self._seen = np.zeros((n, k, 15), np.int8)
        self._shown: tuple[np.ndarray, ...] = self._cameras, self._points, self._seen
        self._before = tuple(np.copy(now) for now in self._shown)

    def begin(self, slots: np.ndarray, rngs: Sequence[np.random.Generator]) -> None:
        scene, k = self.scene, self.scene.people
        self.time[slots] = 0
        for slot, rng in zip(slots, rngs, strict=True):
            *keys, self._keys[slot] = rng.integers(2**64, size=k + 1, dtype=np.uint64)
            far = np.sqrt(rng.uniform((INNER + 2) ** 2, (OUTER - 2) ** 2, scene.pillars))  # there is a way around
            ways, radii = rng.uniform(-np.pi, np.pi, scene.pillars), rng.uniform(*_RADII, scene.pillars)
            self._pillars[slot] = np.stack([far * np.cos(ways), far * np.sin(ways), radii], axis=-1)
            self._which[slot] = rng.integers(WALKERS, size=k)
            self._hues[slot] = 2 * np.pi / k * (rng.permutation(k) + rng.uniform(-_APART, _APART, k))
            self._cameras[slot] = rng.uniform(-np.pi, np.pi), _TILT, 0, 0, 0, 0
            wander(np.array(keys), self._pillars[slot], *scene.pace, self._walks[slot])
            strides = self._bodies.strides[self._which[slot]]
            self._walks[slot] = _walked(self._walks[slot], 2 * np.pi * rng.random(k), strides, scene.fps)
        self._look(slots)

    def observe(self, slots: np.ndarray) -> dict[str, np.ndarray]:
        hues = self._hues[slots]
        roster = np.stack([self._bodies.heights[self._which[slots]], np.cos(hues), np.sin(hues)], axis=-1)
        left = 1.0 - self.time[slots, None] / self.horizon
        drawn = {"camera": self._cameras[slots], "roster": roster, "pillars": self._pillars[slots], "time_left": left}
        seen = {"points": self._points[slots], "seen": self._seen[slots], "colours": self._colours[slots]}
        return seen | {name: value.astype(np.float32) for name, value in drawn.items()}

    def judge(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        self._commands[:] = actions[:, :3]
        beliefs = _beliefs(self.scale.estimates(actions))
        away = np.linalg.norm(beliefs[..., :2] - self._walks[np.arange(self.n), :, self.time, :2], axis=-1)
        cost = self.scene.effort * np.square(self._commands).mean(axis=-1)
        return away.mean(axis=-1), -_energy_score(away, beliefs[..., 2]).mean(axis=-1) - cost

    def advance(self, slots: np.ndarray) -> None:
        for before, now in zip(self._before, self._shown, strict=True):
            before[slots] = now[slots]
        self.time[slots] += 1
        steer_all(slots, self._cameras, self._commands, 1 / self.fps)
        self._look(slots)

    def truth(self, slot: int) -> dict[str, Any]:
        places, joints = self._walks[slot, :, self.time[slot], :2].copy(), self._joints(np.array([slot]), self.time)[0]
        return {"positions": places, "joints": joints, "camera": camera_of(self._cameras[slot])}

    def render(self, slot: int, estimate: np.ndarray | None) -> np.ndarray:
        camera, points, seen = (part[slot] for part in (self._shown if estimate is None else self._before))
        beliefs = None if estimate is None else _beliefs(self.scale.estimates(estimate[None]))[0]
        time = self.time - (estimate is not None)
        walks, joints = self._walks[slot, :, time[slot]], self._joints(np.array([slot]), time)[0]
        return draw(camera, self._pillars[slot], walks, joints, self._hues[slot], points[seen > 0], beliefs)

    def _joints(self, slots: np.ndarray, time: np.ndarray) -> np.ndarray:
        """True joints (k, people, 15, 3) [m] of `slots` in the frames `time` (n,)."""
        walks = self._walks[slots, :, time[slots]].reshape(-1, 4)
        body = self._bodies.positions(self._which[slots].ravel(), walks[:, 3], np.ones(len(walks)))
        c, s = np.cos(walks[:, 2, None]), np.sin(walks[:, 2, None])
        x, y = walks[:, :1] + c * body[..., 0] - s * body[..., 1], walks[:, 1:2] + s * body[..., 0] + c * body[..., 1]
        return np.stack([x, y, body[..., 2]], axis=-1).reshape(len(slots), self.scene.people, len(MARKERS), 3)

    def _look(self, slots: np.ndarray) -> None:
        drawn = self._keys, self.time, self._cameras, self._pillars, self._joints(slots, self.time), self._hues
        look(slots, *drawn, self.scene.sensor, self._points, self._seen, self._colours)


def _beliefs(estimates: np.ndarray) -> np.ndarray:
    """Rows (n, people, 3) of x, y and σ [m] of estimates (n, 3 + 3 people)."""
    return estimates[:, 3:].reshape(len(estimates), -1, 3)


def _energy_score(away: np.ndarray, sigmas: np.ndarray) -> np.ndarray:
    """Energy score [m] of the belief N(m, σ² I) about a position in the plane, at a distance `away` [m] from m.

    It is E|X - y| - E|X - X'| / 2 and proper (Gneiting & Raftery 2007, eq. 22), with E|X - y| = σ √(π/2) L½(-d² / 2σ²),
    the mean of Rice's distribution, and E|X - X'| = σ √π.
    """
    half = np.square(away / sigmas) / 4  # i0e and i1e carry the factor exp(-half) of L½(-2 half)
    rice = np.sqrt(np.pi / 2) * ((1 + 2 * half) * i0e(half) + 2 * half * i1e(half))
    return sigmas * (rice - np.sqrt(np.pi) / 2)


def _walked(walks: np.ndarray, phases: np.ndarray, strides: np.ndarray, fps: float) -> np.ndarray:
    """Walks (people, frames, 4) with rounded turns: x, y [m], heading of the body and phase of its gait [rad].

    `phases` (people,) are those of the first frame, `strides` (people,) stride lengths [m].
    """
    path = gaussian_filter1d(walks[..., :2], _SMOOTH * fps, axis=1, mode="nearest")
    step = np.gradient(path, axis=1)
    gone = np.cumsum(np.linalg.norm(step, axis=-1), axis=1)
    turned = phases[:, None] + 2 * np.pi * gone / strides[:, None]
    return np.stack([path[..., 0], path[..., 1], np.arctan2(step[..., 1], step[..., 0]), turned], axis=-1)


class ActiveTracking(TrackingEnv):
    """Tracking several people with one camera that the agent steers.

    ## Description
    People walk about a round plaza, 13 m in radius, among pillars. They start anywhere, turn at random, and turn away
    from obstacles. A camera on a mast in the middle, 4.5 m high, pans, tilts and zooms with inertia. It sees at most a
    ninth of the plaza and nobody behind a pillar; zooming in makes its observations more precise. While it turns,
    pictures blur: if a picture moves by s halves of its width within `blur` seconds, a person in view is detected with
    a probability of only (1 - dropout) exp(-s²). So one looks by turns and stops, as eyes do. The agent states where
    everyone is, and steers the camera. Looking at one person means not looking at another, turning takes time, and
    people who are out of view walk on. Unlike in the other environments, actions change what is seen. A command pays
    off only some seconds later, so use a high discount (γ = 0.97 or more per frame at 10 frames per second).

    Positions are in metres, x and y on the ground, z up, the mast at x = y = 0.

    ## Action Space
    `Box(-1, 1, (3 + 3 people,), float32)`. The first three entries are commands to the motors of pan (positive from x
    to y), tilt (positive upwards) and zoom, as fractions of their highest rates. Three entries follow for each person
    on the roster: the believed x and y, in units of 15 m, and an entry s that encodes the standard deviation of either
    coordinate as 0.05 m · 200^((s + 1) / 2). `action` converts commands and, for each person, x, y and standard
    deviation [m] to an action; `estimate` converts back. The belief is about the last observed frame; the commands take
    effect until the next one.

    ## Observation Space
    `Dict`:

    - "points", `Box(-2, 2, (people, 15, 2), float32)`: a row per detection, from left to right, without identities.
      Each has the joints in the order of `motionenv.types.MARKERS`, measured to the right and down from the centre of
      the image, in units of half its width. Joints that aren't seen, and rows without a detection, are 0.
    - "seen", `MultiBinary((people, 15))`: which joints are seen. A person is detected only with at least 8 of the 15
      joints in view.
    - "colours", `Box(-1, 1, (people, 2), float32)`: cosine and sine of the observed hue of the clothes.
    - "camera", `Box(-4, 4, (6,), float32)`: pan and tilt [rad], zoom from 0 (40° wide) to 1 (21° wide), and their rates
      per second.
    - "roster", `Box(-3, 3, (people, 3), float32)`: each person's height [m], and cosine and sine of the true hue.
    - "pillars", `Box(-15, 15, (pillars, 3), float32)`: x, y and radius [m].
    - "time_left", `Box(0, 1, (1,), float32)`: from 1 at the start to 0 at the end.

    ## Rewards
    Minus the energy score [m] of the beliefs, averaged over people, minus `effort` times the mean square of the
    commands. The energy score is proper and lies between 0 and 35 m.

    ## Starting State
    People, paths, pillars and the camera's pan are random. Nothing is known about where people are.

    ## Episode End
    Truncated after `horizon` estimates; never terminated.

    ## Arguments
    - `people=3`, `pillars=8`: numbers of people and pillars, at most 8 and 24.
    - `noise=0.05`: standard deviation of the points' coordinates, in units of half the image's width.
    - `colour_noise=0.2`: standard deviation of hues [rad] in the widest view; zooming in halves it.
    - `dropout=0.1`: probability that a visible person isn't detected in a frame by a camera that stands still.
    - `blur=1`: time [s] over which a turning camera blurs; 0 lets it see as well as a still one.
    - `turn_seconds=12`: mean time [s] between a person's random turns.
    - `effort=0.05`: cost of full commands on all three axes.
    - `fps=10`, `horizon=600`: frame rate, and number of estimates in an episode.
    - `split="train"`: or "eval", which has other walkers.
    - `render_mode=None`: "rgb_array", the plaza from above, with beliefs as rings of two standard deviations, beside
      the camera's view.

    `truth()` returns "positions" (people, 2), "joints" (people, 15, 3) and "camera" of the last observed frame.
    `info["error"]` is the mean distance [m] between believed and true positions.

    ## Vectorized environment
    `gymnasium.make_vec("motionenv/ActiveTracking-v1", num_envs=64)` steps all episodes in compiled loops. It also
    accepts `autoreset_mode` ("NextStep", "SameStep", "Disabled").

    ## Version History
    - v1: turning blurs what is seen, the motors are faster, and the view is narrower.
    - v0: initial version.
    """

    world: ActiveWorld

    @taking(ActiveArguments)
    def __init__(self, arguments: ActiveArguments) -> None:
        super().__init__(arguments.world(1), render_mode=arguments.render_mode)
        self.arguments = arguments


@dataclass(frozen=True, kw_only=True)
class ActiveVectorArguments(ActiveArguments, VectorArguments):
    """Arguments of `ActiveTrackingVector`."""


class ActiveTrackingVector(TrackingVectorEnv):
    """`num_envs` copies of `ActiveTracking` in an `autoreset_mode`, stepped together."""

    @taking(ActiveVectorArguments)
    def __init__(self, arguments: ActiveVectorArguments) -> None:
        world = arguments.world(checked_whole(arguments.num_envs, "num_envs", 1))
        super().__init__(world, render_mode=arguments.render_mode, autoreset_mode=arguments.autoreset_mode)
        self.arguments = arguments
