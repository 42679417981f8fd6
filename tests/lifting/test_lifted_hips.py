"""Hips of lifted people are measured from a pelvis that tilts as people's do, not from the trunk."""

import numpy as np
import pytest

from motionenv.body import from_height, markers
from motionenv.lifting.gait import NAMES, _angles
from motionenv.types import POSE

FPS = 30.0
AT = {name: i for i, name in enumerate(POSE)}


def ahead(lean: float, swing: float = 0.3, seconds: float = 2.0) -> tuple[np.ndarray, np.ndarray]:
    """Markers of a body that leans forward by `lean` [rad] as it walks along x, and its thighs' pitch [degrees]."""
    time = np.arange(round(seconds * FPS)) / FPS
    poses = np.zeros((len(time), len(POSE)))
    poses[:, 0], poses[:, 2] = 1.2 * time, 0.9
    poses[:, AT["root_tilt"]] = lean
    pitch = swing * np.sin(2 * np.pi * time)
    poses[:, AT["left_hip_flexion"]], poses[:, AT["right_hip_flexion"]] = pitch + lean, lean - pitch
    places = markers(poses, from_height(1.75))
    thigh = places[:, 11] - places[:, 9]
    return places, np.degrees(np.arctan2(thigh[:, 0], -thigh[:, 2]))


@pytest.mark.parametrize("lean", [0.0, 0.15, 0.3])
def test_flexion_does_not_follow_the_trunk(lean):
    places, pitch = ahead(lean)
    found = _angles(places, None, FPS)[:, NAMES.index("left_hip_flexion")]
    assert np.abs(found - pitch - 7.0).max() < 1.0
