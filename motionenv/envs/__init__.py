"""Gymnasium environments in which an agent estimates the pose of a walking body frame by frame.

Importing this module registers them::

    import gymnasium
    import motionenv.envs

    gymnasium.register_envs(motionenv.envs)  # does nothing; tells linters that the import is needed
    env = gymnasium.make("motionenv/WalkerTracking-v1")
    envs = gymnasium.make_vec("motionenv/WalkerTracking-v1", num_envs=64)

Where only a string can be given, `"motionenv.envs:motionenv/WalkerTracking-v1"` imports the module too. After
`import motionenv` alone `gymnasium.make` raises `NamespaceNotFound`, as that imports neither this module nor Gymnasium.
The environment classes are imported on first use.

Except in ActiveTracking, actions never change what is seen: these are estimation problems, for which a discount of
γ = 0 is right.
"""

from importlib import import_module

from motionenv.envs.tasks import register

#: Public names and the modules that hold them.
_NAMES = {
    "active.tracking": "ActiveTracking ActiveTrackingVector", "arm": "ArmTracking ArmTrackingVector",
    "markers": "MarkerTracking MarkerTrackingVector", "base": "TrackingEnv", "vector": "TrackingVectorEnv",
    "walker": "WalkerTracking WalkerTrackingVector",
}  # fmt: skip
_HOME = {name: module for module, names in _NAMES.items() for name in names.split()}

__all__ = sorted(_HOME)

register()


def __getattr__(name: str) -> object:
    """Import a public name on first use (PEP 562)."""
    if name not in _HOME:
        raise AttributeError(f"module 'motionenv.envs' has no attribute {name!r}")
    value = getattr(import_module(f"motionenv.envs.{_HOME[name]}"), name)
    globals()[name] = value
    return value
