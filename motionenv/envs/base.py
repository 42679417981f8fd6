"""The base class of tracking environments: the Gymnasium interface on top of a `World`.

An episode has horizon + 1 frames. `reset` returns the observation of frame 0. The action of a step is the estimate for
the last observed frame; it is scored against that frame's ground truth, and the next frame is observed. The episode is
truncated when frame `horizon` has been observed, and is never terminated: who loses the track pays for every frame.

A world holds n episodes in arrays. The single environment is a world with n = 1, so the vector environment returns the
same as single ones with the same seeds.
"""

from __future__ import annotations

import functools
import inspect
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass
from typing import Any, Concatenate, ParamSpec, Protocol, TypeVar

import gymnasium
import numpy as np
from gymnasium.envs.registration import EnvSpec
from gymnasium.error import ResetNeeded
from numpy.typing import ArrayLike

from motionenv._core.validation import checked_number, did_you_mean
from motionenv.envs.simulation.estimates import ActionScale
from motionenv.errors import MotionError

_Self = TypeVar("_Self")
_Made = TypeVar("_Made")
_Named = ParamSpec("_Named")

#: Number of consecutive estimates with errors above `lost_after` after which the track is lost.
LOST_ESTIMATES = 10
_ROUNDING = 1e-6  # of an action's range, by which wrappers that rescale actions overshoot

Observation = np.ndarray | dict[str, np.ndarray]


class World(Protocol):
    """n episodes side by side: motion, observation and scoring.

    Everything random about an episode is drawn in `begin` from that episode's own generator, so that the content of a
    slot depends neither on n nor on the other slots.

    Attributes:
        n, horizon, fps: number of slots, number of estimates in an episode, and frame rate [Hz].
        observation_space, action_space: of one environment.
        scale: maps actions to estimates.
        time: (n,) the current frame of each episode, from 0 to `horizon`.
    """

    n: int
    horizon: int
    fps: float
    observation_space: gymnasium.Space
    action_space: gymnasium.spaces.Box
    scale: ActionScale
    time: np.ndarray

    def begin(self, slots: np.ndarray, rngs: Sequence[np.random.Generator]) -> None:
        """Start new episodes at frame 0 in `slots` (k,), each with its generator of `rngs`."""

    def observe(self, slots: np.ndarray) -> Observation:
        """Observations (k, ...) of the current frames of `slots` (k,), ascending, in new arrays; repeatable."""

    def judge(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Error (n,) [m] and reward (n,) of `actions` (n, ...), float64 inside the space, for the current frames."""

    def advance(self, slots: np.ndarray) -> None:
        """Go to the next frame in the `slots` (k,)."""

    def truth(self, slot: int) -> dict[str, Any]:
        """Ground truth of the current frame of the episode in `slot`."""

    def render(self, slot: int, estimate: np.ndarray | None) -> np.ndarray:
        """Image of a `slot`, uint8 (H, W, 3) with H and W of at least 256.

        With an `estimate`, which is for the frame before the current one, that frame is shown with it overlaid.
        """

    def close(self) -> None:
        """Release threads, if there are any; the world stays usable."""
        return


@dataclass(frozen=True, kw_only=True)
class Arguments(ABC):
    """Arguments of an environment, with their defaults; the environment's docstring describes them."""

    render_mode: str | None = None

    @abstractmethod
    def world(self, n: int) -> World:
        """A world of `n` episodes; raises MotionError for an invalid argument."""


def taking(
    arguments: Callable[_Named, _Made],
) -> Callable[[Callable[[_Self, _Made], None]], Callable[Concatenate[_Self, _Named], None]]:
    """Decorate a constructor of one object, an `Arguments`, to take that object's fields by name instead.

    The constructor's signature is that of `arguments`, the class of the object. Unknown names raise MotionError.
    """
    signature = inspect.signature(arguments, eval_str=True)

    def decorate(init: Callable[[_Self, _Made], None]) -> Callable[Concatenate[_Self, _Named], None]:
        @functools.wraps(init)
        def __init__(self: _Self, *given: Any, **named: Any) -> None:
            if "num_envs" in signature.parameters and "max_episode_steps" in named:
                # Gymnasium's limit of a single environment's steps, which doesn't make episodes longer.
                horizon = named.get("horizon", signature.parameters["horizon"].default)
                named["horizon"] = min(horizon, named.pop("max_episode_steps"))
            if unknown := sorted(named.keys() - signature.parameters):
                near = did_you_mean(unknown[0], signature.parameters)
                raise MotionError(f"{type(self).__name__} has no argument {unknown[0]!r}{near}")
            signature.bind(*given, **named)  # for errors that don't name the class of the arguments
            init(self, arguments(*given, **named))

        own = inspect.Parameter("self", inspect.Parameter.POSITIONAL_ONLY)
        vars(__init__)["__signature__"] = signature.replace(parameters=[own, *signature.parameters.values()])
        return __init__

    return decorate


class OfWorld:
    """What single and vector environments have in common."""

    world: World
    arguments: Arguments | None = None
    _spec: EnvSpec | None = None
    _begun: Any

    def __repr__(self) -> str:
        many = f"{self.world.n}, " if self.world.n > 1 else ""
        what = "" if self.arguments is None else f"{self.arguments}, "
        return f"{type(self).__name__}({many}{what}horizon {self.world.horizon})"

    @property
    def spec(self) -> EnvSpec | None:
        """Gymnasium's specification, whose `max_episode_steps` is this environment's horizon."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        self._spec = copy(spec)
        if self._spec is not None:
            self._spec.max_episode_steps = self.world.horizon

    def action(self, estimate: np.ndarray) -> np.ndarray:
        """The action, float32, that says an `estimate` [m, rad]; what is out of reach goes to the bound."""
        return self.world.scale.actions(estimate)

    def estimate(self, action: np.ndarray) -> np.ndarray:
        """The estimate [m, rad] that an `action` says; the inverse of the method `action`."""
        return self.world.scale.estimates(np.asarray(action, dtype=np.float64))

    def check_begun(self, what: str) -> None:
        """Raise ResetNeeded before the first `reset`; `what` was requested, for the message."""
        if not np.all(self._begun):
            raise ResetNeeded(f"no {what} is available before reset(): call reset() first")


class TrackingEnv(OfWorld, gymnasium.Env):
    """A single tracking environment on a world with one slot.

    Args:
        world: with n = 1.
        render_mode: None, or "rgb_array": the last estimated frame with the estimate overlaid. Gymnasium's wrapper
            `HumanRendering` shows it in a window.
        lost_after: error [m] that `LOST_ESTIMATES` consecutive estimates must exceed for the track to count as lost,
            until one is within it; None never counts one as lost.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 30}  # noqa: RUF012 (as Gymnasium declares it)

    def __init__(self, world: World, *, render_mode: str | None = None, lost_after: float | None = None) -> None:
        self.world = world
        self.observation_space = world.observation_space
        self.action_space = world.action_space
        self.metadata = {**self.metadata, "render_fps": round(world.fps)}
        self.render_mode = checked_render_mode(render_mode, self.metadata["render_modes"])
        self.lost_after = checked_lost_after(lost_after)
        self._slots = np.zeros(1, dtype=np.intp)
        self._begun = self._running = False
        self._off = 0
        self._estimate: np.ndarray | None = None

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Observation, dict]:
        """Start a new episode; returns the observation of its frame 0, and an empty info.

        `seed` seeds the episodes from here on; None continues with the current generator. There are no `options`.

        Raises:
            MotionError: an option.
        """
        check_options(options)
        super().reset(seed=seed)
        self.world.begin(self._slots, [self.np_random])
        self._begun, self._running, self._off, self._estimate = True, True, 0, None
        return self._observed(), {}

    def step(self, action: np.ndarray) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Score the estimate for the last observed frame, and observe the next.

        Returns:
            Observation, reward, terminated, which is always False, truncated, info; info holds the estimate's mean
            per-joint "error" [m], and whether the track is "lost".

        Raises:
            MotionError: `action` isn't inside `action_space`, numeric and finite; the state is unchanged.
            ResetNeeded: before the first `reset`, or after the end of an episode.
        """
        if not self._running:
            raise ResetNeeded("no episode is running: call reset() before the first step and after each episode")
        actions = checked_actions([action], self.world.action_space)
        errors, rewards = self.world.judge(actions)
        self.world.advance(self._slots)
        error = float(errors[0])
        self._off = self._off + 1 if self.lost_after is not None and error > self.lost_after else 0
        lost = self._off >= LOST_ESTIMATES
        truncated = bool(self.world.time[0] >= self.world.horizon)
        self._running, self._estimate = not truncated, actions[0]
        return self._observed(), float(rewards[0]), False, truncated, {"error": error, "lost": lost}

    def truth(self) -> dict[str, Any]:
        """Ground truth of the last observed frame, as the environment's docstring says; ResetNeeded before `reset`."""
        self.check_begun("truth")
        return self.world.truth(0)

    def render(self) -> np.ndarray | None:
        """The last estimated frame with the estimate overlaid, uint8 (H, W, 3); after `reset`, frame 0 alone.

        None without a render mode; ResetNeeded before `reset`.
        """
        if self.render_mode is None and self.spec is not None:
            gymnasium.logger.warn(
                f'render() returns None without a render mode: use gymnasium.make("{self.spec.id}", '
                'render_mode="rgb_array")'
            )
        if self.render_mode != "rgb_array":
            return None
        self.check_begun("picture")
        return self.world.render(0, self._estimate)

    def close(self) -> None:
        """Release threads. Repeated calls do nothing."""
        self.world.close()

    def _observed(self) -> Observation:
        seen = self.world.observe(self._slots)
        return {name: value[0] for name, value in seen.items()} if isinstance(seen, dict) else seen[0]


@dataclass(frozen=True, kw_only=True)
class SimulatedArguments(Arguments):
    """Arguments of environments whose track can be lost."""

    lost_after: float | None = None


class SimulatedTracking(TrackingEnv):
    """A tracking environment on the world of its `arguments`."""

    world: Any

    def __init__(self, arguments: SimulatedArguments) -> None:
        super().__init__(arguments.world(1), render_mode=arguments.render_mode, lost_after=arguments.lost_after)
        self.arguments = arguments

    @property
    def observation_model(self) -> Any:
        """Likelihood of poses (n, 25) for the last observed frame, without access to the ground truth."""
        self.check_begun("observation")
        return self.world.observation_model(0)


def checked_render_mode(mode: str | None, modes: Sequence[str]) -> str | None:
    """`mode`, which must be one of `modes` or None; otherwise raises MotionError."""
    if mode is not None and mode not in modes:
        shown = ": wrap the environment in gymnasium.wrappers.HumanRendering" if mode == "human" else ""
        raise MotionError(f"render_mode must be None or {' or '.join(modes)}, got {mode!r}{shown}")
    return mode


def check_options(options: dict[str, Any] | None, *known: str) -> None:
    """Raise MotionError for `options` of `reset` other than `known` ones."""
    for name in options or {}:
        if name not in known:
            allowed = f"only {', '.join(known)}" if known else "no options"
            raise MotionError(f"reset takes {allowed}, got {name!r}{did_you_mean(name, known)}")


def checked_lost_after(lost_after: float | None) -> float | None:
    """`lost_after`, which must be above 0 [m] or None; otherwise raises MotionError."""
    return None if lost_after is None else checked_number(lost_after, "lost_after", above=0, unit="metres")


def checked_actions(actions: ArrayLike, space: gymnasium.spaces.Box, read: np.ndarray | None = None) -> np.ndarray:
    """Actions (n, ...) as float64, each inside the `space` of a single environment, which must contain 0.

    What rounding puts beyond a bound, as wrappers that rescale actions do, is put back on it. Only those that `read`
    (n,) bool tells are used, None is all; the others become 0.

    Raises:
        MotionError: another shape of `actions`, not numeric, not finite or out of bounds.
    """
    try:
        actions = np.asarray(actions)
    except ValueError:
        raise MotionError(f"action must be an array of shape {space.shape}, got lists of different lengths") from None
    if (
        actions.dtype.kind not in "fiu"
        or actions.shape[1:] != space.shape
        or (read is not None and len(actions) != len(read))
    ):
        many = "" if read is None else f"({len(read)}, ...) of "
        raise MotionError(
            f"action must be numbers of shape {many}{space.shape}, got {actions.dtype} of shape "
            f"{actions.shape if read is not None else actions.shape[1:]}"
        )
    slack = _ROUNDING * (space.high - space.low)
    inside = (actions >= space.low - slack) & (actions <= space.high + slack)  # False for NaN
    if read is not None:
        inside[~read] = True
    if not inside.all():
        at = tuple(np.argwhere(~inside)[0].tolist())
        low, high = space.low[at[1:]], space.high[at[1:]]
        whose = f" of environment {at[0]}" if len(actions) > 1 else ""
        raise MotionError(
            f"action[{', '.join(map(str, at[1:]))}]{whose} must be finite and from {low:g} to {high:g}, "
            f"got {actions[at]}"
        )
    actions = np.clip(actions.astype(np.float64), space.low, space.high)
    if read is not None:
        actions[~read] = 0.0
    return actions
