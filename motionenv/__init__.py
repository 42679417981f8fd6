"""Synthetic walking people with exact ground truth: gait models, rendering, tracking environments and estimators.

From recordings to pictures to estimates, and the folder of each step:

    mocap/                  read, retarget and write motion capture
    cycles/                 segment motion into gait cycles
    models/                 learn gait models, synthesise motion
    body/, render/          the cylinder body; pictures, depth, limb ids, video
    likelihoods/            how well a pose explains a picture
    tracking/, lifting/     particle filters; 3D walks from 2D points
    metrics/, envs/         errors and scores; Gymnasium environments
    data/                   data sets of any size, as files or streams
    cli/                    command line

    >>> import motionenv
    >>> motion = motionenv.synthesize("walk/fpca", seconds=2, fps=30, seed=1, speed=1.3)
    >>> motion
    Motion(60 frames, 30 fps, 1.62 m, 'walk')
    >>> camera = motionenv.fit_view(motionenv.markers(motion.poses, motion.skeleton), alpha=0.0)
    >>> motionenv.render.render(motion.poses[:2], motion.skeleton, camera)
    Frame(2 frames, 640x480, rgb, depth and limbs)

World: x forward, y left, z up; metres, radians, seconds; missing values are NaN. Public names are loaded on first use,
so importing motionenv is fast.
"""

from importlib import import_module
from typing import Any

__version__ = "0.3.0"

#: Public names and the modules that hold them.
_NAMES = {
    "types": "Camera Cycles Frame Markers Motion Points Skeleton",
    "errors": "EngineError FormatError GapError ModelError MotionError",
    "mocap": "read read_motion retarget write", "mocap.keypoints": "read_points", "body": "from_height markers",
    "cycles": "segment", "models.base": "GaitModel", "models.types": "Walker", "models.eigenwalkers": "Eigenwalkers",
    "models.fpca": "FunctionalPCA", "models.motion_tree": "MotionTree",
    "models.eigenwalkers.walker_prior": "WalkerPrior", "models.walking": "WalkingModel", "models.filling": "fill",
    "models.registry": "load", "models.synthesis": "synthesize", "lifting": "lift", "render": "Scene film",
    "render.cameras": "fit_view", "render.video.encode": "stream_video write_video",
}  # fmt: skip
_HOME = {name: module for module, names in _NAMES.items() for name in names.split()}
#: Packages that users begin with; the others can be imported too.
_PACKAGES = {"data", "envs", "gait", "lifting", "mocap", "models", "render", "tracking"}

__all__ = sorted({*_HOME, *_PACKAGES})


def __getattr__(name: str) -> Any:
    """Load a public name when it is first asked for (PEP 562)."""
    if name in _PACKAGES:
        return import_module(f"motionenv.{name}")
    if name not in _HOME:
        raise AttributeError(f"module 'motionenv' has no attribute {name!r}")
    value = getattr(import_module(f"motionenv.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """The public names."""
    return [*__all__, "__version__"]
