"""Episodes that the tests of the environments play."""

import numpy as np

from motionenv.envs import WalkerTracking

#: Arguments of MarkerTracking with which nothing disturbs what is seen.
CLEAR = {"noise": 0.0, "dropout": 0.0, "gaps": 0.0}


def begun(seed: int = 0, **arguments):
    """A walker's environment that has begun, and what it shows."""
    env = WalkerTracking(**{"observation": ("rgb", "mask", "depth"), "horizon": 30, "actions": "metric", **arguments})
    return env, env.reset(seed=seed)[0]


def episode(env, seed=0):
    """Observations, truths and errors of one episode in which the estimate is where markers are seen, at depth 0."""
    seen, _ = env.reset(seed=seed)
    observed, truths, errors, done = [seen], [env.unwrapped.truth()], [], False
    while not done:
        seen, reward, terminated, truncated, info = env.step(env.action(flat(seen)))
        assert reward == -info["error"]
        observed.append(seen)
        truths.append(env.unwrapped.truth())
        errors.append(info["error"])
        done = terminated or truncated
    return observed, truths, errors


def flat(seen):
    """Markers where they are seen, at depth 0."""
    return np.insert(seen["points"], 1, 0.0, axis=-1)
