"""GLB files by the Khronos validator, by trimesh, and evaluated here by the rules of the standard."""

import json
import shutil
import subprocess

import numpy as np
import pygltflib
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from motionenv.body import NODES, SEGMENTS, body_mesh, forward, from_height
from motionenv.body.skeleton import SEGMENT_ORIGIN
from motionenv.mocap import write
from motionenv.types import Motion

VALIDATE = """
const bytes = new Uint8Array(require("fs").readFileSync(process.argv[1]));
require("gltf-validator").validateBytes(bytes).then((report) => console.log(JSON.stringify(report)));
"""
TO_WORLD = [2, 0, 1]  # file (x, y, z) is world (y, z, x)


class Viewer:
    """What a glTF viewer does with nodes, animations and skins (glTF 2.0, sections 3.5, 3.7 and 3.11)."""

    def __init__(self, path):
        self.file = pygltflib.GLTF2().load(str(path))
        self.parent = {c: n for n, node in enumerate(self.file.nodes) for c in node.children or []}

    def data(self, number: int) -> np.ndarray:
        accessor = self.file.accessors[number]
        view = self.file.bufferViews[accessor.bufferView]
        dtype = {5126: "<f4", 5123: "<u2", 5121: "u1"}[accessor.componentType]
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}[accessor.type]
        values = np.frombuffer(self.file.binary_blob(), dtype, accessor.count * width, view.byteOffset)
        return values.reshape(accessor.count, width)

    def pose(self, frame: int) -> dict[tuple[int, str], np.ndarray]:
        animation = self.file.animations[0]
        return {
            (c.target.node, c.target.path): self.data(animation.samplers[c.sampler].output)[frame].astype(float)
            for c in animation.channels
        }

    def world(self, node: int, pose: dict) -> np.ndarray:
        local = np.eye(4)
        local[:3, :3] = Rotation.from_quat(pose.get((node, "rotation"), [0, 0, 0, 1])).as_matrix()
        local[:3, 3] = pose.get((node, "translation"), self.file.nodes[node].translation or np.zeros(3))
        return self.world(self.parent[node], pose) @ local if node in self.parent else local

    def skinned(self, pose: dict) -> list[np.ndarray]:
        """Vertices of each primitive, in the world's axes."""
        skin = self.file.skins[0]
        inverse = self.data(skin.inverseBindMatrices).reshape(-1, 4, 4).swapaxes(1, 2).astype(float)  # columns first
        bones = np.stack([self.world(joint, pose) for joint in skin.joints]) @ inverse
        out = []
        for primitive in self.file.meshes[0].primitives:
            a = primitive.attributes
            weights = self.data(a.WEIGHTS_0) / 255.0
            points = np.pad(self.data(a.POSITION).astype(float), ((0, 0), (0, 1)), constant_values=1.0)
            turned = np.einsum("vkij,vj->vki", bones[self.data(a.JOINTS_0)], points)
            out.append(np.einsum("vk,vki->vi", weights, turned)[:, TO_WORLD])
        return out


def check_joints(viewer, motion, frames, segments=SEGMENTS):
    """Joints against the kinematics."""
    names = [node.name for node in viewer.file.nodes]
    assert names == [*segments, "body"]
    nodes = forward(motion.poses, motion.skeleton)[0]
    for t in frames:
        pose = viewer.pose(t)
        for segment, origin in zip(SEGMENTS, SEGMENT_ORIGIN, strict=True):
            if segment not in segments:
                continue
            found = viewer.world(names.index(segment), pose)[:3, 3][TO_WORLD]
            np.testing.assert_allclose(found, nodes[t, origin], atol=1e-4, err_msg=f"{segment} ({NODES[origin]})")


def check(motion, path, frames):
    """Joints and skin against the kinematics."""
    viewer = Viewer(path)
    check_joints(viewer, motion, frames)
    for t in frames:
        pose = viewer.pose(t)
        body = body_mesh(motion.poses[t], motion.skeleton, sections=24)
        colours = np.asarray(body.visual.vertex_colors)
        _, first = np.unique(colours, axis=0, return_index=True)
        worn = {tuple(colours[i]): body.vertices[(colours == colours[i]).all(1)] for i in first}
        found = viewer.skinned(pose)
        assert sorted(map(len, found)) == sorted(map(len, worn.values()))
        for points in found:
            twin = min(worn.values(), key=lambda v: np.inf if len(v) != len(points) else np.abs(v - points).max())
            np.testing.assert_allclose(points, twin, atol=1e-4)


def validated(path) -> dict:
    """The Khronos validator's report."""
    if not shutil.which("node"):
        pytest.skip("no node: install Node.js to run the Khronos glTF validator")
    if subprocess.run(["node", "-e", 'require("gltf-validator")'], capture_output=True).returncode:
        pytest.skip("no Khronos validator: npm install gltf-validator, and set NODE_PATH to that node_modules")
    done = subprocess.run(["node", "-e", VALIDATE, path], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def test_a_viewer_shows_the_walk(walk, tmp_path):
    write(walk, tmp_path / "a.glb")
    check(walk, tmp_path / "a.glb", range(0, len(walk.poses), 49))
    viewer = Viewer(tmp_path / "a.glb")
    times = viewer.data(viewer.file.animations[0].samplers[0].input)[:, 0]
    np.testing.assert_allclose(times, np.arange(len(walk.poses)) / walk.fps, rtol=1e-6)
    assert viewer.file.animations[0].name == "02_01"


@settings(max_examples=15)
@given(seed=st.integers(0, 2**32 - 1))
def test_a_viewer_shows_any_pose(seed, any_motion, tmp_path_factory):
    path = tmp_path_factory.mktemp("glb") / "a.glb"
    motion = any_motion(seed, frames=2)
    write(motion, path)
    check(motion, path, range(2))


def test_quaternions_are_unit_and_turn_the_short_way(any_motion, walk, tmp_path):
    fast = any_motion(3, frames=200)
    for i, motion in enumerate((walk, fast)):
        write(motion, tmp_path / f"{i}.glb")
        viewer = Viewer(tmp_path / f"{i}.glb")
        for channel in viewer.file.animations[0].channels:
            if channel.target.path == "rotation":
                q = viewer.data(viewer.file.animations[0].samplers[channel.sampler].output)
                np.testing.assert_allclose(np.linalg.norm(q, axis=1), 1, atol=1e-6)
                assert ((q[1:] * q[:-1]).sum(1) >= 0).all()


@pytest.mark.parametrize("frames", [1, 50])
def test_khronos_validator_finds_nothing_wrong(frames, any_motion, tmp_path):
    write(any_motion(5, frames), tmp_path / "a.glb")
    report = validated(tmp_path / "a.glb")
    assert report["issues"]["messages"] == []
    assert report["info"]["hasSkins"]
    assert report["info"]["animationCount"] == 1


def test_khronos_validator_finds_nothing_wrong_with_a_walk(walk, tmp_path):
    write(walk, tmp_path / "a.glb")
    assert validated(tmp_path / "a.glb")["issues"]["messages"] == []


def test_missing_limbs_are_left_out(walk, without, tmp_path):
    write(walk, tmp_path / "whole.glb")
    write(without(walk, slice(6, 17)), tmp_path / "lower.glb")
    lower, whole = Viewer(tmp_path / "lower.glb"), Viewer(tmp_path / "whole.glb")
    kept = [s for s in SEGMENTS if s == "torso" or s.endswith(("thigh", "shin", "foot"))]
    check_joints(lower, walk, range(0, len(walk.poses), 49), kept)
    garments = {m.name: i for i, m in enumerate(lower.file.materials)}
    assert set(garments) == {"shirt", "trousers", "shoes"}  # no head, no neck, no hands
    for t in (0, 100):
        some, all_ = lower.skinned(lower.pose(t)), whole.skinned(whole.pose(t))
        for worn in ("trousers", "shoes"):
            twin = all_[[m.name for m in whole.file.materials].index(worn)]
            np.testing.assert_allclose(some[garments[worn]], twin, atol=1e-5)
    assert len(some[garments["shirt"]]) < len(all_[[m.name for m in whole.file.materials].index("shirt")])


def test_khronos_validator_finds_nothing_wrong_with_a_leg(any_motion, without, tmp_path):
    write(without(any_motion(5), slice(6, 21)), tmp_path / "a.glb")
    assert validated(tmp_path / "a.glb")["issues"]["messages"] == []


def test_trimesh_loads_a_person_who_stands_on_the_ground(tmp_path):
    write(Motion(np.zeros((1, 25)), from_height(1.8), 30.0), tmp_path / "a.glb")
    scene = trimesh.load_scene(tmp_path / "a.glb")
    assert sorted(m.visual.material.name for m in scene.geometry.values()) == [
        "hair",
        "shirt",
        "shoes",
        "skin",
        "trousers",
    ]
    assert all(m.is_watertight and m.volume > 0 for m in scene.geometry.values())
    np.testing.assert_allclose(scene.bounds[:, 1], [0, 1.8], atol=0.02)  # y is up
    toes = max(scene.geometry.values(), key=lambda m: m.vertices[:, 2].max()).visual.material.name
    assert toes == "shoes"  # z is forward
    normals = np.concatenate([m.vertex_normals for m in scene.geometry.values()])
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-5)
