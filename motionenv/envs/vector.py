"""The native vector environment: many episodes in one world, in all three autoreset modes of Gymnasium."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from motionenv._core.validation import checked_choice, checked_whole
from motionenv.envs.base import (
    LOST_ESTIMATES,
    Observation,
    OfWorld,
    World,
    check_options,
    checked_actions,
    checked_lost_after,
    checked_render_mode,
)
from motionenv.errors import MotionError


@dataclass(frozen=True, kw_only=True)
class VectorArguments:
    """The arguments that vector environments have beside those of single ones."""

    num_envs: int = field(default=1, kw_only=False)
    autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP


class TrackingVectorEnv(OfWorld, gymnasium.vector.VectorEnv):
    """A vector environment on a world with one slot per sub-environment.

    It returns the same as a `gymnasium.vector.SyncVectorEnv` of the single environments for the same seeds, actions and
    autoreset mode.

    Args:
        world: with n = the number of sub-environments.
        render_mode, lost_after: None or "rgb_array", and as in `TrackingEnv`.
        autoreset_mode: NEXT_STEP, SAME_STEP or DISABLED, as `gymnasium.vector.AutoresetMode` or its value.
    """

    metadata = {  # noqa: RUF012 (as Gymnasium declares it)
        "render_modes": ["rgb_array"],
        "render_fps": 30,
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self, world: World, *, render_mode: str | None = None, lost_after: float | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
    ) -> None:  # fmt: skip
        self.world = world
        self.num_envs = world.n
        self.single_observation_space = world.observation_space
        self.single_action_space = world.action_space
        self.observation_space = batch_space(world.observation_space, world.n)
        self.action_space = batch_space(world.action_space, world.n)
        self.autoreset_mode = _checked_mode(autoreset_mode)
        fps = round(world.fps)
        self.metadata = {**self.metadata, "render_fps": fps, "autoreset_mode": self.autoreset_mode}
        self.render_mode = checked_render_mode(render_mode, self.metadata["render_modes"])
        self.lost_after = checked_lost_after(lost_after)
        self._all = np.arange(world.n)
        self._seeded = [seeding.np_random() for _ in self._all]
        self._off = np.zeros(world.n, dtype=np.intp)
        self._begun = np.zeros(world.n, dtype=bool)
        self._ended = np.zeros(world.n, dtype=bool)
        self._estimates: list[np.ndarray | None] = [None] * world.n

    @property  # type: ignore[misc]
    def np_random(self) -> tuple[np.random.Generator, ...]:  # type: ignore[override]
        """The generator of each sub-environment."""
        return tuple(rng for rng, _ in self._seeded)

    @property
    def np_random_seed(self) -> tuple[int, ...]:  # type: ignore[override]
        """The seed of each sub-environment's generator."""
        return tuple(seed for _, seed in self._seeded)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start new episodes in all or some sub-environments.

        Args:
            seed: of the first sub-environment, the others' follow; or one for each; None keeps their generators.
            options: {"reset_mask": bool (num_envs,)} resets only those, and returns the observations of all.

        Raises:
            MotionError: a wrong number of seeds, or an invalid mask.
            ResetNeeded: the mask excludes sub-environments that have never been reset.
        """
        mask = _checked_mask(options, self.num_envs)
        if not (self._begun | mask).all():
            raise ResetNeeded("reset all environments once before using reset_mask")
        slots = np.flatnonzero(mask)
        self._seed(seed, slots)
        self.closed = False  # or Gymnasium would ignore the next `close`, and the threads that start now would stay
        self._begin(slots)
        return self.world.observe(self._all), {}

    def _seed(self, seed: int | Sequence[int | None] | None, slots: np.ndarray) -> None:
        count = range(self.num_envs)
        seeds = seed if isinstance(seed, Sequence) else [None if seed is None else seed + i for i in count]
        if len(seeds) != self.num_envs:
            raise MotionError(f"seed must be one number, or one for each of {self.num_envs} environments, got {seed!r}")
        for slot in slots.tolist():
            if seeds[slot] is not None:
                self._seeded[slot] = seeding.np_random(seeds[slot])

    def step(self, actions: np.ndarray) -> tuple[Observation, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Score an estimate for each sub-environment's last observation, and observe the next frames.

        Args:
            actions: (num_envs, ...), inside `action_space`; ignored for sub-environments that are reset.

        Returns:
            Observations, rewards, terminated, truncated, infos; infos hold "error" [m] and "lost" of each estimate,
            with masks "_error" and "_lost", and in SAME_STEP mode "final_obs" and "final_info" of ended episodes.

        Raises:
            MotionError: actions of another shape, not numeric, not finite or out of bounds; the state is unchanged.
            ResetNeeded: before the first `reset`, or, in DISABLED mode, after the end of an episode.
        """
        ended = self._ended.copy()
        if not self._begun.all() or (self.autoreset_mode == AutoresetMode.DISABLED and ended.any()):
            raise ResetNeeded(
                f"environments {self._all[ended | ~self._begun].tolist()} have no running episode: reset them "
                'first, with reset(options={"reset_mask": mask})'
            )
        actions = checked_actions(actions, self.world.action_space, ~ended)
        slots = np.flatnonzero(~ended)
        errors, rewards = self.world.judge(actions)
        self.world.advance(slots)
        if self.lost_after is not None:
            self._off[slots] = np.where(errors[slots] > self.lost_after, self._off[slots] + 1, 0)
        lost, truncated = ~ended & (self._off >= LOST_ESTIMATES), ~ended & (self.world.time >= self.world.horizon)
        if self.render_mode is not None:
            for slot in slots:
                self._estimates[slot] = actions[slot]
        if ended.any():
            errors[ended] = rewards[ended] = 0
            self._begin(np.flatnonzero(ended))
        self._ended[:] = truncated
        if self.autoreset_mode == AutoresetMode.SAME_STEP and truncated.any():
            infos = self._renewed(errors, lost, ~ended)
        else:
            infos = _infos(errors, lost, ~ended)
        return self.world.observe(self._all), rewards, np.zeros_like(truncated), truncated, infos

    def _begin(self, slots: np.ndarray) -> None:
        if len(slots):
            self.world.begin(slots, [self._seeded[slot][0] for slot in slots])
            self._begun[slots], self._ended[slots], self._off[slots] = True, False, 0
            for slot in slots:
                self._estimates[slot] = None

    def _renewed(self, errors: np.ndarray, lost: np.ndarray, stepped: np.ndarray) -> dict[str, Any]:
        """Reset those of the `stepped` sub-environments that ended; returns the infos of that step."""
        ended = stepped & self._ended
        slots = np.flatnonzero(ended)
        last = self.world.observe(slots)
        infos = _infos(errors, lost, stepped & ~ended)
        final = np.full(self.num_envs, None, dtype=object)
        for i, slot in enumerate(slots):
            final[slot] = {k: v[i].copy() for k, v in last.items()} if isinstance(last, dict) else last[i].copy()
        infos |= {"final_obs": final, "_final_obs": ended.copy()}
        infos |= {"final_info": _infos(errors, lost, ended), "_final_info": ended.copy()}
        self._begin(slots)
        return infos

    def truth(self) -> list[dict[str, Any]]:
        """Ground truth of the last observed frame of each sub-environment; ResetNeeded before `reset`."""
        self.check_begun("truth")
        return [self.world.truth(slot) for slot in range(self.num_envs)]

    def render(self) -> tuple[np.ndarray, ...] | None:
        """An image per sub-environment, as in `TrackingEnv.render`; None without a render mode."""
        if self.render_mode is None:
            return None
        self.check_begun("picture")
        return tuple(self.world.render(slot, self._estimates[slot]) for slot in range(self.num_envs))

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """What each sub-environment's `name` gives, called with `args` and `kwargs` if it can be, as of Gymnasium's.

        Raises:
            AttributeError: a single environment has no such name.
            MotionError: `reset`, `step` or `close`, which act on all at once.
        """
        found = [self._attribute(name, slot) for slot in range(self.num_envs)]
        return tuple(value(*args, **kwargs) if callable(value) else value for value in found)

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """The attribute `name` of each sub-environment; see `call`."""
        return self.call(name)

    def set_attr(self, name: str, values: Any) -> None:
        """Set the attribute `name` of all sub-environments to a value, or to as many equal `values` in a list or tuple.

        Raises:
            MotionError: another number of values, or different ones: the sub-environments share their attributes.
        """
        each = list(values) if isinstance(values, list | tuple) else [values] * self.num_envs
        if len(each) != self.num_envs or any(value is not each[0] and value != each[0] for value in each):
            raise MotionError(
                f"values must be one for all of {self.num_envs} environments, which share {name}, got {values!r}"
            )
        setattr(self, name, checked_lost_after(each[0]) if name == "lost_after" else each[0])

    def _attribute(self, name: str, slot: int) -> Any:
        """What a single environment's `name` is in a `slot`."""
        if name in ("reset", "step", "close"):
            raise MotionError(f"{name} acts on all environments of a {type(self).__name__}: call {name}() itself")
        if name in ("action_space", "observation_space"):
            return getattr(self, f"single_{name}")
        if name == "truth":
            self.check_begun("truth")
            return lambda: self.world.truth(slot)
        if name == "render":
            self.check_begun("picture")
            return lambda: self.world.render(slot, self._estimates[slot]) if self.render_mode else None
        value = getattr(self, name)
        return value[slot] if name in ("np_random", "np_random_seed") else value

    def close_extras(self, **kwargs: Any) -> None:
        """Release threads; `kwargs` are ignored."""
        self.world.close()


class SimulatedTrackingVector(TrackingVectorEnv):
    """`num_envs` tracking environments on the world of their `arguments`."""

    world: Any

    def __init__(self, arguments: Any) -> None:
        super().__init__(
            arguments.world(checked_whole(arguments.num_envs, "num_envs", 1)), render_mode=arguments.render_mode,
            lost_after=arguments.lost_after, autoreset_mode=arguments.autoreset_mode,
        )  # fmt: skip
        self.arguments = arguments

    def _attribute(self, name: str, slot: int) -> Any:
        if name != "observation_model":
            return super()._attribute(name, slot)
        self.check_begun("observation")
        return self.world.observation_model(slot)


def _infos(errors: np.ndarray, lost: np.ndarray, mask: np.ndarray) -> dict[str, Any]:
    """Gymnasium's vector form of the infos {"error": float, "lost": bool} of the sub-environments in `mask` (n,)."""
    if not mask.any():
        return {}
    return {"error": np.where(mask, errors, 0.0), "_error": mask.copy(), "lost": lost & mask, "_lost": mask.copy()}


def _checked_mode(mode: AutoresetMode | str) -> AutoresetMode:
    if isinstance(mode, AutoresetMode):
        return mode
    return AutoresetMode(checked_choice(mode, "autoreset_mode", [known.value for known in AutoresetMode]))


def _checked_mask(options: dict[str, Any] | None, n: int) -> np.ndarray:
    check_options(options, "reset_mask")
    mask = (options or {}).get("reset_mask")
    if mask is None:
        return np.ones(n, dtype=bool)
    if not isinstance(mask, np.ndarray) or mask.dtype != bool or mask.shape != (n,) or not mask.any():
        raise MotionError(f"options['reset_mask'] must be a boolean array ({n},) with at least one True, got {mask!r}")
    return mask
