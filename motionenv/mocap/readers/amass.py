"""NPZ files of AMASS and of models of the SMPL family: poses of the body model, or positions of its joints.

Mahmood et al. 2019, "AMASS: Archive of motion capture as surface shapes"; the body models are SMPL (Loper et al. 2015),
SMPL-H (Romero et al. 2017) and SMPL-X (Pavlakos et al. 2019). AMASS's world is z up.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from motionenv._core.rotations import from_rotation_vector
from motionenv._core.validation import checked_fps
from motionenv.errors import FormatError
from motionenv.mocap.npz import load_arrays
from motionenv.mocap.readers.text import read_bytes
from motionenv.mocap.units_axes import box, forward, metres_per, unit_proposal, upright, vertical_axis
from motionenv.types import Markers

_BODY = (
    "pelvis", "left_hip", "right_hip", "spine1", "left_knee", "right_knee", "spine2", "left_ankle", "right_ankle",
    "spine3", "left_foot", "right_foot", "neck", "left_collar", "right_collar", "head", "left_shoulder",
    "right_shoulder", "left_elbow", "right_elbow", "left_wrist", "right_wrist",
)  # fmt: skip
_FINGERS = tuple(
    f"{side}_{finger}{i}" for side in ("left", "right") for finger in ("index", "middle", "pinky", "ring", "thumb")
    for i in (1, 2, 3)
)  # fmt: skip
#: Joints of SMPL, SMPL-H and SMPL-X by their number, and those of the body alone, which all have in common.
JOINTS = {
    22: _BODY, 24: (*_BODY, "left_hand", "right_hand"), 52: (*_BODY, *_FINGERS),
    55: (*_BODY, "jaw", "left_eye", "right_eye", *_FINGERS),
}  # fmt: skip
_POSITIONS = ("joints", "Jtr", "jtr", "joint_positions", "joints3d", "joints_3d", "keypoints3d")
_RATES = ("mocap_framerate", "mocap_frame_rate", "framerate", "frame_rate", "fps")
_PARTS = ("root_orient", "pose_body")  # of `poses`, in this order
_PEOPLE = (0.5, 3.0)  # [m] plausible longest side of the box around a person's joints


def is_amass(keys: Iterable[str]) -> bool:
    """Whether an NPZ file with arrays of these names is one of `read`'s."""
    found = set(keys)
    return bool(found & {"poses", "root_orient", *_POSITIONS}) and "format" not in found


def read(
    path: str | Path, fps: float | None = None, unit: str | float | None = None, up: str | None = None,
    body_model: str | Path | None = None, override: bool = True,
) -> Markers:  # fmt: skip
    """Read the joints of an AMASS file: the positions in it, or those that a body model gives its poses and shape.

    Points are named as in the body models: "pelvis", "left_hip", "spine1" ...; for poses they have rotations too.

    Args:
        path: an NPZ file with `poses` (frames, 66, 72, 156 or 165) [rad], `trans` (frames, 3) [m] and `betas`, or with
            `joints` (frames, 22, 24, 52 or 55, 3), positions. SMPL-X's `root_orient` and `pose_body` do for `poses`.
        fps: frame rate; overrides the file's `mocap_framerate`.
        unit: of positions, which are metres by default; see `motionenv.mocap.read`.
        up: vertical axis, "x", "y" or "z". None is z for poses; for positions, that along which the person extends, or
            z if it isn't clear.
        body_model: for poses, the NPZ file of the body model, with J_regressor, v_template, shapedirs and
            kintree_table; it has to be obtained from its authors.
        override: whether `fps` and `unit` replace what the file states, metres for positions of a person's size; False
            uses them only where it states nothing.

    Raises:
        FormatError: another kind of file, a damaged one, or a body model, frame rate or unit that must be given.
    """
    arrays = _load(path, {*_POSITIONS, *_RATES, *_PARTS, "poses", "trans", "betas", "gender"})
    stated = next((float(arrays[key]) for key in _RATES if key in arrays and np.size(arrays[key]) == 1), np.nan)
    if fps is None or (0 < stated < np.inf and not override):
        fps = stated
    if not 0 < fps < np.inf:
        raise FormatError(path, f"doesn't specify its frame rate; pass fps= (--fps), {_RATES[0]} in AMASS", _RATES[0])
    fps = checked_fps(fps)
    key = next((key for key in _POSITIONS if key in arrays), None)
    if key is not None and body_model is None:
        names, positions = _joints(path, key, arrays[key], unit, up, override)
        return Markers(names, positions, fps, name=Path(path).stem)
    if unit is not None and override:
        raise FormatError(path, "unit can't be given for poses of a body model: its file gives metres")
    return _posed(path, arrays, body_model, fps, up or "z")


def _load(path, wanted: set[str]) -> dict[str, np.ndarray]:
    found, held = load_arrays(read_bytes(path), path, wanted)
    if not found:
        raise FormatError(path, f"is an NPZ file of another kind: it has {', '.join(held[:8]) or 'no arrays'}")
    return found


def _joints(
    path, key: str, values: np.ndarray, unit, up: str | None, override: bool
) -> tuple[tuple[str, ...], np.ndarray]:
    """Names and positions [m], z up, of joints that are given as positions."""
    points = np.asarray(values, dtype=np.float64) if np.issubdtype(values.dtype, np.number) else np.empty(0)
    if points.ndim == 3 and points.shape[1] > max(JOINTS):  # SMPL-X's are followed by vertices and landmarks
        points = points[:, : max(JOINTS)]
    if points.ndim != 3 or points.shape[1] not in JOINTS or points.shape[2] != 3 or not len(points):
        counts = ", ".join(map(str, JOINTS))
        problem = f"must have shape (frames, {counts}, 3), positions of SMPL's joints, got {values.shape}"
        raise FormatError(path, problem, key)
    size = box(points).max()
    plausible = not size > 0 or _PEOPLE[0] <= size <= _PEOPLE[1]
    if unit is not None and (override or not plausible):
        points = points * metres_per(unit)
    elif not plausible:
        raise FormatError(path, f"in metres the joints would span {size:.3g} m; {unit_proposal(points)}", key)
    return JOINTS[points.shape[1]], upright(points, up or vertical_axis(points, "z"))


def _posed(path, arrays: dict[str, np.ndarray], body_model, fps: float, up: str) -> Markers:
    poses = _poses(path, arrays)
    trans = _numbers(path, "trans", arrays.get("trans", np.zeros((len(poses), 3))), (len(poses), 3))
    betas = np.asarray(arrays.get("betas", np.zeros(0)), dtype=np.float64)
    betas = betas.reshape(-1, betas.shape[-1])[0] if betas.size else np.zeros(0)
    if body_model is None:
        gender = str(arrays.get("gender", "neutral")).strip("b'\"") or "neutral"
        raise FormatError(
            path, f"has poses and the shape of a {gender} body, not positions of joints: those need the body model's "
            f"NPZ file, such as smplh/{gender}/model.npz from its authors; pass body_model= (--body-model)", "poses",
        )  # fmt: skip
    model = _read_model(body_model)
    many = poses.shape[1] if poses.shape[1] == len(model.parents) else len(_BODY)
    if min(poses.shape[1], len(model.parents)) < many:
        problem = f"has {poses.shape[1]} joints, and the body model {len(model.parents)}; both need the body's {many}"
        raise FormatError(path, problem, "poses")
    rest = model.joints(betas)[:many]
    parents = model.parents[:many]
    offsets = np.array([rest[j] - rest[p] if p >= 0 else rest[j] for j, p in enumerate(parents)])
    moved = np.tile(offsets, (len(poses), 1, 1))
    moved[:, 0] += trans
    positions, rotations = forward(parents, moved, from_rotation_vector(poses[:, :many]), up)
    names = JOINTS.get(many) or (*_BODY, *(f"joint_{j}" for j in range(len(_BODY), many)))
    return Markers(names, positions, fps, parents, rotations, Path(path).stem)


def _poses(path, arrays: dict[str, np.ndarray]) -> np.ndarray:
    poses = arrays.get("poses")
    if poses is None and {"root_orient", "pose_body"} <= set(arrays):
        poses = np.concatenate([arrays["root_orient"], arrays["pose_body"]], axis=-1)
    if poses is None:
        raise FormatError(path, "has neither poses nor positions of joints", "poses")
    if poses.ndim == 3 and poses.shape[-1] == 3:
        poses = poses.reshape(len(poses), -1)
    if poses.ndim != 2 or poses.shape[1] % 3 or poses.shape[1] < 3 * len(_BODY) or not len(poses):
        problem = f"must have shape (frames, 66, 72, 156 or 165), rotation vectors, got {poses.shape}"
        raise FormatError(path, problem, "poses")
    return _numbers(path, "poses", poses, poses.shape).reshape(len(poses), -1, 3)


def _numbers(path, key: str, values: np.ndarray, shape: tuple) -> np.ndarray:
    good = np.issubdtype(values.dtype, np.number) and values.shape == shape
    if not good or not np.isfinite(values).all():
        raise FormatError(path, f"must have shape {shape} and finite values, got {values.shape}", key)
    return values.astype(np.float64)


@dataclass(frozen=True)
class _BodyModel:
    """Joints [m] of the mean shape (J, 3), their displacement per unit of the `betas` (J, 3, shapes), and parents."""

    template: np.ndarray
    directions: np.ndarray
    parents: tuple[int, ...]

    def joints(self, betas: np.ndarray) -> np.ndarray:
        """Joints (J, 3) [m] in the rest pose: J_regressor (v_template + shapedirs betas); SMPL, equation 10."""
        n = min(len(betas), self.directions.shape[-1])
        return self.template + self.directions[..., :n] @ betas[:n]


def _read_model(path) -> _BodyModel:
    if Path(path).suffix.lower() in (".pkl", ".pickle"):
        raise FormatError(
            path, "body models are read as NPZ, for pickles can run code: download the NPZ version, or convert the "
            'pickle yourself: m = pickle.load(open(FILE, "rb"), encoding="latin1"), then numpy.savez("model.npz", '
            'J_regressor=m["J_regressor"].toarray(), v_template=m["v_template"], '
            'shapedirs=numpy.array(m["shapedirs"]), kintree_table=m["kintree_table"])',
        )  # fmt: skip
    wanted = ("J_regressor", "v_template", "shapedirs", "kintree_table")
    arrays = _load(path, set(wanted))
    if missing := [key for key in wanted if key not in arrays]:
        raise FormatError(path, f"isn't a body model: it has no {', '.join(missing)}")
    regressor, template, shapes, table = (arrays[key] for key in wanted)
    joints, vertices = regressor.shape if regressor.ndim == 2 else (0, 0)
    fits = template.shape == (vertices, 3) and shapes.shape[:2] == (vertices, 3) and shapes.ndim == 3
    if not fits or table.shape != (2, joints) or joints < len(_BODY):
        got = ", ".join(f"{key} {arrays[key].shape}" for key in wanted)
        raise FormatError(path, f"isn't a body model: the shapes don't fit: {got}")
    parents = tuple(int(p) if 0 <= int(p) < j else -1 for j, p in enumerate(table[0]))
    if parents.count(-1) != 1 or parents[0] != -1:
        raise FormatError(path, "isn't a body model: its joints must follow their parents", "kintree_table")
    directions = np.einsum("jv,vcs->jcs", regressor.astype(np.float64), shapes.astype(np.float64), optimize=True)
    return _BodyModel(regressor.astype(np.float64) @ template, directions, parents)
