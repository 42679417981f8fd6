"""Walking people with known ground truth: learned from motion capture, seen as cylinder bodies, posed for tracking.

The flow, and where each step lives:

    motion capture → Motion → Cycles  → model   → Motion → body  → image   → estimate    → score
    mocap/           types    cycles/   models/            body/   render/   estimation/   metrics/   joined in envs/

    >>> import motionenv
    >>> motion = motionenv.load("walk/fpca").synthesize(seconds=2, fps=30, seed=1, speed=1.3)
    >>> motion.poses.shape
    (60, 25)
    >>> camera = motionenv.fit_view(motionenv.markers(motion.poses, motion.skeleton), alpha=0.0)
    >>> from motionenv.render import render
    >>> render(motion.poses[:2], motion.skeleton, camera).rgb.shape
    (2, 480, 640, 3)

World: x forward, y left, z up; metres, radians, seconds. Missing is NaN. Names are loaded when first used, so that
importing motionenv costs next to nothing.
"""

from importlib import import_module
from typing import Any

from motionenv.envs.registration import register_with_gymnasium

__version__ = "0.1.0"

#: Public names and the modules that hold them.
_HOME = {
    "Camera": "types",
    "Cycles": "types",
    "Frame": "types",
    "Markers": "types",
    "Motion": "types",
    "Points": "types",
    "Skeleton": "types",
    "EngineError": "errors",
    "MotionError": "errors",
    "ServiceError": "errors",
    "read": "mocap",
    "read_points": "mocap.points2d",
    "retarget": "mocap",
    "write": "mocap",
    "from_height": "body",
    "markers": "body",
    "segment": "cycles",
    "Eigenwalkers": "models.eigenwalkers",
    "FunctionalPCA": "models.fpca",
    "MotionTree": "models.tree",
    "WalkerPrior": "models.walkerprior",
    "WalkingModel": "models.walking",
    "load": "models.store",
    "parameters": "models.sharing",
    "synthesize": "models.synthesis",
    "lift": "estimation.lifting",
    "Scene": "render",
    "film": "render",
    "fit_view": "render.cameras",
    "stream_video": "render.video",
    "view": "render.cameras",
    "write_video": "render.video",
    "Client": "client",
}

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    """Load a public name when it is first asked for (PEP 562)."""
    if name not in _HOME:
        raise AttributeError(f"module 'motionenv' has no attribute {name!r}")
    value = getattr(import_module(f"motionenv.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """The public names."""
    return [*__all__, "__version__"]


register_with_gymnasium()
