"""Environments for Gymnasium, in which an agent estimates the pose of a walking body frame by frame.

    import gymnasium, motionenv
    env = gymnasium.make("motionenv/WalkerTracking-v0")
    envs = gymnasium.make_vec("motionenv/WalkerTracking-v0", num_envs=64)

This module itself doesn't load Gymnasium: its names do, when they are first used.
"""

from importlib import import_module

#: Public names and the modules that hold them.
_HOME = {
    "ArmTracking": "arm",
    "ArmTrackingVector": "arm",
    "MarkerTracking": "markers",
    "MarkerTrackingVector": "markers",
    "TrackingEnv": "base",
    "TrackingVectorEnv": "vector",
    "WalkerTracking": "walker",
    "WalkerTrackingVector": "walker",
}

__all__ = sorted(_HOME)


def __getattr__(name: str) -> object:
    """Load a public name when it is first asked for (PEP 562)."""
    if name not in _HOME:
        raise AttributeError(f"module 'motionenv.envs' has no attribute {name!r}")
    value = getattr(import_module(f"motionenv.envs.{_HOME[name]}"), name)
    globals()[name] = value
    return value
