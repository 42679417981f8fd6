"""The types that pass between modules, as frozen dataclasses, and the canonical orders of names.

SI units throughout: metres, radians, seconds, frames per second. World frame: right-handed, x forward (the direction of
walking), y left, z up, ground at z = 0. Missing values are NaN. Arrays are read-only copies.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from html import escape
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.representation import OneLine, counted, curves, figures, picture, some
from motionenv._core.validation import PICTURE_SIZES, checked_fps, checked_whole, did_you_mean
from motionenv.errors import MotionError

#: The 15 markers of Zhang & Troje (2007, fig. 1), in the order of every (..., 15, 3) array.
MARKERS = (
    "head", "sternum", "pelvis",
    "left_shoulder", "right_shoulder", "left_elbow", "right_elbow", "left_wrist", "right_wrist",
    "left_hip", "right_hip", "left_knee", "right_knee", "left_ankle", "right_ankle",
)  # fmt: skip

#: The 25 entries of the pose vector (Ormoneit et al. 2005, fig. 1); `motionenv.body` says what each means.
POSE = (
    "root_x", "root_y", "root_z", "root_tilt", "root_obliquity", "root_heading",
    "neck_flexion", "neck_bend", "neck_rotation",
    "left_shoulder_flexion", "left_shoulder_abduction", "left_shoulder_rotation", "left_elbow_flexion",
    "right_shoulder_flexion", "right_shoulder_abduction", "right_shoulder_rotation", "right_elbow_flexion",
    "left_hip_flexion", "left_hip_abduction", "left_hip_rotation", "left_knee_flexion",
    "right_hip_flexion", "right_hip_abduction", "right_hip_rotation", "right_knee_flexion",
)  # fmt: skip

#: The 19 relative joint angles, the part of the pose vector that paper A models.
ANGLES = POSE[6:]

#: Least and greatest value, and unit, of what can be asked of models and bodies through every interface.
SPEED_RANGE = (0.1, 3.0, "m/s")  # of who walks
HEIGHT_RANGE = (0.5, 2.5, "metres")  # of a standing body
WEIGHT_RANGE = (10.0, 300.0, "kg")
FPS_RANGE = (1.0, 1000.0, "frames per second")  # of what a model makes

#: Kinds of people that are drawn; children are 6 to 17 years old.
PEOPLE = ("adult", "woman", "man", "child", "girl", "boy")
SECONDS_MOST = 3600.0  # of what a model makes at a time


def frozen(values: ArrayLike, shape: tuple, name: str, dtype: type = np.float64) -> np.ndarray:
    """A read-only copy of `values` with the required `shape`, in which `...` may come first and None is any size.

    Raises:
        MotionError: not numeric, or another shape; names the field and both shapes.
    """
    try:
        array: np.ndarray = np.array(values, dtype=dtype)
    except (TypeError, ValueError) as error:
        raise MotionError(f"{name} must be numeric of shape {shape_text(shape)}: {error}") from None
    want = shape[1:] if shape and shape[0] is ... else shape
    have = array.shape[array.ndim - len(want) :] if shape and shape[0] is ... else array.shape
    if len(have) != len(want) or any(w is not None and w != h for w, h in zip(want, have, strict=True)):
        raise MotionError(f"{name} must have shape {shape_text(shape)}, got {array.shape}")
    array.flags.writeable = False
    return array


def shape_text(shape: tuple) -> str:
    """`shape` in the notation of error messages: (..., n, 3)."""
    return "(" + ", ".join("..." if s is ... else "n" if s is None else str(s) for s in shape) + ")"


class _Record(OneLine):
    """Base of frozen dataclasses with validated fields, which pickles their fields."""

    def _set(self, **values):
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def __setstate__(self, state):
        self.__init__(**{f.name: state[f.name] for f in fields(self) if f.init})  # type: ignore[misc, arg-type]


@dataclass(frozen=True, eq=False, repr=False)
class Skeleton(_Record):
    """The cylinder body of one person: joint offsets and limb radii.

    Build one with `motionenv.body.from_height` or from a capture with `motionenv.body.fit_skeleton`.

    Attributes:
        offsets: (16, 3) [m], one row per node of `motionenv.body.NODES` (the 15 markers, then the neck joint),
            each in the frame of the segment that carries it.
        radii: (22, 2) [m], radius at the start and the end of each drawn limb of `motionenv.body.LIMBS`.
        height: standing height [m], sole to crown.

    Raises:
        MotionError: arrays of other shapes, an infinite or unknown value, or a radius or height that isn't above 0.
    """

    offsets: np.ndarray
    radii: np.ndarray
    height: float

    def __post_init__(self) -> None:
        self._set(
            offsets=frozen(self.offsets, (16, 3), "Skeleton.offsets"),
            radii=frozen(self.radii, (22, 2), "Skeleton.radii"),
            height=float(self.height),
        )
        for name, least in (("offsets", -np.inf), ("radii", 0.0), ("height", 0.0)):
            values = np.ravel(getattr(self, name))
            bad = values[~((values > least) & (values < np.inf))]
            if len(bad):
                raise MotionError(f"Skeleton.{name} must be finite and above {least:g}, got {bad[0]:g}")

    def _shown(self) -> str:
        return f"{self.height:.2f} m"


@dataclass(frozen=True, eq=False, repr=False)
class Motion(_Record):
    """Poses of one body over time.

    Attributes:
        poses: (..., frames, 25), the pose vector in the order of `POSE` [m, rad]; NaN where unknown. A capture of the
            lower body has NaN in the neck's and the arms' entries of every frame.
        skeleton: the body.
        fps: frame rate [Hz].
        name: label of the source.
        filled: (..., frames, 25) bool, True where a model and not the capture gave the value; None if nowhere.
        notes: what the reader of the capture had to decide; files of motions don't keep them.
    """

    poses: np.ndarray
    skeleton: Skeleton
    fps: float
    name: str = ""
    filled: np.ndarray | None = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        self._set(poses=frozen(self.poses, (..., None, 25), "Motion.poses"), fps=checked_fps(self.fps))
        if not isinstance(self.skeleton, Skeleton):
            raise MotionError(f"Motion.skeleton must be a Skeleton, got {type(self.skeleton).__name__}")
        if self.filled is not None:
            self._set(filled=frozen(self.filled, self.poses.shape, "Motion.filled", dtype=bool))

    def _shown(self) -> str:
        height = f"{self.skeleton.height:.2f} m"
        return f"{_counts(self.poses.shape[:-1])}, {self.fps:g} fps, {height}{_rest(self.name, self.poses)}"

    def _repr_html_(self) -> str:
        """A strip of stick figures, for notebooks."""
        body = import_module("motionenv.body")  # a later stage, needed in notebooks only
        poses = self.poses.reshape(-1, *self.poses.shape[-2:])[:1].reshape(-1, 25)
        points = body.markers(poses[some(len(poses))], self.skeleton)
        return figures(points, body.EDGES, escape(repr(self)))

    @property
    def angles(self) -> np.ndarray:
        """The 19 relative joint angles, (..., frames, 19) [rad]."""
        return self.poses[..., 6:]

    @property
    def seconds(self) -> float:
        """Duration [s]."""
        return self.poses.shape[-2] / self.fps


@dataclass(frozen=True)
class Event:
    """A foot meets or leaves the ground.

    Attributes:
        time: since the first frame [s].
        kind: "initial_contact" or "toe_off".
        side: "left" or "right".
    """

    time: float
    kind: str
    side: str

    def __post_init__(self) -> None:
        if self.kind not in ("initial_contact", "toe_off") or self.side not in ("left", "right"):
            raise MotionError(
                "an Event is an initial_contact or toe_off of the left or right side, "
                f"got {self.kind!r} of {self.side!r}"
            )


@dataclass(frozen=True, eq=False, repr=False)
class ForcePlate(_Record):
    """One force plate of a capture.

    Attributes:
        corners: (4, 3) [m], world frame.
        force: (samples, 3) [N] of the ground on the foot, world frame.
        centre: (samples, 3) [m] centre of pressure, world frame; NaN where the plate is unloaded.
        fps: sampling rate [Hz]; sample 0 is at the time of the first frame.
    """

    corners: np.ndarray
    force: np.ndarray
    centre: np.ndarray
    fps: float

    def __post_init__(self) -> None:
        force = frozen(self.force, (None, 3), "ForcePlate.force")
        self._set(
            corners=frozen(self.corners, (4, 3), "ForcePlate.corners"), force=force,
            centre=frozen(self.centre, (len(force), 3), "ForcePlate.centre"), fps=checked_fps(self.fps),
        )  # fmt: skip


@dataclass(frozen=True, eq=False, repr=False)
class Recording(_Record):
    """Contents of a capture file beside its points.

    Attributes:
        subject: label of the person; "" if the file doesn't name one.
        first_frame: number of the first frame in the file.
        events: in the order of time.
        plates: the force plates.
        parameters: single numbers by "GROUP:NAME", such as "PROCESSING:LLEGLENGTH", in capitals, in the file's units.
        metres: per unit of length of the file; what `parameters` are to be multiplied by.
        outputs: other programs' results that the file stores as points, such as "LKneeAngles": (frames, 3) in the
            file's units (angles in degrees), by name without the subject's.
    """

    subject: str = ""
    first_frame: int = 1
    events: tuple[Event, ...] = ()
    plates: tuple[ForcePlate, ...] = ()
    parameters: dict[str, float] = field(default_factory=dict)
    metres: float = 1.0
    outputs: dict[str, np.ndarray] = field(default_factory=dict)


@dataclass(frozen=True, eq=False, repr=False)
class Markers(_Record):
    """Named points over time: optical markers, or the joints of a captured hierarchy.

    Attributes:
        names: one per point, as in the source.
        positions: (..., frames, points, 3) [m], world frame, z up; NaN in gaps.
        fps: frame rate [Hz].
        parents: for joints of a hierarchy, the index of each one's parent (-1 for a root); else None.
        rotations: for joints of a hierarchy, (..., frames, points, 3, 3), joint → world; else None.
        name: label of the source.
        recording: what the file holds beside its points; None if nothing.
        notes: what the reader of the file had to decide, such as which of several people it took.
    """

    names: tuple[str, ...]
    positions: np.ndarray
    fps: float
    parents: tuple[int, ...] | None = None
    rotations: np.ndarray | None = None
    name: str = ""
    recording: Recording | None = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        names = tuple(str(n) for n in self.names)
        n = len(names)
        self._set(
            names=names,
            positions=frozen(self.positions, (..., None, n, 3), "Markers.positions"),
            fps=checked_fps(self.fps),
        )
        if self.parents is not None:
            self._set(parents=tuple(int(p) for p in self.parents))
            if len(self.parents) != n or any(not -1 <= p < i for i, p in enumerate(self.parents)):
                raise MotionError(f"Markers.parents must hold {n} indices, each -1 or of an earlier joint")
        if self.rotations is not None:
            self._set(rotations=frozen(self.rotations, (..., None, n, 3, 3), "Markers.rotations"))

    def _shown(self) -> str:
        points = counted(len(self.names), "point" if self.parents is None else "joint")
        rest = _rest(self.name, self.positions)
        return f"{_counts(self.positions.shape[:-2])}, {points}, {self.fps:g} fps{rest}"

    def index(self, name: str) -> int:
        """Index of the point `name`.

        Raises:
            MotionError: no such point; lists the names.
        """
        if name not in self.names:
            nearest = did_you_mean(name, self.names)
            raise MotionError(f"there is no point {name!r}; available are {', '.join(self.names)}{nearest}")
        return self.names.index(name)


@dataclass(frozen=True, eq=False, repr=False)
class Points(_Record):
    """The 15 markers in the image of one camera: the input of lifting.

    Attributes:
        positions: (frames, 15, 2) in the order of `MARKERS`; NaN in gaps. Metres with the second axis upwards, or
            pixels with the second axis downwards, as in OpenCV.
        fps: frame rate [Hz].
        unit: "m" or "px".
        truth: the 3D walk (frames, 15, 3) in the image, if known.
        name: label of the source.
        confidence: (frames, 15) from 0 to 1, what the detector said of each point; NaN or 0 for missing points. None
            if nothing was said.
        feet: (frames, 4, 2) left heel and toe, right heel and toe, as `positions`; None if they aren't known.
    """

    positions: np.ndarray
    fps: float
    unit: str
    truth: Markers | None = None
    name: str = ""
    confidence: np.ndarray | None = None
    feet: np.ndarray | None = None

    def __post_init__(self) -> None:
        positions = frozen(self.positions, (None, len(MARKERS), 2), "Points.positions")
        self._set(positions=positions, fps=checked_fps(self.fps))
        if np.isinf(positions).any():
            raise MotionError("Points.positions has infinite values: use NaN for missing points")
        if self.unit not in ("m", "px"):
            raise MotionError(f"Points.unit must be m (metres, upwards) or px (pixels, downwards), got {self.unit!r}")
        if self.truth is not None and self.truth.positions.shape != (*positions.shape[:2], 3):
            raise MotionError(f"Points.truth must have shape {positions.shape[:2]}, got {self.truth.positions.shape}")
        if self.confidence is not None:
            confidence = frozen(self.confidence, positions.shape[:2], "Points.confidence")
            if ((confidence < 0) | (confidence > 1)).any():
                raise MotionError("Points.confidence must be from 0 to 1, or NaN for missing points")
            self._set(confidence=confidence)
        if self.feet is not None:
            self._set(feet=frozen(self.feet, (len(positions), 4, 2), "Points.feet"))

    def _shown(self) -> str:
        rest = _rest(self.name, self.positions)
        return f"{_counts(self.positions.shape[:-2])}, {self.fps:g} fps, in {self.unit}{rest}"

    @property
    def upward(self) -> np.ndarray:
        """Positions (frames, 15, 2) with the second axis upwards in either unit."""
        return self.positions if self.unit == "m" else self.positions * [1.0, -1.0]


@dataclass(frozen=True, eq=False, repr=False)
class Cycles(_Record):
    """Motion cycles in a common reference domain (paper A, section 3.4): the unrolled design matrix X⁽¹⁾.

    Attributes:
        values: (cycles, samples, channels); sample j is at phase j / samples of its cycle (the duplicate end point is
            dropped). NaN where the source has gaps, and outside of it.
        channels: a name per channel, from `POSE` if they are entries of the pose vector.
        seconds: (cycles,) duration of each cycle [s].
        sequence: (cycles,) index of the sequence of each cycle.
        subject: (cycles,) label of the person.
        drift: (cycles, channels) by which each channel changed from the beginning of its cycle to the end, if that was
            taken out to close the cycles; else None.
    """

    values: np.ndarray
    channels: tuple[str, ...]
    seconds: np.ndarray
    sequence: np.ndarray
    subject: tuple[str, ...]
    drift: np.ndarray | None = None

    def __post_init__(self) -> None:
        channels = tuple(str(c) for c in self.channels)
        values = frozen(self.values, (None, None, len(channels)), "Cycles.values")
        k = len(values)
        self._set(
            values=values, channels=channels, seconds=frozen(self.seconds, (k,), "Cycles.seconds"),
            sequence=frozen(self.sequence, (k,), "Cycles.sequence", dtype=np.intp),
            subject=tuple(str(s) for s in self.subject),
        )  # fmt: skip
        if self.drift is not None:
            self._set(drift=frozen(self.drift, (k, len(channels)), "Cycles.drift"))
        if len(self.subject) != k:
            raise MotionError(f"Cycles.subject must hold {k} labels, got {len(self.subject)}")

    @property
    def shape(self) -> tuple[int, ...]:
        """(cycles, samples, channels)."""
        return self.values.shape

    def __len__(self) -> int:
        return len(self.values)

    def __getitem__(self, which: Any) -> Cycles:
        """Some of the cycles: a slice, a mask or numbers; as of the first axis of an array."""
        which = which[0] if isinstance(which, tuple) else which
        rows = np.atleast_1d(np.arange(len(self))[which])
        drift = None if self.drift is None else self.drift[rows]
        labels = tuple(self.subject[i] for i in rows)
        return Cycles(self.values[rows], self.channels, self.seconds[rows], self.sequence[rows], labels, drift)

    def _shown(self) -> str:
        (k, samples, channels), people = self.values.shape, counted(len(set(self.subject)), "person", "people")
        return f"{counted(k, 'cycle')} of {people}, {samples} samples, {counted(channels, 'channel')}"

    def _repr_html_(self) -> str:
        """The mean cycle of each channel, for notebooks."""
        known = np.isfinite(self.values)
        sums, counts = np.where(known, self.values, 0.0).sum(0), known.sum(0)
        return curves(np.where(counts > 0, sums / np.maximum(counts, 1), np.nan).T, escape(repr(self)))


@dataclass(frozen=True, eq=False, repr=False)
class Camera(_Record):
    """A pinhole camera in OpenCV's convention: x right, y down, z into the scene; pixel centres at integers.

    Attributes:
        K: (3, 3) intrinsics [pixels].
        R: (3, 3) rotation world → camera.
        t: (3,) translation world → camera [m].
        width, height: image size [pixels].
    """

    K: np.ndarray
    R: np.ndarray
    t: np.ndarray
    width: int
    height: int

    def __post_init__(self) -> None:
        self._set(
            K=frozen(self.K, (3, 3), "Camera.K"),
            R=frozen(self.R, (3, 3), "Camera.R"),
            t=frozen(self.t, (3,), "Camera.t"),
        )
        for name in ("width", "height"):
            self._set(**{name: checked_whole(getattr(self, name), f"Camera.{name}", *PICTURE_SIZES, "pixels")})
        if not all(np.isfinite(a).all() for a in (self.K, self.R, self.t)):
            raise MotionError("Camera.K, R and t must be finite")
        if not np.allclose(self.R @ self.R.T, np.eye(3), atol=1e-6) or np.linalg.det(self.R) < 0:
            raise MotionError(f"Camera.R must be a rotation matrix, got {self.R.tolist()}")

    def _shown(self) -> str:
        place = ", ".join(f"{x:.2f}" for x in self.centre + 0.0)
        return f"{self.width}x{self.height}, focal length {self.K[0, 0]:.4g} pixels, at ({place}) m"

    def project(self, points: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Pixel coordinates (..., 2) and depth (...) [m] along z of world `points` (..., 3) [m]."""
        seen = np.asarray(points, dtype=np.float64) @ self.R.T + self.t
        pixels = seen @ self.K.T
        with np.errstate(divide="ignore", invalid="ignore"):
            return pixels[..., :2] / pixels[..., 2:], seen[..., 2]

    @property
    def centre(self) -> np.ndarray:
        """Position of the camera in the world, (3,) [m]."""
        return -self.R.T @ self.t


@dataclass(frozen=True, eq=False, repr=False)
class Frame(_Record):
    """Rendered images; leading axes are batch axes.

    Attributes:
        rgb: uint8 (..., height, width, 3), or None if not requested.
        depth: float32 (..., height, width) [m] along the camera's z to the body; infinite on the background.
        limbs: uint8 (..., height, width), 1 + index into `motionenv.body.LIMBS`; 0 is background.
    """

    rgb: np.ndarray | None
    depth: np.ndarray
    limbs: np.ndarray

    def _shown(self) -> str:
        height, width = self.limbs.shape[-2:]
        counted = f"{_counts(self.limbs.shape[:-2])}, " if self.limbs.ndim > 2 else ""
        return f"{counted}{width}x{height}, {'depth and limbs' if self.rgb is None else 'rgb, depth and limbs'}"

    def _repr_html_(self) -> str:
        """A strip of pictures, or of limbs' outlines if there is no colour, for notebooks."""
        every = np.repeat((self.limbs > 0)[..., None] * np.uint8(255), 3, -1) if self.rgb is None else self.rgb
        every = every.reshape(-1, *every.shape[-3:])
        step = max(1, every.shape[1] // 150)
        return picture(np.concatenate(every[some(len(every)), ::step, ::step], axis=1), escape(repr(self)))


def _counts(shape: tuple[int, ...]) -> str:
    """Batch axes and frames, such as "4 x 30 frames"."""
    return f"{' x '.join(map(str, shape))} frame{'' if shape == (1,) else 's'}"


def _rest(name: str, values: np.ndarray) -> str:
    return (f", {name[:40]!r}" if name else "") + (", with gaps" if np.isnan(values).any() else "")
