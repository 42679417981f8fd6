"""Initial contacts and toe-offs from the paths of the feet, against those in the files and those of force plates.

Zeni's events (heel furthest ahead of the pelvis, toe furthest behind) are compared with the same references. Files that
hold the same events at the same frames are one recording and count once.

A second table is of the body's motion after retargeting, whose feet have no joint of their own: contacts of the drawn
heel (what `motionenv.gait` finds in a motion), of the ankle in its place, and where the ankles are furthest apart along
the way. References are the file's events, and for CMU's skeletons those found in the same trial's markers. Nothing is
chosen by it.

    motionenv bench mocap.events [--mocap FOLDER]
"""

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.signal import find_peaks

from benchmarks import Arguments
from motionenv.body.kinematics import forward
from motionenv.body.skeleton import NODES
from motionenv.errors import MotionError
from motionenv.gait import Feet, feet_of
from motionenv.gait.events import candidates, directions, kinematic_events, plate_events
from motionenv.gait.feet import smoothed
from motionenv.mocap import read, retarget
from motionenv.types import Event, Motion

_PAIR = 0.2  # [s] within which an event is taken for that of the reference
_CLOSE = 20.0  # [ms] two frames at 100 Hz
_FAST = 100.0  # [Hz]
_SMOOTH = 7.0  # [Hz] cut-off of the ankles' paths, as for Zeni's candidates
_STEP, _APART = 0.35, 0.1  # [s] and [m]: least time between two contacts of a foot, and how far it then is ahead

#: Trials of CMU as skeletons and as markers.
_TWICE = {
    "cmu_asfamc/02/02_01.amc": "cmu_c3d/02_01.c3d",
    "cmu_asfamc/06/06_01.amc": "nimble/c3d/cmu_dribble_shoot_basketball.c3d",
}


def zeni(feet: Feet) -> tuple[Event, ...]:
    """Events of Zeni, Richards & Higginson (2008)."""
    ways = directions(feet)
    found = []
    for side in feet.sides:
        for kind, path, way in (("initial_contact", feet.heel, ways), ("toe_off", feet.toe, -ways)):
            found += [Event(k / feet.fps, kind, side) for k in candidates(feet, path[side], way)]
    return tuple(found)


def errors(found: Iterable[Event], reference: Iterable[Event], kind: str) -> list[float]:
    """Error [ms] of the nearest event for each of the reference; NaN if there is none near."""
    found = [e for e in found if e.kind == kind]
    out = []
    for event in (e for e in reference if e.kind == kind):
        off = [e.time - event.time for e in found if e.side == event.side]
        nearest = min(off, key=abs, default=np.inf)
        out.append(1000 * nearest if abs(nearest) < _PAIR else np.nan)
    return out


def recordings(mocap: Path):
    """Name, feet, the file's events and those of its plates, of each recording that has either."""
    seen = set()
    for path in sorted(p for p in mocap.rglob("*") if p.suffix.lower() == ".c3d"):
        try:
            markers = read(path, unit="mm", override=False)
            feet = feet_of(markers)
        except MotionError:
            continue
        marked = markers.recording.events
        plates = plate_events(markers.recording.plates, feet) if len(feet.pelvis) > 1 else ()
        marks = tuple((round(e.time * feet.fps), e.kind, e.side) for e in marked or plates)
        key = (len(feet.pelvis), feet.fps, marks)
        if (marked or plates) and key not in seen:
            seen.add(key)
            yield path.stem, feet, marked, plates


def contacts_of_motion(motion: Motion) -> dict[str, tuple[Event, ...]]:
    """Initial contacts of a body's motion (frames, 25), by three rules."""
    feet, nodes = feet_of(motion), forward(motion.poses, motion.skeleton)[0]
    ankles = {side: nodes[:, NODES.index(f"{side}_ankle")] for side in feet.sides}
    left, right = (smoothed(ankles[side], motion.fps, _SMOOTH)[:, :2] for side in ("left", "right"))
    ahead = ((left - right) * directions(feet)).sum(-1)
    apart: list[Event] = []
    for side, sign in (("left", 1.0), ("right", -1.0)):
        peaks = find_peaks(sign * ahead, height=_APART, distance=round(_STEP * motion.fps))[0]
        apart += [Event(k / motion.fps, "initial_contact", side) for k in peaks]
    return {
        "drawn heel": kinematic_events(feet),
        "ankle": kinematic_events(replace(feet, heel=ankles)),
        "furthest apart": tuple(apart),
    }


def motions(mocap: Path):
    """Name, motion and reference events of each walk of two legs whose file marks contacts, and of CMU's trials."""
    for path in sorted((mocap / "btkdata").rglob("*.c3d")):
        try:
            markers = read(path, unit="mm", override=False)
            motion = retarget(markers)
            sides = feet_of(motion).sides
        except MotionError:
            continue
        if markers.recording.events and len(sides) == 2:
            yield path.stem, motion, markers.recording.events
    for skeleton, marked in _TWICE.items():
        events = kinematic_events(feet_of(read(mocap / marked)))
        yield Path(skeleton).stem, retarget(read(mocap / skeleton, fps=120)), events


def print_motions(mocap: Path) -> None:
    """Print the table of motions, with recordings that hold the same events once."""
    seen, pooled = set(), defaultdict(list)
    print("\nInitial contact in the body's motion: median and largest error in ms (in frames).\n")
    print("| motion | contacts | drawn heel | ankle | furthest apart |\n|-|-|-|-|-|")
    for name, motion, reference in motions(mocap):
        contacts = tuple((round(e.time, 3), e.side) for e in reference if e.kind == "initial_contact")
        if contacts in seen:
            continue
        seen.add(contacts)
        cells = []
        for way, found in contacts_of_motion(motion).items():
            off = errors(found, reference, "initial_contact")
            pooled[way] += off
            cells.append(cell(off, motion.fps))
        print(f"| {name} | {len(contacts)} | {' | '.join(cells)} |")
    for way, off in pooled.items():
        size = np.abs(off)
        print(f"{way}: median {np.nanmedian(off):+.0f} ms, of its size {np.nanmedian(size):.0f} ms, "
              f"within 20 ms {np.mean(size <= _CLOSE):.0%} of {len(off)}, {np.isnan(size).sum()} missed")  # fmt: skip


def cell(values: list[float], fps: float) -> str:
    """Median error with its sign, and the largest, in ms and frames."""
    known = np.array(values)[np.isfinite(values)]
    if not known.size:
        return "–"
    middle, worst = np.median(known), np.abs(known).max()
    return f"{middle:+.0f}, {worst:.0f} ({middle * fps / 1000:+.1f}, {worst * fps / 1000:.1f})"


def main() -> None:
    """Print a row per recording and reference, and what they come to."""
    mocap = Arguments(__doc__, mocap=("btkdata", "cmu_asfamc")).parse_args().mocap
    head = "| recording | Hz | reference | events | contact: Zeni | contact: ours | toe-off: Zeni | toe-off: ours |"
    print("Median and largest error in ms (in frames).\n")
    print(f"{head}\n|-|-|-|-|-|-|-|-|")
    pooled = defaultdict(list)
    for name, feet, marked, plates in recordings(mocap):
        ways = {"Zeni": zeni(feet), "ours": kinematic_events(feet)}
        for reference, events in (("file", marked), ("plates", plates)):
            if not events:
                continue
            cells = []
            for kind in ("initial_contact", "toe_off"):
                for way, found in ways.items():
                    off = errors(found, events, kind)
                    pooled[reference, feet.fps >= _FAST, kind, way] += off
                    cells.append(cell(off, feet.fps))
            print(f"| {name} | {feet.fps:g} | {reference} | {len(events)} | {' | '.join(cells)} |")
    print(
        "\n| reference | rate | event | method | events | median error, ms | within 20 ms | missed |\n|-|-|-|-|-|-|-|-|"
    )
    for (reference, fast, kind, way), off in sorted(pooled.items(), key=lambda item: (not item[0][1], item[0])):
        size = np.abs(off)
        close, missed = 100 * np.mean(size <= _CLOSE), int(np.isnan(size).sum())
        rate = f"{'≥' if fast else '<'} {_FAST:g} Hz"
        row = (reference, rate, kind.replace("_", " "), way, len(off), f"{np.nanmedian(size):.1f}", f"{close:.0f} %")
        print(f"| {' | '.join(map(str, row))} | {missed} |")
    print_motions(mocap)


if __name__ == "__main__":
    main()
