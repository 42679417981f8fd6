"""RRD writer: a recording for the Rerun viewer (rerun.io), with rerun-sdk, of which 0.41 or later must be installed.

Everything is on one timeline, "time" in seconds since the first frame, in metres, z up:

    world/markers, world/skeleton       the 15 markers, and the lines between them
    world/body/left_thigh, ...          the moving, coloured body, one mesh per segment
    world/camera, world/camera/picture  a camera and what it saw
    joint_angles/left/knee_flexion ...  the pose vector's joint angles [degrees]
    clinical_angles/left/...            angles that were passed [degrees]
    events                              "left initial contact", ...

What is unknown isn't there: a limb without known pose disappears until it is known again.
"""

import hashlib
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from motionenv.body.kinematics import forward
from motionenv.body.kinematics import markers as body_markers
from motionenv.body.meshes import limb_meshes
from motionenv.body.skeleton import CLOTHES, COLOURS, EDGES, LIMB_SEGMENT, SEGMENT_ORIGIN, SEGMENTS
from motionenv.errors import MotionError
from motionenv.mocap.writers._rerun_log import Log, check_installed
from motionenv.mocap.writers.common import Angles, check_sequence, checked_angles, save
from motionenv.types import ANGLES, MARKERS, Camera, Event, Motion

__all__ = ["check_installed", "parts", "write_rrd"]

_SECTIONS = 24  # vertices around a limb
_QUALITY = 95  # of JPEG pictures
_SKELETON = (120, 120, 120)


def parts(motion: Motion, events: Sequence[Event] = (), angles: Angles | None = None) -> Iterator[bytes]:
    """The bytes of `write_rrd` for a `motion`, its `events` and `angles`; rerun numbers its chunks anew each time."""
    return iter([_encoded(motion, None, None, events, angles)])


def write_rrd(
    motion: Motion, path: str | Path, *, camera: Camera | None = None, pictures: Iterable[np.ndarray] | None = None,
    events: Sequence[Event] = (), angles: Angles | None = None,
) -> None:  # fmt: skip
    """Write a motion and what belongs to it as a recording for the Rerun viewer, atomically.

    Args:
        motion: one sequence (frames, 25); what is unknown is left out.
        path: the file.
        camera: who sees the motion; it stands still.
        pictures: what the camera saw, one per frame: an array (frames, height, width, 3) or an iterable of arrays
            (height, width, 3), uint8 of sRGB. They are stored as JPEG, and kept in memory as such until written.
        events: of the motion.
        angles: clinical angles of the motion [degrees].

    Raises:
        MotionError: not one sequence, pictures without a camera, of another size or number, angles of other frames,
            rerun-sdk isn't installed, or the file can't be written.
    """
    save([_encoded(motion, camera, pictures, events, angles)], path)


def _encoded(
    motion: Motion, camera: Camera | None, pictures: Iterable[np.ndarray] | None, events: Sequence[Event],
    angles: Angles | None,
) -> bytes:  # fmt: skip
    check_sequence(motion, "RRD", gaps=True)
    if pictures is not None and camera is None:
        raise MotionError("pictures are shown in a camera: pass camera= too")
    columns = {} if angles is None else checked_angles(angles, len(motion.poses))
    log = Log(_identity(motion, events, columns), motion.name, motion.fps)
    points = body_markers(motion.poses, motion.skeleton)
    log.points("world/markers", points, MARKERS)
    log.lines("world/skeleton", points[:, np.array(EDGES)], _SKELETON)
    _log_body(log, motion)
    for name, values in zip(ANGLES, np.degrees(motion.poses[:, 6:]).T, strict=True):
        log.scalars(f"joint_angles/{_path(name)}", values)
    for name, values in columns.items():
        log.scalars(f"clinical_angles/{_path(name)}", values)
    log.texts("events", [(e.time, f"{e.side} {e.kind.replace('_', ' ')}") for e in events])
    if camera is not None:
        log.camera("world/camera", camera)
    if camera is not None and pictures is not None:
        _log_pictures(log, pictures, camera, len(motion.poses))
    log.views(camera is not None)
    return log.encoded()


def _identity(motion: Motion, events: Sequence[Event], angles: dict[str, np.ndarray]) -> str:
    """The recording's id, which depends on nothing but its content (pictures aside)."""
    body = motion.skeleton
    digest = hashlib.sha256(repr((motion.fps, motion.name, body.height, tuple(events), tuple(angles))).encode())
    for array in (motion.poses, body.offsets, body.radii, *angles.values()):
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()[:32]


def _path(name: str) -> str:
    """Angles of a side are in one folder: "left_knee_flexion" → "left/knee_flexion"."""
    side, _, rest = name.partition("_")
    return f"{side}/{rest}" if side in ("left", "right") else name


def _log_body(log: Log, motion: Motion) -> None:
    """A mesh per segment, which moves."""
    nodes, rotations = forward(motion.poses, motion.skeleton)
    meshes = limb_meshes(motion.skeleton, _SECTIONS)
    for segment, name in enumerate(SEGMENTS):
        limbs = [limb for limb, of in enumerate(LIMB_SEGMENT) if of == segment]
        sizes = [len(meshes[limb].vertices) for limb in limbs]
        first = np.cumsum([0, *sizes[:-1]])
        colours = np.repeat([COLOURS[CLOTHES[limb]] for limb in limbs], sizes, axis=0)
        log.moving_mesh(
            f"world/body/{name}", nodes[:, SEGMENT_ORIGIN[segment]], rotations[:, segment],
            vertex_positions=np.concatenate([meshes[limb].vertices for limb in limbs]),
            vertex_normals=np.concatenate([meshes[limb].normals for limb in limbs]),
            triangle_indices=np.concatenate([meshes[limb].faces + i for i, limb in zip(first, limbs, strict=True)]),
            vertex_colors=np.round(255 * colours).astype(np.uint8),
        )  # fmt: skip


def _log_pictures(log: Log, pictures: Iterable[Any], camera: Camera, frames: int) -> None:
    expected = (camera.height, camera.width, 3)
    count = 0
    for picture in map(np.asarray, pictures):
        if picture.shape != expected or picture.dtype != np.uint8 or count == frames:
            raise MotionError(
                f"pictures must be {frames} of shape {expected}, uint8, one per frame as the camera sees it; "
                f"got {picture.shape}, {picture.dtype} as number {count + 1}"
            )
        log.picture("world/camera/picture", picture, count, _QUALITY)
        count += 1
    if count != frames:
        raise MotionError(f"pictures must be {frames}, one per frame, got {count}")
