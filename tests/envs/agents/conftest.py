"""The environments that agents play in the tests."""

import pytest

from motionenv.envs.markers import MarkerTracking, MarkerTrackingVector
from motionenv.envs.walker import WalkerTracking, WalkerTrackingVector

ENVIRONMENTS = {
    "markers": (MarkerTracking, MarkerTrackingVector, {}),
    "pose from rgb": (WalkerTracking, WalkerTrackingVector, {"size": 36}),
    "joints from depth": (WalkerTracking, WalkerTrackingVector, {"observation": "depth", "estimate": "joints"}),
    "belief from masks": (
        WalkerTracking, WalkerTrackingVector, {"observation": ["mask", "rgb"], "estimate": "belief", "n_belief": 16}
    ),
}  # fmt: skip


@pytest.fixture(params=ENVIRONMENTS.values(), ids=ENVIRONMENTS)
def kind(request):
    return request.param
