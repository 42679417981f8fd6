"""Corrected legs: knees don't depend on a skeleton's hips; CMU's skeletons agree better with their own markers."""

from dataclasses import replace

import numpy as np
import pytest

from motionenv.body.skeleton import NODES
from motionenv.mocap import find_landmarks, read, retarget
from motionenv.mocap.clinical import clinical_angles, lower_body, measurements_of
from motionenv.mocap.clinical.skeleton_legs import SkeletonWalk, correct_legs
from motionenv.mocap.retargeting import find_nodes
from motionenv.types import POSE, Markers

AT = {name: i for i, name in enumerate(NODES)}


def flexion(nodes, side):
    """Angle (frames,) [degrees] between thigh and shank."""
    hip, knee, ankle = (nodes[:, AT[f"{side}_{joint}"]] for joint in ("hip", "knee", "ankle"))
    thigh, shank = knee - hip, ankle - knee
    cosine = (thigh * shank).sum(-1) / np.linalg.norm(thigh, axis=-1) / np.linalg.norm(shank, axis=-1)
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))


def spoilt(nodes, upright, axes, shift):
    """Nodes with hips shifted in the pelvis, and thighs as much shorter as the hips are lower."""
    worse = nodes.copy()
    for side in ("left", "right"):
        hip, knee, ankle = (AT[f"{side}_{joint}"] for joint in ("hip", "knee", "ankle"))
        thigh = np.median(np.linalg.norm(nodes[:, hip] - nodes[:, knee], axis=-1)) + shift[2]
        shank = np.median(np.linalg.norm(nodes[:, knee] - nodes[:, ankle], axis=-1))
        worse[:, hip] += upright @ shift
        leg = nodes[:, ankle] - worse[:, hip]
        reach = np.minimum(np.linalg.norm(leg, axis=-1, keepdims=True), 0.999 * (thigh + shank))
        along = (thigh**2 - shank**2 + reach**2) / (2 * reach)
        leg /= np.linalg.norm(leg, axis=-1, keepdims=True)
        ahead = np.cross(leg, axes[side])
        ahead /= np.linalg.norm(ahead, axis=-1, keepdims=True)
        worse[:, knee] = worse[:, hip] + along * leg + np.sqrt(thigh**2 - along**2) * ahead
    return worse


def captured(mocap, name):
    """A walk whose file states the knees' angles: the skeleton's nodes and turns, and those angles by side."""
    markers = read(mocap / f"btkdata/C3DSamples/PiG/{name}.c3d")
    nodes = find_nodes(markers)
    legs = lower_body(find_landmarks(markers).positions, measurements_of(markers.recording))
    known = np.isfinite(nodes.positions).all((1, 2)) & np.isfinite(legs.left.shank).all((1, 2))
    first, last = np.flatnonzero(known)[[0, -1]]
    part = slice(first, last + 1)
    assert known[part].all()
    shanks = {side: getattr(legs, side).shank[part] for side in ("left", "right")}
    walk = SkeletonWalk(nodes.positions[part], nodes.trunk[part], shanks, markers.fps)
    angles = clinical_angles(markers)
    return walk, {side: angles[f"{side}_knee_flexion"][part] for side in ("left", "right")}


@pytest.mark.parametrize("name", ["PiG_Motion-FlatFoot-Full", "PiG_Motion-FlatFoot-Hole"])
def test_knees_do_not_depend_on_where_the_skeleton_has_its_hips(mocap, name):
    """Moved by up to 6 cm, with thighs to match, they lead to the same knees, near the angles that the file states."""
    walk, truth = captured(mocap, name)
    axes = {side: shank[:, :, 1] for side, shank in walk.shanks.items()}
    found = []
    for shift in ([0.0, 0.0, 0.0], [0.03, 0.0, -0.05], [-0.02, 0.0, 0.02]):
        worse = replace(walk, nodes=spoilt(walk.nodes, walk.pelvis, axes, np.array(shift)))
        found.append([flexion(correct_legs(worse)[0], side) for side in ("left", "right")])
    assert max(np.abs(knees - found[0]).mean() for knees in np.array(found)) < 2.5
    assert max(np.abs(knees[i] - truth[side]).mean() for knees in found for i, side in enumerate(truth)) < 9.0


def test_a_skeleton_agrees_better_with_its_own_markers(mocap):
    """CMU 02_01: the pelvis rises and falls as the waist's markers do, and the knees bend less."""
    amc = read(mocap / "cmu_asfamc/02/02_01.amc", fps=120)
    c3d = read(mocap / "cmu_c3d/02_01.c3d")
    waist = np.mean([c3d.positions[:, c3d.names.index(n), 2] for n in ("LFWT", "RFWT", "LBWT", "RBWT")], axis=0)
    raw = amc.positions[:, amc.names.index("lhipjoint"), 2]
    fitted = find_nodes(amc).positions[:, AT["left_hip"], 2]
    inner = slice(60, 280)
    off = [np.std((height - waist)[inner] - np.polyval(np.polyfit(range(220), (height - waist)[inner], 1), range(220)))
           for height in (raw, fitted)]  # fmt: skip
    assert off[1] < 0.8 * off[0]
    knee = [POSE.index("left_knee_flexion"), POSE.index("right_knee_flexion")]
    bent = [np.degrees(np.median(retarget(m).poses[:, knee])) for m in (amc, c3d)]
    assert bent[0] == pytest.approx(bent[1], abs=5.0)


def test_ankles_stay_and_lengths_are_constant(mocap):
    amc = read(mocap / "cmu_asfamc/12/12_01.amc", fps=120)
    nodes = find_nodes(amc).positions
    for side in ("left", "right"):
        captured = amc.positions[:, amc.names.index(f"{side[0]}tibia")]
        np.testing.assert_array_equal(nodes[:, AT[f"{side}_ankle"]], captured)
        shank = np.linalg.norm(nodes[:, AT[f"{side}_ankle"]] - nodes[:, AT[f"{side}_knee"]], axis=-1)
        thigh = np.linalg.norm(nodes[:, AT[f"{side}_knee"]] - nodes[:, AT[f"{side}_hip"]], axis=-1)
        assert np.ptp(thigh) < 1e-9
        assert np.median(shank) == pytest.approx(np.median(thigh), rel=0.05)
        assert np.percentile(np.ptp(shank), 95) < 0.03  # longer only where the leg is straight and doesn't reach


def test_who_does_not_walk_is_not_corrected(mocap):
    """Standing at one place gives no steps, by which legs could be corrected."""
    amc = read(mocap / "cmu_asfamc/02/02_01.amc", fps=120)
    still = Markers(amc.names, np.repeat(amc.positions[:1], 200, axis=0), 120.0, amc.parents,
                    np.repeat(amc.rotations[:1], 200, axis=0), "still")  # fmt: skip
    nodes = find_nodes(still)
    assert "moved" not in nodes.how.get("hip", "")
    np.testing.assert_array_equal(nodes.positions[:, AT["left_knee"]], still.positions[:, amc.names.index("lfemur")])
