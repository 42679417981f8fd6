"""A person's limb lengths, from the whole body and from a part of it."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionenv import body
from motionenv.body.fitting import fit_skeleton
from motionenv.errors import GapError, MotionError
from motionenv.mocap import read_motion

NODES = body.NODES
UPPER = [n for n in NODES if not any(joint in n for joint in ("pelvis", "hip", "knee", "ankle"))]


def without(nodes, *names):
    hidden = nodes.copy()
    hidden[:, [NODES.index(name) for name in names]] = np.nan
    return hidden


def longer(skeleton, *joints):
    """A body whose segments above these joints are longer by a tenth."""
    offsets = skeleton.offsets.copy()
    offsets[[i for i, name in enumerate(NODES) if name.endswith(joints)]] *= 1.1
    return replace(skeleton, offsets=offsets)


@given(st.floats(0.9, 2.2), st.integers(0, 1000))
def test_a_persons_limbs_come_back(smooth_motion, nodes_of, height, seed):
    skeleton = body.from_height(height)
    fitted = fit_skeleton(nodes_of(smooth_motion(seed), skeleton)[0])
    assert np.allclose(fitted.offsets, skeleton.offsets, atol=1e-9)
    assert fitted.height == pytest.approx(height)


@pytest.mark.parametrize(
    "missing",
    [
        ("head",),
        ("left_wrist", "right_wrist", "head"),
        ("left_wrist", "left_elbow", "right_ankle"),
        ("right_knee", "right_ankle"),
        ("right_hip", "right_knee", "right_ankle"),
        ("pelvis", "neck"),
        ("sternum", "left_shoulder"),
        ("neck", "left_shoulder", "right_shoulder"),
        UPPER,
        (*UPPER, "pelvis"),
        (*UPPER, "right_hip", "right_knee", "right_ankle"),
        (*UPPER, "pelvis", "right_hip", "right_knee", "right_ankle"),
        (*UPPER, "left_ankle", "right_ankle"),
        ("left_knee", "right_knee", "left_ankle", "right_ankle"),
        [n for n in NODES if n not in ("left_shoulder", "left_elbow", "left_hip")],
    ],
)
def test_a_part_of_an_average_person_completes_to_the_whole(smooth_motion, nodes_of, missing):
    """What isn't seen has average proportions; with the average person, that is the whole truth."""
    skeleton = body.from_height(1.62)
    fitted = fit_skeleton(without(nodes_of(smooth_motion(4), skeleton)[0], *missing))
    assert fitted.height == pytest.approx(1.62, rel=1e-6 if "neck" not in missing or "sternum" in missing else 0.02)
    off = np.abs(fitted.offsets - skeleton.offsets)
    if {"pelvis", "neck"} <= set(missing) and "sternum" not in missing:
        off = off[[NODES.index(n) for n in NODES if n not in ("neck", "head")]]  # a neck between the shoulders is lower
    assert off.max() < (1e-6 if "neck" not in missing or "sternum" in missing else 0.02)


def test_one_side_stands_for_the_other(smooth_motion, nodes_of):
    """A person with long shins: the shin that is never seen is as long as the other, not as the average one."""
    skeleton = longer(body.from_height(1.7), "ankle")
    fitted = fit_skeleton(without(nodes_of(smooth_motion(2), skeleton)[0], "right_ankle"))
    assert np.allclose(fitted.offsets, skeleton.offsets, atol=1e-9)


def test_legs_tell_the_height(smooth_motion, nodes_of):
    skeleton = longer(body.from_height(1.7), "knee", "ankle")
    nodes = nodes_of(smooth_motion(2), skeleton)[0]
    assert fit_skeleton(without(nodes, *UPPER)).height == pytest.approx(1.7 * 1.1)
    assert 1.7 < fit_skeleton(nodes).height < 1.7 * 1.1  # legs and trunk together


def test_a_missing_neck_is_taken_above_the_shoulders(smooth_motion, nodes_of):
    fitted = fit_skeleton(without(nodes_of(smooth_motion(3), body.from_height())[0], "neck"))
    shoulders = fitted.offsets[[NODES.index("left_shoulder"), NODES.index("right_shoulder")]]
    assert np.allclose(fitted.offsets[NODES.index("neck")], 1.09 * shoulders.mean(0), atol=1e-9)


@pytest.mark.parametrize("folder", ["bandai_namco", "cmu_bvh_dance"])
def test_without_its_neck_a_captured_body_is_as_tall(folder, mocap):
    motion = read_motion(min((mocap / folder).rglob("*.bvh")))
    nodes = body.forward(motion.poses, motion.skeleton)[0]
    assert fit_skeleton(without(nodes, "neck")).height == pytest.approx(fit_skeleton(nodes).height, rel=0.01)


def test_what_can_not_be_measured_is_said(smooth_motion, nodes_of):
    nodes, *_ = nodes_of(smooth_motion(3), body.from_height())
    with pytest.raises(GapError, match="neither the pelvis nor a hip is ever seen"):
        fit_skeleton(without(nodes, "pelvis", "left_hip", "right_hip"))
    with pytest.raises(GapError, match="no two nodes of one limb"):
        fit_skeleton(without(nodes, *[n for n in NODES if n != "left_hip"]))
    with pytest.raises(MotionError, match="check the unit"):
        fit_skeleton(nodes * 1000)
    with pytest.raises(MotionError, match=r"shape \(frames, 16, 3\)"):
        fit_skeleton(nodes[:, :15])
