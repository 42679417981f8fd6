"""GLB writer: binary glTF 2.0 (Khronos 2021) of the cylinder body, skinned and animated.

The joints of the skin are the body's segments; each limb follows one of them. Metres, y up, facing z.
"""

import json
import struct
from collections.abc import Iterator

import numpy as np
from scipy.spatial.transform import Rotation

from motionenv.body.kinematics import forward
from motionenv.body.limbs import CLOTHES, COLOURS, LIMB_SEGMENT
from motionenv.body.meshes import Mesh, limb_meshes
from motionenv.body.skeleton import SEGMENT_ORIGIN, SEGMENT_PARENT, SEGMENTS
from motionenv.mocap.writers import common
from motionenv.mocap.writers.common import y_up
from motionenv.types import Motion, Skeleton

_COMPONENTS = {"float32": 5126, "uint16": 5123, "uint8": 5121}
_KINDS = {(): "SCALAR", (3,): "VEC3", (4,): "VEC4", (4, 4): "MAT4"}
_VERTICES, _INDICES = 34962, 34963
_SECTIONS = 24  # vertices around a limb


def encode(motion: Motion) -> Iterator[bytes]:
    """The bytes of a GLB file of the moving body, in one part, because it starts with its length.

    Limbs that are missing in every frame of the sequence (frames, 25) are left out.

    Raises:
        GapError: `motion` has gaps in time, which the format can't represent.
        MotionError: not one sequence.
    """
    common.check_sequence(motion, "GLB", gaps=False)
    shown = np.flatnonzero(common.shown_segments(motion.poses)).tolist()
    motion = common.without_missing(motion)
    data = _Data()
    rest = _rest(motion.skeleton) + y_up([*motion.poses[0, :2], 0.0])  # viewers look there
    limbs = _limbs(motion.skeleton, shown)
    primitives = [_primitive(data, material, held, rest[shown]) for material, held in enumerate(limbs.values())]
    document = {
        "asset": {"version": "2.0", "generator": "motionenv"},
        "scene": 0, "scenes": [{"nodes": [0, len(shown)]}],
        "nodes": [*_joints(rest, shown), {"name": "body", "mesh": 0, "skin": 0}],
        "meshes": [{"name": "body", "primitives": primitives}], "materials": [_material(worn) for worn in limbs],
        "skins": [_skin(data, rest[shown])], "animations": [_animation(data, motion, shown)],
        "accessors": data.accessors, "bufferViews": data.views, "buffers": [{"byteLength": len(data.bytes)}],
    }  # fmt: skip
    text = json.dumps(document, separators=(",", ":")).encode()
    return iter([_container(text, bytes(data.bytes))])


def _container(text: bytes, binary: bytes) -> bytes:
    """The header and the two chunks of a GLB file (glTF 2.0, section 4.4)."""
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    head = struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + len(binary))
    return b"".join(
        [head, struct.pack("<I4s", len(text), b"JSON"), text, struct.pack("<I4s", len(binary), b"BIN\0"), binary]
    )


class _Data:
    def __init__(self):
        self.bytes = bytearray()
        self.views: list[dict] = []
        self.accessors: list[dict] = []

    def add(self, array: np.ndarray, *, target: int | None = None, bounds: bool = False, **more) -> int:
        """Append `array`, (count, ...); returns the index of its accessor."""
        array = np.ascontiguousarray(array)
        self.bytes += b"\0" * (-len(self.bytes) % 4)
        view = {"buffer": 0, "byteOffset": len(self.bytes), "byteLength": array.nbytes}
        self.views.append(view if target is None else {**view, "target": target})
        self.bytes += array.tobytes()
        accessor = {
            "bufferView": len(self.views) - 1, "componentType": _COMPONENTS[array.dtype.name], "count": len(array),
            "type": _KINDS[array.shape[1:]], **more,
        }  # fmt: skip
        if bounds:
            accessor |= {"min": np.atleast_1d(array.min(0)).tolist(), "max": np.atleast_1d(array.max(0)).tolist()}
        self.accessors.append(accessor)
        return len(self.accessors) - 1


def _rest(skeleton: Skeleton) -> np.ndarray:
    """Origins (12, 3) [m] of the segments of a body upright at the file's origin, in the file's axes."""
    origins = forward(np.zeros(25), skeleton)[0][list(SEGMENT_ORIGIN)]
    lowest = [
        m.vertices[:, 2].min() + origins[s, 2] for s, m in zip(LIMB_SEGMENT, limb_meshes(skeleton, 8), strict=True)
    ]
    return y_up(origins - [0.0, 0.0, min(lowest)])


def _joints(rest: np.ndarray, shown: list[int]) -> list[dict]:
    """The nodes of the segments `shown`, in the order of `SEGMENTS`, in the rest pose."""
    nodes = []
    for segment in shown:
        parent = SEGMENT_PARENT[segment]
        offset = rest[segment] - (rest[parent] if parent >= 0 else 0.0)
        node = {"name": SEGMENTS[segment], "translation": offset.tolist()}
        children = [i for i, child in enumerate(shown) if SEGMENT_PARENT[child] == segment]
        nodes.append({**node, "children": children} if children else node)
    return nodes


def _material(worn: str) -> dict:
    colour = [round(c**2.2, 4) for c in COLOURS[worn]]
    surface = {"baseColorFactor": [*colour, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.8}
    return {"name": worn, "pbrMetallicRoughness": surface}


def _limbs(skeleton: Skeleton, shown: list[int]) -> dict[str, list[tuple[int, Mesh]]]:
    """Node and mesh of each limb whose segment is `shown`, by garment."""
    meshes = zip(LIMB_SEGMENT.tolist(), limb_meshes(skeleton, _SECTIONS), CLOTHES, strict=True)
    limbs = [(shown.index(segment), mesh, worn) for segment, mesh, worn in meshes if segment in shown]
    by_garment = {worn: [(node, mesh) for node, mesh, w in limbs if w == worn] for worn in COLOURS}
    return {worn: held for worn, held in by_garment.items() if held}


def _primitive(data: _Data, material: int, limbs: list[tuple[int, Mesh]], rest: np.ndarray) -> dict:
    """The limbs of one colour in the rest pose: triangles, and vertices each bound to its limb's node."""
    sizes = [len(mesh.vertices) for _, mesh in limbs]
    first = np.cumsum([0, *sizes[:-1]])
    joints = np.zeros((sum(sizes), 4), dtype=np.uint8)
    joints[:, 0] = np.repeat([node for node, _ in limbs], sizes)
    vertices = np.concatenate([y_up(mesh.vertices) + rest[node] for node, mesh in limbs])
    normals = np.concatenate([y_up(mesh.normals) for _, mesh in limbs])
    faces = np.concatenate([mesh.faces + start for start, (_, mesh) in zip(first, limbs, strict=True)])
    weights = np.zeros_like(joints)
    weights[:, 0] = 255
    attributes = {
        "POSITION": data.add(vertices.astype(np.float32), target=_VERTICES, bounds=True),
        "NORMAL": data.add(normals.astype(np.float32), target=_VERTICES),
        "JOINTS_0": data.add(joints, target=_VERTICES),
        "WEIGHTS_0": data.add(weights, target=_VERTICES, normalized=True),
    }
    indices = data.add(faces.ravel().astype(np.uint16), target=_INDICES)
    return {"attributes": attributes, "indices": indices, "material": material}


def _skin(data: _Data, rest: np.ndarray) -> dict:
    """All nodes of segments as joints, with inverse bind matrices (column-major)."""
    inverse = np.tile(np.eye(4, dtype=np.float32), (len(rest), 1, 1))
    inverse[:, 3, :3] = -rest
    return {"joints": list(range(len(rest))), "skeleton": 0, "inverseBindMatrices": data.add(inverse)}


def _animation(data: _Data, motion: Motion, shown: list[int]) -> dict:
    """A rotation per segment `shown` and the root's translation, at every frame."""
    times = data.add((np.arange(len(motion.poses)) / motion.fps).astype(np.float32), bounds=True)
    turns = common.y_up_turns(common.local_rotations(motion))
    tracks = [("rotation", node, _quaternions(turns[:, segment])) for node, segment in enumerate(shown)]
    tracks.append(("translation", 0, y_up(motion.poses[:, :3])))
    samplers: list[dict] = []
    channels: list[dict] = []
    for path, node, values in tracks:
        channels.append({"sampler": len(samplers), "target": {"node": node, "path": path}})
        samplers.append({"input": times, "output": data.add(values.astype(np.float32))})
    return {"name": motion.name or "motion", "channels": channels, "samplers": samplers}


def _quaternions(rotations: np.ndarray) -> np.ndarray:
    """Unit quaternions (frames, 4), (x, y, z, w), with signs continuous over frames."""
    q = Rotation.from_matrix(rotations).as_quat()
    flips = np.where((q[1:] * q[:-1]).sum(-1) < 0, -1.0, 1.0)
    return q * np.cumprod([1.0, *flips])[:, None]
