"""Walks of gait laboratories, their own angles and events, and six views of a film of them."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.ndimage import gaussian_filter1d

from benchmarks.mocap.angles import stored
from motionenv.gait.events import directions
from motionenv.gait.trial import Trial, analyse
from motionenv.mocap import read, retarget, to_markers
from motionenv.mocap.keypoints import DetectorErrors
from motionenv.mocap.marker_sets import find_landmarks
from motionenv.render.cameras import fit_view, project
from motionenv.types import MARKERS, Camera, Markers, Points

#: Whole bodies of people in no fit, by person: with Plug-in Gait's own angles and events in the file, and others.
OWN_ANGLES = {
    "BELT_C": ("btkdata/C3DSamples/PiG/PiG_Motion-FlatFoot-Full.c3d",),
    "ANTO_M": (
        "btkdata/C3DSamples/PiG/PiG_Motion-FlatFoot-Hole.c3d", "btkdata/C3DSamples/PiG/PiG_Motion-FlatFoot-One.c3d",
    ),
}  # fmt: skip
OTHERS = {
    "stairs": ("nimble/osim/WeirdFormatTests/markers.trc",),
    "gait": ("btkdata/TRCSamples/Gait.trc",),
    "tutorial": ("nimble/grf/AddBiomechanicsTutorialFiles/motion_capture_walk.trc",),
    "subject 4": (
        "nimble/grf/Subject4/MarkerData/walking1.trc", "nimble/grf/Subject4/MarkerData/walking2.trc",
    ),
    "OpenCap": ("nimble/grf/OpenCapUnfiltered/MarkerData/walking2.trc",),
    "flip": ("nimble/osim/DetectMarkerFlip/walking2.trc",),
    "subject 6": ("nimble/osim/LaiArnoldSubject6/walking1.trc",),
}  # fmt: skip
FPS = 30.0
#: View angle [rad] about the walker (0 from his right side, π/2 from the front), and by how much the camera looks down.
VIEWS = {
    "side": (0.0, 0.05), "oblique": (0.8, 0.05), "front": (1.5, 0.08), "back": (-1.5, 0.08), "from above": (0.5, 0.7),
    "hand-held": (0.3, 0.05),
}  # fmt: skip
PICTURE = {"width": 1280, "height": 720}
_TREMOR, _DRIFT = (0.15, 0.12), (0.8, 1.0)  # [degrees], and [s] over which each changes, of a hand that holds a camera
_FLEXIONS = {"Pelvis": "pelvis_tilt", "Hip": "hip_flexion", "Knee": "knee_flexion", "Ankle": "ankle_dorsiflexion"}
_COLUMNS = {"Pelvis": ("pelvis_tilt", "pelvis_obliquity", "pelvis_rotation")}
_M = {name: i for i, name in enumerate(MARKERS)}
_LEGS = [i for name, i in _M.items() if name.endswith(("hip", "knee", "ankle"))]
#: Where a head without markers is: above the sternum, in lengths of the trunk (mean of CMU's people).
_HEAD = 0.5


@dataclass(frozen=True, eq=False)
class Walk:
    """A captured walk at about 30 Hz, of a `person` of a `group` who is `height` [m] tall.

    `positions` (frames, 15, 3) are the markers, `feet` (frames, 4, 3) left and right heel and toe or None, and `angles`
    (frames,) [degrees] the capture's own by name. The `trial` is the capture's analysis at its own rate, from frame
    `first` of which on the walk is cut, one of `step`.
    """

    name: str
    person: str
    group: str
    positions: np.ndarray
    feet: np.ndarray | None
    angles: dict[str, np.ndarray]
    trial: Trial
    height: float
    fps: float
    start: float

    @property
    def way(self) -> float:
        """Direction of travel [rad] from x towards y."""
        pelvis = self.positions[:, _M["pelvis"], :2]
        return float(np.arctan2(*(pelvis[-1] - pelvis[0])[::-1]))

    @property
    def straight(self) -> bool:
        """Whether the end is as far from the beginning as somebody goes, to a tenth."""
        pelvis = self.positions[:, _M["pelvis"], :2]
        gone = np.linalg.norm(np.diff(pelvis, axis=0), axis=1).sum()
        return bool(np.linalg.norm(pelvis[-1] - pelvis[0]) > 0.9 * gone)


def in_no_fit(mocap: Path, most: int | None = None) -> list[Walk]:
    """Walks of people in no fit, at most so many."""
    table = [("Plug-in Gait", OWN_ANGLES), ("laboratories", OTHERS)]
    files = [(file, person, group) for group, people in table for person, each in people.items() for file in each]
    return [walk(mocap / file, person, group) for file, person, group in files[:most]]


def cmu(mocap: Path, subjects: tuple[str, ...]) -> list[Walk]:
    """Straight walks of CMU's subjects, with the angles of their corrected skeletons; not of who turns back."""
    paths = [p for s in subjects for p in sorted((mocap / "cmu_asfamc" / s).glob("*.amc"))]
    return [one for path in paths if (one := walk(path, path.stem[:2], "CMU")).straight]


def walk(path: Path, person: str, group: str) -> Walk:
    """Read a capture, and cut it to where its markers are seen.

    Wands of people whose file states no measurements are left out: one has knees bowed by 16 degrees with them.
    """
    capture = read(path, fps=120 if path.suffix == ".amc" else None, override=False)
    trial = analyse(capture, wands="ignore" if group == "laboratories" else "auto")
    markers = _completed(to_markers(capture).positions)
    known = np.isfinite(markers[:, _LEGS]).all(axis=(1, 2))
    first, end = longest(known)
    step = max(1, round(capture.fps / FPS))
    part = slice(first, end, step)
    angles = {name: trial.angles[name] for name in trial.angles.names} | _stored(capture)
    angles |= {f"{side}_trunk_tilt": _lean(markers, trial) for side in ("left", "right")}
    return Walk(
        path.stem, person, group, markers[part], None if (feet := _feet(capture)) is None else feet[part],
        {name: values[part] for name, values in angles.items() if np.isfinite(values[part]).mean() > 0.5},
        trial, retarget(capture).skeleton.height, capture.fps / step, first / capture.fps,
    )  # fmt: skip


def _stored(capture: Markers) -> dict[str, np.ndarray]:
    """Plug-in Gait's own angles (frames,) [degrees] by our names."""
    found = {}
    for side in ("left", "right"):
        for output, name in _FLEXIONS.items():
            values = stored(capture, side, output)
            if values is not None:
                for column, each in enumerate(_COLUMNS.get(output, (name,))):
                    found[f"{side}_{each}"] = values[:, column]
    return found


def _lean(markers: np.ndarray, trial: Trial) -> np.ndarray:
    """By how much the line from the hips' middle to the shoulders' leans forward (frames,) [degrees]."""
    trunk = np.subtract(*(markers[:, [_M[f"left_{n}"], _M[f"right_{n}"]]].mean(axis=1) for n in ("shoulder", "hip")))
    ways = directions(trial.feet)
    return np.degrees(np.arctan2((trunk[:, :2] * ways).sum(-1), trunk[:, 2]))


def _completed(markers: np.ndarray) -> np.ndarray:
    """Markers with a sternum as detectors' points give it, and a head on an upright neck, where none was captured."""
    out = markers.copy()
    shoulders, hips = (markers[:, [_M[f"left_{n}"], _M[f"right_{n}"]]].mean(axis=1) for n in ("shoulder", "hip"))
    trunk = 0.885 * shoulders + 0.115 * hips
    for name, places in (("sternum", trunk), ("head", trunk + _HEAD * (trunk - hips))):
        if np.isnan(markers[:, _M[name], 0]).mean() > 0.5:
            out[:, _M[name]] = places
    return out


def longest(known: np.ndarray) -> tuple[int, int]:
    """First frame of the longest run of known ones, and the frame after it."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], known, [False]]).astype(int))).reshape(-1, 2)
    first, end = edges[np.argmax(edges[:, 1] - edges[:, 0])]
    return int(first), int(end)


def _feet(capture: Markers) -> np.ndarray | None:
    at = find_landmarks(capture).positions
    names = [f"{side}_{part}" for side in ("left", "right") for part in ("heel", "toe")]
    return np.stack([at[name] for name in names], axis=1) if set(names) <= at.keys() else None


def film(one: Walk, view: str, rng: np.random.Generator) -> tuple[Camera | list[Camera], Points, np.ndarray | None]:
    """A camera that sees the walk, or one for each frame if a hand holds it, and the markers and feet in pixels."""
    alpha, down = VIEWS[view]
    camera = fit_view(one.positions, one.way + alpha, elevation=down, **PICTURE)
    frames = len(one.positions)
    cameras = _shaken(camera, frames, one.fps, rng) if view == "hand-held" else camera
    truth = Markers(MARKERS, one.positions, one.fps, name=one.name)
    points = Points(project(one.positions, cameras)[0], one.fps, "px", truth=truth, name=one.name)
    return cameras, points, None if one.feet is None else project(one.feet, cameras)[0]


def _shaken(camera: Camera, frames: int, fps: float, rng: np.random.Generator) -> list[Camera]:
    """The camera as a hand holds it: it sways, quickly by little and slowly by more."""
    turn = np.zeros((frames, 3))
    for size, seconds in (_TREMOR, _DRIFT):
        noise = gaussian_filter1d(rng.standard_normal((frames + 200, 3)), seconds * fps / 2, axis=0)[100:-100]
        turn += np.radians(size) * noise / noise.std()
    cameras = []
    for a, b, c in turn:
        small = np.array([[1, -c, b], [c, 1, -a], [-b, a, 1]])
        u, _, vt = np.linalg.svd(small)
        rotation = u @ vt @ camera.R
        cameras.append(replace(camera, R=rotation, t=-rotation @ camera.centre))
    return cameras


def detected(points: Points, feet: np.ndarray | None, height: float, rng: np.random.Generator):
    """Points and feet with a detector's errors; those of heels and toes are the ankles', without misses."""
    errors = DetectorErrors()
    seen = errors.apply(points, rng, height)
    if feet is None:
        return seen, None
    out = feet.copy()
    ankles = [_M["left_ankle"], _M["right_ankle"]]
    for part in (0, 1):
        moved = points.positions.copy()
        moved[:, ankles] = feet[:, part::2]
        found = replace(errors, severity=0.0).apply(replace(points, positions=moved), rng, height)
        out[:, part::2] = found.positions[:, ankles]
    return seen, out
