"""BVH files read by others: the parser `bvh` with SciPy's rotations, Blender's importer, and our own reader."""

import importlib.util
import os
import subprocess
import sys

import numpy as np
import pytest
from bvh import Bvh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from motionenv.body import NODES, SEGMENTS, forward, markers
from motionenv.mocap import write
from motionenv.mocap.readers import bvh as reader
from motionenv.mocap.retargeting import retarget
from motionenv.types import POSE

JOINTS = {
    "Hips": "pelvis", "Spine2": "sternum", "Neck": "neck",
    **{f"{w}{joint}": f"{s}_{node}" for s, w in (("left", "Left"), ("right", "Right")) for joint, node in (
        ("Arm", "shoulder"), ("ForeArm", "elbow"), ("Hand", "wrist"),
        ("UpLeg", "hip"), ("Leg", "knee"), ("Foot", "ankle"),
    )},
}  # fmt: skip
TURNED_BY = {
    "Hips": "torso", "Neck": "head",
    **{f"{w}{joint}": f"{s}_{segment}" for s, w in (("left", "Left"), ("right", "Right")) for joint, segment in (
        ("Arm", "upper_arm"), ("ForeArm", "forearm"), ("UpLeg", "thigh"), ("Leg", "shin"), ("Foot", "foot"),
    )},
}  # fmt: skip
BLENDER = """
import sys, numpy as np, bpy
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_anim.bvh(filepath=sys.argv[1], axis_forward="-Z", axis_up="Y", global_scale=0.01, update_scene_fps=True)
armature = next(o for o in bpy.data.objects if o.type == "ARMATURE")
scene, heads = bpy.context.scene, {}
for frame in range(int(sys.argv[3])):
    scene.frame_set(1 + frame)
    for bone in armature.pose.bones:
        heads.setdefault(bone.name, []).append(list(armature.matrix_world @ bone.head))
np.savez(sys.argv[2], fps=scene.render.fps / scene.render.fps_base, **heads)
"""


def positions(text: str) -> dict[str, np.ndarray]:
    """World positions (frames, 3) [m] of the joints, by the file's own numbers."""
    file = Bvh(text)
    rows = np.array(file.frames, dtype=float)
    at, turn = {}, {}
    for joint in file.get_joints():
        start = file.get_joint_channels_index(joint.name)
        channels = file.joint_channels(joint.name)
        values = rows[:, start : start + len(channels)]
        local = Rotation.from_euler("".join(c[0] for c in channels[-3:]), values[:, -3:], degrees=True)
        if joint.parent.value[:1] == ["HIERARCHY"] or len(channels) == 6:
            at[joint.name], turn[joint.name] = values[:, :3], local
        else:
            parent = joint.parent.name
            at[joint.name] = at[parent] + turn[parent].apply(file.joint_offset(joint.name))
            turn[joint.name] = turn[parent] * local
    return {name: 0.01 * p[:, [2, 0, 1]] for name, p in at.items()}  # file (x, y, z) is world (y, z, x)


def check_joints(found, motion, tolerance):
    nodes = forward(motion.poses, motion.skeleton)[0]
    for joint, node in JOINTS.items():
        np.testing.assert_allclose(found[joint], nodes[:, NODES.index(node)], atol=tolerance, err_msg=joint)
    head = nodes[:, [NODES.index("neck"), NODES.index("head")]].mean(1)
    np.testing.assert_allclose(found["Head"], head, atol=tolerance)


def test_another_parser_finds_the_joints_of_a_walk(walk, tmp_path):
    write(walk, tmp_path / "a.bvh")
    check_joints(positions((tmp_path / "a.bvh").read_text()), walk, 1e-6)


@settings(max_examples=30)
@given(seed=st.integers(0, 2**32 - 1), fps=st.sampled_from([24.0, 29.97, 30.0, 59.94, 60.0, 100.0, 120.0, 239.76]))
def test_any_pose_is_read_back(seed, fps, any_motion, tmp_path_factory):
    motion = any_motion(seed, fps=fps)
    path = tmp_path_factory.mktemp("bvh") / "a.bvh"
    write(motion, path)
    check_joints(positions(path.read_text()), motion, 1e-6)
    found = reader.read(path, unit="cm")
    assert found.fps == pytest.approx(fps, rel=1e-14)
    rotations = forward(motion.poses, motion.skeleton)[1]
    for joint, segment in TURNED_BY.items():
        difference = found.rotations[:, found.index(joint)] - rotations[:, SEGMENTS.index(segment)]
        np.testing.assert_allclose(difference, 0, atol=1e-6, err_msg=joint)


def test_channels_are_the_pose_vector(any_motion, tmp_path):
    motion = any_motion(1)
    write(motion, tmp_path / "a.bvh")
    file = Bvh((tmp_path / "a.bvh").read_text())
    for joint, channel, sign, entry in (
        ("Hips", "Yrotation", 1, "root_heading"),
        ("Neck", "Zrotation", -1, "neck_bend"),
        ("LeftArm", "Xrotation", -1, "left_shoulder_flexion"),
        ("RightArm", "Zrotation", -1, "right_shoulder_abduction"),
        ("RightForeArm", "Xrotation", -1, "right_elbow_flexion"),
        ("LeftUpLeg", "Yrotation", -1, "left_hip_rotation"),
        ("RightUpLeg", "Yrotation", 1, "right_hip_rotation"),
        ("RightLeg", "Xrotation", 1, "right_knee_flexion"),
    ):
        read = [file.frame_joint_channel(t, joint, channel) for t in range(len(motion.poses))]
        np.testing.assert_allclose(np.radians(read), sign * motion.poses[:, POSE.index(entry)], atol=1e-7)


def test_retargeting_gives_the_walk_back(walk, tmp_path):
    """Exactly where points tell the pose: the axial turn of a limb that is nearly straight is an estimate."""
    write(walk, tmp_path / "a.bvh")
    back = retarget(reader.read(tmp_path / "a.bvh"), marker_map="mixamo")
    off = np.linalg.norm(markers(back.poses, back.skeleton) - markers(walk.poses, walk.skeleton), axis=-1)
    assert np.median(off) < 1e-4
    assert np.percentile(off, 95) < 0.005
    told = [i for i, name in enumerate(POSE) if "rotation" not in name and not name.startswith(("neck", "root_z"))]
    assert np.median(np.abs(back.poses - walk.poses)[:, told]) < 1e-4
    assert back.skeleton.height == pytest.approx(walk.skeleton.height, abs=1e-3)


def test_no_frame_and_no_tip_lies_off_the_body(walk, tmp_path):
    write(walk, tmp_path / "a.bvh")
    found = reader.read(tmp_path / "a.bvh")
    tips = {name: found.positions[:, found.index(name)] for name in found.names if name.endswith("_end")}
    assert set(tips) == {"Head_end", "LeftHand_end", "RightHand_end", "LeftFoot_end", "RightFoot_end"}
    assert np.abs(tips["Head_end"][:, 2] - walk.skeleton.height).max() < 0.1
    toes = np.concatenate([tips["LeftFoot_end"], tips["RightFoot_end"]])
    assert toes[:, 2].min() > -0.05
    assert (tips["LeftFoot_end"] - found.positions[:, found.index("LeftFoot")])[:, 0].max() > 0.1  # forward is x


PARTS = {
    "lower body": (
        [slice(6, 17)],
        {"Hips", "Spine2", "LeftUpLeg", "LeftLeg", "LeftFoot", "RightUpLeg", "RightLeg", "RightFoot"},
    ),
    "one leg": ([slice(6, 21)], {"Hips", "Spine2", "RightUpLeg", "RightLeg", "RightFoot"}),
    "no knee": ([slice(6, 21), slice(24, 25)], {"Hips", "Spine2", "RightUpLeg"}),
}  # fmt: skip


@pytest.mark.parametrize(("entries", "joints"), PARTS.values(), ids=PARTS)
def test_missing_limbs_are_left_out_of_the_hierarchy(entries, joints, walk, without, tmp_path):
    """Every leaf ends where the joint that is left out would begin."""
    write(without(walk, *entries), tmp_path / "a.bvh")
    found = positions((tmp_path / "a.bvh").read_text())
    assert set(found) == joints
    nodes = forward(walk.poses, walk.skeleton)[0]
    for joint in joints:
        np.testing.assert_allclose(found[joint], nodes[:, NODES.index(JOINTS[joint])], atol=1e-6)
    read = reader.read(tmp_path / "a.bvh")
    ends = {"Spine2_end": "neck"} | ({"RightUpLeg_end": "right_knee"} if "RightLeg" not in joints else {})
    for end, node in ends.items():
        np.testing.assert_allclose(read.positions[:, read.index(end)], nodes[:, NODES.index(node)], atol=1e-6)


def blender() -> str:
    """A Python that has Blender as a module."""
    if importlib.util.find_spec("bpy"):
        return sys.executable
    if "MOTIONENV_BPY" not in os.environ:
        pytest.skip("no Blender: pip install bpy, here or elsewhere, and set MOTIONENV_BPY to the Python that has it")
    return os.environ["MOTIONENV_BPY"]


def test_blender_finds_the_joints_of_a_walk(walk, tmp_path):
    python = blender()
    write(walk, tmp_path / "a.bvh")
    arguments = [tmp_path / "a.bvh", tmp_path / "heads.npz", str(len(walk.poses))]
    done = subprocess.run([python, "-c", BLENDER, *arguments], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    heads = np.load(tmp_path / "heads.npz")
    assert heads["fps"] == walk.fps
    check_joints(
        {name: heads[name] @ [[0, 1, 0], [-1, 0, 0], [0, 0, 1]] for name in heads if name != "fps"}, walk, 1e-5
    )
