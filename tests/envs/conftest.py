"""Small environments of each kind, single and vectorised."""

from types import SimpleNamespace

import numpy as np
import pytest

from motionenv.envs import ArmTracking, ArmTrackingVector, WalkerTracking, WalkerTrackingVector

SHORT = {"size": 36, "horizon": 15, "actions": "metric"}
WALKER = WalkerTracking, WalkerTrackingVector
ARM = ArmTracking, ArmTrackingVector


def believed(pose) -> np.ndarray:
    """A belief of five poses that are all the same."""
    return np.tile([*pose, 0.0], (5, 1))


def normalised(pose) -> np.ndarray:
    """A walker's pose in units of the action space: half a second at 1.5 m/s, a start up to 2 m farther, and 2 m."""
    angles = np.arctan2(np.sin(pose[3:]), np.cos(pose[3:]))
    return np.concatenate([pose[:2] / 4.75, [(pose[2] - 1.0) / 2.0], angles / np.pi])


#: Classes, arguments, and the perfect action given the truth.
KINDS = {
    "walker": (*WALKER, {}, lambda truth: truth["pose"]),
    "walker-everything": (
        *WALKER,
        {"observation": ("rgb", "mask", "depth"), "camera": "random", "background": "clutter", "distractors": 1,
         "occluders": 1, "noise": 5.0, "brightness": 0.2, "speed": (0.8, 1.6), "height": (1.2, 2.0)},
        lambda truth: truth["pose"],
    ),
    "walker-normalised": (*WALKER, {"actions": "normalised"}, lambda truth: normalised(truth["pose"])),
    "walker-follow-joints": (*WALKER, {"camera": "follow", "estimate": "joints"}, lambda truth: truth["joints"]),
    "walker-belief": (*WALKER, {"estimate": "belief", "n_belief": 5}, lambda truth: believed(truth["pose"])),
    "arm": (*ARM, {"observation": "mask"}, lambda truth: truth["pose"][13:17]),
    "arm-walking-joints": (
        *ARM,
        {"motion": "walk/fpca", "estimate": "joints", "observation": ["depth"], "camera": 30},
        lambda truth: truth["joints"][[6, 8]],
    ),
    "arm-belief": (*ARM, {"estimate": "belief", "n_belief": 5}, lambda truth: believed(truth["pose"][13:17])),
}  # fmt: skip


@pytest.fixture(params=KINDS)
def kind(request) -> SimpleNamespace:
    """`single(**more)` and `vector(n, **more)` make environments of one kind; `perfect(truth)` is the best action."""
    single, vector, arguments, perfect = KINDS[request.param]
    return SimpleNamespace(
        name=request.param,
        single=lambda **more: single(**{**SHORT, **arguments, **more}),
        vector=lambda n, **more: vector(n, **{**SHORT, **arguments, **more}),
        perfect=perfect,
    )
