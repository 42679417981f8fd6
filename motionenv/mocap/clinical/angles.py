"""Clinical joint angles: pelvis, hip, knee, ankle and foot progression, as gait laboratories report them.

Cardan angles in the order flexion, adduction, rotation (Grood & Suntay 1983; Kadaba et al. 1990), with Plug-in Gait's
signs: anterior tilt, up obliquity, internal rotation, flexion, adduction, varus and dorsiflexion are positive, and the
angles of the right side are those of a mirrored left.
"""

from dataclasses import dataclass

import numpy as np

from motionenv._core.representation import OneLine
from motionenv._core.rotations import to_euler
from motionenv._core.validation import checked_choice
from motionenv.body.kinematics import forward
from motionenv.body.skeleton import SEGMENTS
from motionenv.errors import GapError, MotionError
from motionenv.mocap.clinical.gait_model import SIGN
from motionenv.mocap.clinical.lower_body import WANDS, Calibration, Leg, LowerBody, calibrate, lower_body
from motionenv.mocap.clinical.measurements import Measurements, measurements_of
from motionenv.mocap.clinical.progression import progression
from motionenv.mocap.clinical.sagittal import is_flat, sagittal_angles
from motionenv.mocap.marker_sets import Landmarks, MarkerMap, find_landmarks
from motionenv.types import Markers, Motion

_EACH = (
    "pelvis_tilt", "pelvis_obliquity", "pelvis_rotation",
    "hip_flexion", "hip_adduction", "hip_rotation",
    "knee_flexion", "knee_adduction", "knee_rotation",
    "ankle_dorsiflexion", "ankle_adduction", "ankle_rotation",
    "foot_progression",
)  # fmt: skip

#: Names of the clinical angles, in the order of `ClinicalAngles.values`.
CLINICAL_ANGLES = tuple(f"{side}_{name}" for side in ("left", "right") for name in _EACH)


@dataclass(frozen=True, eq=False, repr=False)
class ClinicalAngles(OneLine):
    """Joint angles `values` (frames, 26), in the order of `CLINICAL_ANGLES` [degrees, ±180]; NaN where unknown.

    `fps` is the frame rate [Hz], `method` how the joint centres were found, `names` are `CLINICAL_ANGLES`, and `notes`
    tell what a reader should know, such as wands that can't be believed.
    """

    values: np.ndarray
    fps: float
    method: str
    names: tuple[str, ...] = CLINICAL_ANGLES
    notes: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> np.ndarray:
        """One angle (frames,) [degrees] by its name."""
        return self.values[:, self.names.index(name)]


def clinical_angles(
    capture: Markers | Motion, *, static: Markers | None = None, measurements: Measurements | None = None,
    marker_map: MarkerMap | str | None = None, wands: str = "auto",
) -> ClinicalAngles:  # fmt: skip
    """Joint angles of the lower body.

    From markers by the Conventional Gait Model, with the measurements that the file states (see `lower_body`). From a
    `Motion`, the angles of the body: its trunk stands for the pelvis, knees are hinges, and ankles are unknown. Where
    no marker shows the axis of a knee or ankle, rotations about it and angles across it are NaN. Of points in one
    plane, as of a film from the side, only flexion is known, and the hips' is relative to the trunk.

    Args:
        capture: markers (frames, points, 3), or a motion (frames, 25).
        static: a standing trial of the same person, with the same marker set.
        measurements: of the person; None takes them from the capture's file, or else from the standing trial's.
        marker_map: which points are which landmarks; None recognises the marker set by the names.
        wands: "use" the markers on thighs and shanks as the model does, "ignore" them, so that the pelvis' lateral axis
            gives the direction of the knees' and ankles', or "auto"; see `lower_body`.

    Raises:
        GapError: markers that show no leg with hip, knee and ankle.
        MotionError: not one sequence, an unknown marker set, or another value of `wands`.
    """
    checked_choice(wands, "wands", WANDS)
    if isinstance(capture, Motion):
        return ClinicalAngles(_of_motion(capture), capture.fps, "joints of the body; the trunk stands for the pelvis")
    landmarks = find_landmarks(capture, marker_map)
    if is_flat(capture.positions):
        return _of_plane(landmarks, len(capture.positions))
    person, calibration = person_of(capture, static=static, measurements=measurements, marker_map=marker_map)
    body = lower_body(landmarks.positions, person, calibration, wands=wands)
    if body.left.shank is None and body.right.shank is None:
        raise GapError(
            f"{capture.name or 'this capture'} shows no leg with hip, knee and ankle, so it has no clinical angles; "
            f"recognised are {', '.join(landmarks.points) or 'no landmarks'}"
        )
    how = "; ".join([*(f"{joint}: {text}" for joint, text in body.how.items()), *landmarks.notes])
    notes = tuple(f"{k}: {v}; wands= (--wands) chooses" for k, v in body.how.items() if k.startswith("wands"))
    return ClinicalAngles(_of_body(body, capture.fps), capture.fps, how, notes=notes)


def _of_plane(landmarks: Landmarks, frames: int) -> ClinicalAngles:
    known = sagittal_angles(landmarks.positions)
    if not known:
        raise GapError(f"this capture is flat and shows no leg; recognised are {', '.join(landmarks.points)}")
    unknown = np.full(frames, np.nan)
    values = np.stack([known.get(name, unknown) for name in CLINICAL_ANGLES], -1)
    how = "all points lie in one plane, so flexion only, the hips' relative to the trunk"
    return ClinicalAngles(wrapped(values), landmarks.fps, how)


def person_of(
    capture: Markers, *, static: Markers | None = None, measurements: Measurements | None = None,
    marker_map: MarkerMap | str | None = None,
) -> tuple[Measurements, Calibration | None]:  # fmt: skip
    """A person's measurements, and what a standing trial adds to them.

    Args:
        capture, static, measurements, marker_map: as in `clinical_angles`.
    """
    known = measurements or measurements_of(capture.recording)
    if static is None:
        return known, None
    if measurements is None and not known.given:
        known = measurements_of(static.recording)
    return known, calibrate(find_landmarks(static, marker_map).positions, known)


def _of_body(body: LowerBody, fps: float) -> np.ndarray:
    """The clinical angles (frames, 26) of the segments of a lower body."""
    base = None if body.pelvis is None else body.pelvis.rotation
    ways = None if body.pelvis is None else progression(body.pelvis.origin, body.pelvis.rotation, fps)
    frames = next(len(s) for s in (body.left.shank, body.right.shank) if s is not None)
    sides = [_of_leg(getattr(body, side), base, ways, SIGN[side], frames) for side in ("left", "right")]
    return np.concatenate(sides, axis=1)


def _of_leg(leg: Leg, base: np.ndarray | None, ways: np.ndarray | None, sign: float, frames: int) -> np.ndarray:
    """The clinical angles (frames, 13) of one side, whose lateral axis is y times `sign`."""
    pelvis = _relative(ways, base, frames) * [1.0, sign, -sign]
    hip = _relative(base, leg.thigh, frames) * [-1.0, -sign, -sign if leg.knee_axis else np.nan]
    frontal = -sign if leg.knee_axis else np.nan
    c, s = np.cos(leg.torsion), np.sin(leg.torsion)
    below_knee = None if leg.shank is None else leg.shank @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    knee = _relative(leg.thigh, below_knee, frames) * [1.0, frontal, frontal]
    # The foot's z points back along it, so that dorsiflexion is the complement of the angle about y.
    foot = _relative(leg.shank, leg.foot, frames)
    turned = -sign if leg.ankle_axis else np.nan
    ankle = np.column_stack([-90.0 - foot[:, 0], turned * foot[:, 2], turned * foot[:, 1]])
    way = -sign * _relative(ways, leg.foot, frames)[:, 1:2]
    return wrapped(np.concatenate([pelvis, hip, knee, ankle, way], axis=1))


def wrapped(degrees: np.ndarray) -> np.ndarray:
    """Angles [degrees] of any shape, from -180 to below 180."""
    return (degrees + 180.0) % 360.0 - 180.0


def _of_motion(motion: Motion) -> np.ndarray:
    """The clinical angles (frames, 26) that the 25-DOF body has: of hips and knees."""
    if motion.poses.ndim != 2:
        raise MotionError(f"clinical angles need one motion (frames, 25), got {motion.poses.shape}")
    turns = forward(motion.poses, motion.skeleton)[1]
    trunk, frames = turns[:, SEGMENTS.index("torso")], len(turns)
    sides = []
    for side, sign in SIGN.items():
        thigh, shank = (turns[:, SEGMENTS.index(f"{side}_{name}")] for name in ("thigh", "shin"))
        hip = _relative(trunk, thigh, frames) * [-1.0, -sign, -sign]
        knee = _relative(thigh, shank, frames)[:, :1]
        unknown = np.full((frames, 1), np.nan)
        sides += [np.repeat(unknown, 3, axis=1), hip, knee, np.repeat(unknown, 6, axis=1)]
    return np.concatenate(sides, axis=1)


def _relative(parent: np.ndarray | None, child: np.ndarray | None, frames: int) -> np.ndarray:
    """Cardan angles (frames, 3) [degrees] about y, x and z of one segment relative to another; NaN where unknown."""
    if parent is None or child is None:
        return np.full((frames, 3), np.nan)
    return np.degrees(to_euler("YXZ", parent.swapaxes(-1, -2) @ child))
