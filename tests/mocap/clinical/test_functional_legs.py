"""Joint centres from clusters on real walks: against those from markers on the joints, and against limbs' lengths."""

import numpy as np
import pytest

from motionenv.errors import GapError
from motionenv.mocap import read
from motionenv.mocap.clinical.functional_legs import functional_legs
from motionenv.mocap.clinical.gait_model import pelvis
from motionenv.mocap.clinical.lower_body import lower_body
from motionenv.mocap.clinical.measurements import Measurements
from motionenv.mocap.marker_sets import find_landmarks
from motionenv.types import Markers

KNOWN = ("nimble/osim/LaiArnoldSubject6/walking1.trc", "nimble/grf/Subject4/MarkerData/walking4.trc")


def with_clusters(markers: Markers) -> dict[str, np.ndarray]:
    """The landmarks of OpenSim's set without those on knees and ankles, with its clusters instead."""
    at = {k: v for k, v in find_landmarks(markers).positions.items() if "knee" not in k and "ankle" not in k}
    for side, letter in (("left", "L"), ("right", "r")):
        for limb, word in (("thigh", "thigh"), ("shank", "sh")):
            names = [n for n in markers.names if n.startswith(f"{letter}_{word}") and n[-1].isdigit()]
            names += [f"{letter}_shank_antsup"] if limb == "shank" else []
            for i, name in enumerate(names, 1):
                at[f"{side}_{limb}_cluster_{i}"] = markers.positions[:, markers.index(name)]
    return at


@pytest.mark.parametrize("file", KNOWN)
def test_knees_are_near_those_of_the_markers_on_them(mocap, file):
    """Within 35 mm of the knee's centre in the median, and flexion within 6 degrees rms."""
    markers = read(mocap / file)
    right = lower_body(find_landmarks(markers).positions, Measurements())
    at = with_clusters(markers)
    found = functional_legs(at, pelvis(at), {side: at[f"{side}_hip"] for side in ("left", "right")})
    for side in ("left", "right"):
        leg = getattr(right, side)
        off = np.linalg.norm(found.landmarks[f"{side}_knee"] - leg.knee, axis=-1)
        assert np.nanmedian(off) < 0.035
        theirs, ours = (
            bend(leg.hip, leg.knee, leg.ankle),
            bend(leg.hip, found.landmarks[f"{side}_knee"], found.landmarks[f"{side}_ankle"]),
        )
        assert np.sqrt(np.nanmean((theirs - ours) ** 2)) < 6
    assert "Ehrig" in found.how["knee"]


def bend(hip, knee, ankle) -> np.ndarray:
    """Angle [degrees] between thigh and shank."""
    a, b = hip - knee, ankle - knee
    cosine = (a * b).sum(-1) / np.linalg.norm(a, axis=-1) / np.linalg.norm(b, axis=-1)
    return 180 - np.degrees(np.arccos(np.clip(cosine, -1, 1)))


@pytest.mark.parametrize("file", ["c3d.org/sample01/Eb015pi.c3d", "c3d.org/sample02/pc_int.c3d"])
def test_a_capture_of_clusters_alone_has_legs_of_constant_length(mocap, file):
    at = find_landmarks(read(mocap / "btkdata/C3DSamples" / file)).positions
    body = lower_body(at, Measurements())
    for leg in (body.left, body.right):
        for near, far in ((leg.hip, leg.knee), (leg.knee, leg.ankle)):
            length = np.linalg.norm(near - far, axis=-1)
            length = length[np.isfinite(length)]
            assert 0.3 < np.median(length) < 0.5
            assert length.std() < 0.015
    assert (body.pelvis.origin[:, 2] > 0.7).any()


def test_who_stands_does_not_tell_where_the_joints_are(mocap):
    markers = read(mocap / "btkdata/C3DSamples/c3d.org/sample01/Eb015pi.c3d")
    still = np.repeat(markers.positions[200:201], 60, axis=0)
    still += np.random.default_rng(0).normal(0, 0.0005, still.shape)
    with pytest.raises(GapError, match="need a trial in which the joints move"):
        lower_body(find_landmarks(Markers(markers.names, still, 50)).positions, Measurements())


def test_legs_with_markers_on_the_knees_are_left_to_those(mocap):
    at = find_landmarks(read(mocap / KNOWN[0])).positions
    assert functional_legs(at, pelvis(at), {}).landmarks == {}
