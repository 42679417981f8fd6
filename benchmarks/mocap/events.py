"""Initial contacts and toe-offs from the paths of the feet, against those in the files and those of force plates.

Zeni's events (heel furthest ahead of the pelvis, toe furthest behind) are compared with the same references. Files that
hold the same events at the same frames are one recording and count once.

python -m benchmarks.mocap.events
"""

import argparse
from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from benchmarks import MOCAP
from motionenv.errors import MotionError
from motionenv.gait import Feet, feet_of
from motionenv.gait.kinematic_events import candidates, directions, kinematic_events
from motionenv.gait.plate_events import plate_events
from motionenv.mocap import read
from motionenv.types import Event

_PAIR = 0.2  # [s] within which an event is taken for that of the reference
_CLOSE = 20.0  # [ms] two frames at 100 Hz
_FAST = 100.0  # [Hz]


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


def cell(values: list[float], fps: float) -> str:
    """Median error with its sign, and the largest, in ms and frames."""
    known = np.array(values)[np.isfinite(values)]
    if not known.size:
        return "–"
    middle, worst = np.median(known), np.abs(known).max()
    return f"{middle:+.0f}, {worst:.0f} ({middle * fps / 1000:+.1f}, {worst * fps / 1000:.1f})"


def main(mocap: Path) -> None:
    """Print a row per recording and reference, and what they come to."""
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


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--mocap", type=Path, default=MOCAP, help="folder of motion capture")
    main(parser.parse_args().mocap)
