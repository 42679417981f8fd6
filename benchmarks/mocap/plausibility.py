"""The check of plausibility: what it says of every capture, of people who look odd, and of misreadings made on purpose.

    motionenv bench mocap.plausibility [--mocap FOLDER] [--every 5]

All files of the folder are read with the units that refusals propose. A doubt about one that shows a person would be a
false alarm. Every n-th file in which legs are recognised is then misread in each way; noticed is a doubt that the file
itself doesn't raise or, for markers that stick, a note. Limits were set by the files of other folders than the one that
a row tells of: the widest spread of a limb's length among them is 0.29 of its median, and 0.4 is allowed; the largest
difference between sides is 0.16, and 0.25 is allowed; 11 m/s in the noise of markerless capture, and 12.5 is allowed.
"""

import re
import warnings
from collections import Counter, defaultdict
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks import Arguments
from motionenv import body
from motionenv.errors import CaptureWarning, MotionError
from motionenv.mocap import SUFFIXES, find_doubts, find_landmarks, read, retarget
from motionenv.mocap.plausibility import mended
from motionenv.types import MARKERS, POSE, Markers, Motion

_LEG = {f"left_{joint}{place}" for joint in ("knee", "ankle") for place in ("", "_lateral")}
Change = Callable[[Markers], Markers | None]


def opened(path: Path) -> Markers | Motion | None:
    """The capture in a file; None if it can't be read."""
    try:
        return read(path, fps=120.0, override=False)
    except MotionError as error:
        unit = re.search(r'unit="?(\w[\w.]*)"?', str(error))
    try:
        return read(path, fps=120.0, unit=unit[1], override=False) if unit else None
    except MotionError:
        return None


def turned(*rows) -> Change:
    """Multiplies every position by a matrix."""
    return lambda markers: replace(markers, positions=markers.positions @ np.array(rows, dtype=float).T)


def exchanged(one: str, other: str, start: float = 0.0) -> Change:
    """Exchanges the single points of two landmarks, from a share of the trial on; None where they aren't single."""

    def change(markers: Markers) -> Markers | None:
        found = find_landmarks(markers).points
        pair = [list(found.get(name, {})) for name in (one, other)]
        if any(len(names) != 1 for names in pair):
            return None
        a, b = (markers.index(names[0]) for names in pair)
        positions = markers.positions.copy()
        first = round(start * len(positions))
        positions[first:, [a, b]] = positions[first:, [b, a]]
        return replace(markers, positions=positions)

    return change


def of_two_people(markers: Markers) -> Markers:
    """The points around the pelvis where somebody else, who walks 1 m beside, has them 0.4 s later."""
    around = [name for name in find_landmarks(markers).points if re.search("asis|psis|sacrum|hip|pelvis", name)]
    names = {point for name in around for point in find_landmarks(markers).points[name]}
    at = [markers.index(name) for name in names]
    positions = markers.positions.copy()
    positions[:, at] = np.roll(positions[:, at], -round(0.4 * markers.fps), axis=0) + np.array([0.3, 1.0, 0.1])
    return replace(markers, positions=positions)


def stuck(markers: Markers) -> Markers | None:
    """The point that is fastest sticks for 0.3 s; None for hierarchies, whose joints can't."""
    if len(markers.positions) < 2:
        return None
    steps = np.nan_to_num(np.linalg.norm(np.diff(markers.positions, axis=0), axis=-1))
    frame, point = np.unravel_index(steps.argmax(), steps.shape)
    run = slice(int(frame), int(frame) + max(6, round(0.3 * markers.fps)))
    if markers.parents is not None or np.isnan(markers.positions[run, point]).any() or steps.max() * markers.fps < 1:
        return None
    positions = markers.positions.copy()
    positions[run, point] = positions[frame, point]
    return replace(markers, positions=positions)


def backwards(markers: Markers) -> Markers:
    return replace(markers, positions=markers.positions[::-1])


def posed(change: Callable[[np.ndarray], None]) -> Change:
    """Changes the poses (frames, 25) that a body takes with the capture; its 15 markers, lowest where they were."""

    def changed(markers: Markers) -> Markers:
        motion = retarget(markers)
        before, poses = body.markers(motion.poses, motion.skeleton), motion.poses.copy()
        change(poses)
        after = body.markers(poses, motion.skeleton)
        after[..., 2] += (np.nanmin(before[..., 2], axis=1) - np.nanmin(after[..., 2], axis=1))[:, None]
        return Markers(MARKERS, after, markers.fps)

    return changed


def crouch(poses: np.ndarray) -> None:
    for side in ("left", "right"):
        poses[:, POSE.index(f"{side}_hip_flexion")] += 0.5
        poses[:, POSE.index(f"{side}_knee_flexion")] += 0.8


def swing_through(poses: np.ndarray) -> None:
    """On crutches: both legs swing at the same time, and the arms are held before the body."""
    for at, name in enumerate(POSE):
        if name.startswith("right_") and ("hip" in name or "knee" in name):
            poses[:, at] = poses[:, POSE.index(name.replace("right", "left"))]
        elif "shoulder_flexion" in name or "elbow" in name:
            poses[:, at] = 0.5
    poses[:, POSE.index("root_tilt")] += 0.2


def drop_foot(markers: Markers) -> Markers | None:
    """The points of the left foot turned down about the ankle by up to 30°, the more the higher the ankle is."""
    found = find_landmarks(markers).points
    ankle = next((point for n in ("left_ankle", "left_ankle_lateral") for point in found.get(n, ())), None)
    foot = [point for name in found if re.match("left_(toe|heel|foot)", name) for point in found[name]]
    if ankle is None or not foot:
        return None
    positions = markers.positions.copy()
    centre = positions[:, markers.index(ankle)]
    height = centre[:, 2] - np.nanmin(centre[:, 2])
    angle = np.radians(30) * np.clip(height / 0.1, 0, 1)
    for name in foot:
        arm = positions[:, markers.index(name)] - centre
        along = np.linalg.norm(arm[:, :2], axis=1)
        way = arm[:, :2] / along[:, None]
        heel = "heel" in next(n for n in found if name in found[n])
        turn = np.arctan2(arm[:, 2], along) + (angle if heel else -angle)
        length = np.linalg.norm(arm, axis=1)
        positions[:, markers.index(name)] = centre + np.column_stack(
            [way * (length * np.cos(turn))[:, None], length * np.sin(turn)]
        )
    return replace(markers, positions=positions)


WRONG: dict[str, Change] = {
    "another vertical axis": turned([0, 0, 1], [1, 0, 0], [0, 1, 0]),
    "upside down": turned([1, 0, 0], [0, -1, 0], [0, 0, -1]),
    "mirrored": turned([1, 0, 0], [0, -1, 0], [0, 0, 1]),
    "millimetres called metres": turned([1000, 0, 0], [0, 1000, 0], [0, 0, 1000]),
    "inches called metres": turned([39.4, 0, 0], [0, 39.4, 0], [0, 0, 39.4]),
    "in one plane": turned([1, 0, 0], [0, 0, 0], [0, 0, 1]),
    "pelvis of somebody else": of_two_people,
    "knee and ankle exchanged": exchanged("left_knee_lateral", "left_ankle_lateral"),
    "knee and ankle joints exchanged": exchanged("left_knee", "left_ankle"),
    "heel and toe exchanged": exchanged("left_heel", "left_toe"),
    "knees exchanged from half": exchanged("left_knee_lateral", "right_knee_lateral", 0.5),
    "a marker that sticks for 0.3 s": stuck,
}
ODD: dict[str, Change] = {
    "children, half as tall": turned([0.5, 0, 0], [0, 0.5, 0], [0, 0, 0.5]),
    "giants, 1.2 times as tall": turned([1.2, 0, 0], [0, 1.2, 0], [0, 0, 1.2]),
    "played backwards": backwards,
    "crouched, knees bent by 46° more": posed(crouch),
    "on crutches, both legs swing through": posed(swing_through),
    "drop foot": drop_foot,
    "leaning by 15°": turned([0.966, 0, 0.259], [0, 1, 0], [-0.259, 0, 0.966]),
    "turned by 130°": turned([-0.643, -0.766, 0], [0.766, -0.643, 0], [0, 0, 1]),
}


def says(markers: Markers) -> set[str]:
    """Kinds of what is said: doubts, without numbers, and whether samples are taken for gaps."""
    notes = mended(markers, lambda **_: markers, ()).notes[len(markers.notes) :]
    return {re.sub(r"[\d.]+", "#", doubt) for doubt in find_doubts(markers)} | {"stuck" for _ in notes}


def main() -> None:
    """Print what is said of the files, of people who look odd, and of misreadings."""
    warnings.simplefilter("ignore", CaptureWarning)
    parser = Arguments(__doc__, mocap=("btkdata", "nimble"))
    parser.add_argument("--every", type=int, default=5, quick=60, help="misread every n-th file")
    arguments = parser.parse_args()
    paths = sorted(p for p in arguments.mocap.rglob("*") if p.suffix.lower() in SUFFIXES)
    told, people = defaultdict(Counter), []
    for k, path in enumerate(paths[:: 10 if arguments.quick else 1]):
        folder = path.relative_to(arguments.mocap).parts[0]
        capture = opened(path)
        if capture is None:
            told[folder]["not read"] += 1
            continue
        doubts = find_doubts(capture)
        told[folder].update({"files": 1, "doubted": int(bool(doubts)), "with notes": int(bool(capture.notes))})
        for text in (*doubts, *capture.notes):
            print(f"{path.relative_to(arguments.mocap)}: {text}")
        if isinstance(capture, Markers) and k % arguments.every == 0 and capture.positions.ndim == 3:
            people.append(capture)
    print("\n| folder | files | doubted | with notes | not read |\n|-|-|-|-|-|")
    for folder, count in told.items():
        print(f"| {folder} | {' | '.join(str(count[c]) for c in ('files', 'doubted', 'with notes', 'not read'))} |")
    for title, changes in (("person who looks odd", ODD), ("misreading", WRONG)):
        print(f"\n| {title} | captures | something is said |\n|-|-|-|")
        for name, change in changes.items():
            noticed = [row for row in (_noticed(markers, change) for markers in people) if row is not None]
            print(f"| {name} | {len(noticed)} | {sum(noticed)} |")


def _noticed(markers: Markers, change: Change) -> bool | None:
    """Whether something new is said of a changed capture; None if it shows no legs or can't be changed so."""
    try:
        if not _LEG & find_landmarks(markers).points.keys():
            return None
        changed = change(markers)
    except MotionError:
        return None
    return None if changed is None else bool(says(changed) - says(markers))


if __name__ == "__main__":
    main()
