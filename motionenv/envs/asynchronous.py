"""Asynchronous stepping of a native vector environment, with the interface of EnvPool (Weng et al. 2022).

    envs = gymnasium.make_vec("motionenv/WalkerTracking-v1", num_envs=64, batch_size=32)
    envs.async_reset(seed=0)
    while training:
        observations, rewards, terminated, truncated, infos = envs.recv()  # of 32 of the 64 environments
        envs.send(policy(observations), infos["env_id"])  # they are stepped while the policy looks at the others

Environments are stepped in the background, in the order in which they were sent and `batch_size` together, so that the
same calls return the same batches. Arrays are new, contiguous and writable: `torch.from_dlpack` shares their memory.
"""

from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

import numpy as np

from motionenv._core.validation import checked_whole
from motionenv.envs.base import Observation, World, checked_actions
from motionenv.errors import MotionError

#: What `step` and `recv` return: observations, rewards, terminated, truncated, infos.
Step = tuple[Observation, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]


class Asynchronous:
    """`async_reset`, `send` and `recv` for vectors of `num_envs`, of which `recv` returns `batch_size`; None is all."""

    world: World
    _restart: Callable[[int | Sequence[int | None] | None], None]  # seeds all, and marks them for a new episode
    _runnable: Callable[[np.ndarray], np.ndarray]  # which of some will be restarted; raises if some can't be stepped
    _advance: Callable[[np.ndarray, np.ndarray], Step]  # steps some, ascending, with actions (num_envs, ...)

    def __init__(self, num_envs: int, batch_size: int | None) -> None:
        self.batch_size = num_envs if batch_size is None else checked_whole(batch_size, "batch_size", 1, num_envs)
        self._away = np.zeros(num_envs, dtype=bool)  # sent, and not yet received
        self._waiting: list[tuple[int, np.ndarray]] = []  # for a full batch
        self._batches: deque[tuple[np.ndarray, Future[Step]]] = deque()
        self._worker: ThreadPoolExecutor | None = None

    def async_reset(self, *, seed: int | Sequence[int | None] | None = None) -> None:
        """Start new episodes in all sub-environments, with `seed` as in `reset`; `recv` returns what they observe.

        Raises:
            MotionError: a wrong number of seeds, or environments that have been sent and not received.
        """
        self._check_received("async_reset")
        self._restart(seed)
        n, shape = len(self._away), self.world.action_space.shape
        self._queue(np.arange(n), np.zeros((n, *shape)))

    def send(self, actions: np.ndarray, env_id: np.ndarray | None = None) -> None:
        """Step some sub-environments in the background, as `step` would; in NEXT_STEP mode this restarts ended ones.

        Args:
            actions: (k, ...), inside `action_space`; ignored for sub-environments that are restarted.
            env_id: (k,) the sub-environments, in the order of `actions`; None for all.

        Raises:
            MotionError: invalid actions, or sub-environments that don't exist, are repeated or haven't been received;
                nothing is sent.
            ResetNeeded: before the first `async_reset` or `reset`, or, in DISABLED mode, after the end of an episode.
        """
        ids = np.arange(len(self._away)) if env_id is None else np.asarray(env_id)
        known = ids.dtype.kind in "iu" and ids.ndim == 1 and len(np.unique(ids)) == len(ids)
        if not (known and ((ids >= 0) & (ids < len(self._away))).all()):
            raise MotionError(f"env_id must be different whole numbers from 0 to {len(self._away) - 1}, got {env_id!r}")
        if self._away[ids].any():
            raise MotionError(f"environments {ids[self._away[ids]].tolist()} have been sent: call recv() first")
        ended = self._runnable(ids)
        self._queue(ids, checked_actions(actions, self.world.action_space, ~ended))

    def recv(self) -> Step:
        """What `step` would return for the `batch_size` sub-environments that were sent first.

        `infos["env_id"]` (batch_size,) names them, in ascending order. After `async_reset` rewards are 0.

        Raises:
            MotionError: fewer than `batch_size` environments have been sent.
        """
        if not self._batches:
            raise MotionError(
                f"recv() returns {self.batch_size} environments, but {len(self._waiting)} have been sent: call "
                "async_reset() or send() first"
            )
        ids, batch = self._batches.popleft()
        self._away[ids] = False
        observed, rewards, terminated, truncated, infos = batch.result()
        return observed, rewards, terminated, truncated, {**infos, "env_id": ids}

    def _check_received(self, what: str) -> None:
        """Refuse `what` while environments have been sent and not received."""
        if self._away.any():
            away = np.flatnonzero(self._away).tolist()
            raise MotionError(f"no {what} while environments {away} are stepped in the background: recv() them first")

    def _queue(self, ids: np.ndarray, actions: np.ndarray) -> None:
        """Hand full batches to the worker."""
        self._away[ids] = True
        self._waiting += zip(ids.tolist(), actions, strict=True)
        while len(self._waiting) >= self.batch_size:
            first, self._waiting = self._waiting[: self.batch_size], self._waiting[self.batch_size :]
            chosen = np.array(sorted(i for i, _ in first))
            every = np.zeros((len(self._away), *self.world.action_space.shape))
            for i, action in first:
                every[i] = action
            self._worker = self._worker or ThreadPoolExecutor(1, thread_name_prefix="motionenv-step")
            self._batches.append((chosen, self._worker.submit(self._advance, every, chosen)))

    def _stop(self) -> None:
        """Finish what was sent, forget it, and release the thread."""
        if self._worker is not None:
            self._worker.shutdown()
        self._worker = None
        self._batches.clear()
        self._waiting.clear()
        self._away[:] = False
