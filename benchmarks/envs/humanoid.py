"""Steps per second of MuJoCo's Humanoid-v5 with pixel observations through EGL; run by `benchmarks.envs.speed`.

    MUJOCO_GL=egl python benchmarks/envs/humanoid.py SIZE made|plain|async [SECONDS]

Needs a Python with `gymnasium[mujoco]`. "made" uses the defaults of `gymnasium.make`; "plain" has no shadows (a map of
4096² each step), reflections or antialiasing; "async" runs two plain environments in separate processes. Prints one
number.
"""

import sys
import time

import gymnasium
from gymnasium.wrappers import AddRenderObservation

NAME, ROUNDS = "Humanoid-v5", 3
SECONDS = float(sys.argv[3]) if len(sys.argv) > 3 else 1.5  # of a round


class Plain(gymnasium.Wrapper):
    """Disables shadows, reflections and antialiasing."""

    def __init__(self, env: gymnasium.Env):
        super().__init__(env)
        model = env.unwrapped.model
        model.light_castshadow[:] = 0
        model.mat_reflectance[:] = 0
        model.vis.quality.offsamples = 0


def made(size: int, plain: bool) -> gymnasium.Env:
    """Make an environment with image observations."""
    env = gymnasium.make(NAME, render_mode="rgb_array", width=size, height=size)
    return AddRenderObservation(Plain(env) if plain else env)


def single(size: int, plain: bool) -> float:
    """Steps per second of one environment, resets included; the best of a few rounds."""
    env = made(size, plain)
    actions = [env.action_space.sample() for _ in range(16)]
    before, _ = env.reset(seed=0)
    seen, *_ = env.step(actions[0])
    if seen.shape != (size, size, 3) or not (seen != before).any():
        raise RuntimeError("Humanoid-v5 doesn't draw")
    best = 0.0
    for _ in range(ROUNDS):
        n, start = 0, time.perf_counter()
        while time.perf_counter() - start < SECONDS:
            _, _, terminated, truncated, _ = env.step(actions[n % 16])
            if terminated or truncated:
                env.reset()
            n += 1
        best = max(best, n / (time.perf_counter() - start))
    return best


def parallel(size: int, processes: int = 2) -> float:
    """Total steps per second of plain environments in separate processes."""
    envs = gymnasium.vector.AsyncVectorEnv([lambda: made(size, True)] * processes, context="spawn")
    actions = [envs.action_space.sample() for _ in range(16)]
    envs.reset(seed=0)
    best = 0.0
    for _ in range(ROUNDS):
        n, start = 0, time.perf_counter()
        while time.perf_counter() - start < SECONDS:
            envs.step(actions[n % 16])
            n += processes
        best = max(best, n / (time.perf_counter() - start))
    envs.close()
    return best


if __name__ == "__main__":
    size, how = int(sys.argv[1]), sys.argv[2]
    print(parallel(size) if how == "async" else single(size, how == "plain"))
