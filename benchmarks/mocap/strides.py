"""Share of the strides that a person would mark in a capture which `motionenv.gait` finds from the paths of the feet.

Contacts that a person would mark are those of the file, or else the beginnings of stances: where a foot, as it passes
over the floor or the belt, slows to a quarter of its fastest; a rule without directions, pelvis or vertical
acceleration. A stride is found if one of the same side begins and ends within 0.2 s of it, and "beside" counts strides
that nobody marked.

The second table is of the same captures cut to one, two and three strides, 0.15 s before the first contact and after
the last; all strides that then lie within are wanted, the other side's too.

The third is of a runner on a treadmill (Hamner & Delp 2013) as if he jogged on a field for 15 s: the belt's motion is
added, one stride is repeated, and the floor bent along straights and half turns to the left and the right. Contacts are
those of the straight run.

    motionenv bench mocap.strides [--mocap FOLDER]
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from benchmarks import Arguments
from benchmarks.mocap.events import recordings
from motionenv.errors import MotionError
from motionenv.gait import Feet, Stride, feet_of, find_events, find_stretches, find_strides
from motionenv.gait.feet import smoothed
from motionenv.gait.stretches import belt
from motionenv.mocap import read

_PAIR = 0.2  # [s]
_STANDS, _FASTEST = 0.25, 95  # share of a foot's fastest, which is a percentile
_SWING, _STANCE = 0.15, 0.08  # [s] least durations
_STRIDE = (0.4, 2.2)  # [s]
_CUT, _EDGE = 0.15, 0.1  # [s] kept before and after, and least distance of a wanted contact from the ends
_RADII = (1.5, 3.0, 6.0)  # [m] of turns
_STRAIGHT, _SECONDS = 8.0, 15.0  # [m] between them, and [s] of the run

Contacts = dict[str, list[float]]


def stances(feet: Feet) -> Contacts:
    """By side, the times [s] at which the feet come to rest."""
    carried = belt(feet)
    found: Contacts = {}
    for side in feet.sides:
        speeds = []
        for path in (feet.heel[side], feet.toe[side]):
            velocity = np.gradient(smoothed(path, feet.fps, 10.0)[:, :2], axis=0) * feet.fps
            speeds.append(np.linalg.norm(velocity - (0.0 if carried is None else carried), axis=-1))
        speed = np.min(speeds, axis=0)
        moves = speed > max(_STANDS * np.percentile(speed, _FASTEST), 0.2)
        runs = _runs(moves)
        moves = np.concatenate([np.full(b - a, m and (b - a) / feet.fps >= _SWING) for a, b, m in runs])
        runs = _runs(moves)
        found[side] = [a / feet.fps for a, b, m in runs if not m and a > 0 and (b - a) / feet.fps >= _STANCE]
    return found


def _runs(values: np.ndarray) -> list[tuple[int, int, bool]]:
    edges = [0, *(np.flatnonzero(np.diff(values)) + 1).tolist(), len(values)]
    return [(a, b, bool(values[a])) for a, b in pairwise(edges)]


def wanted(contacts: Contacts, start: float = 0.0, end: float = np.inf) -> list[Stride]:
    """The strides between contacts that lie between two times."""
    found = []
    for side, times in contacts.items():
        inside = [t for t in times if start + _EDGE <= t <= end - _EDGE]
        found += [Stride(side, a, b) for a, b in pairwise(inside) if _STRIDE[0] <= b - a <= _STRIDE[1]]
    return found


def strides_of(feet: Feet) -> tuple[Stride, ...]:
    """Strides from the paths of the feet alone."""
    return find_strides(feet, find_events(feet), find_stretches(feet))


def score(found: Sequence[Stride], marked: Sequence[Stride], late: float = 0.0) -> np.ndarray:
    """Numbers of strides: marked, of these found, and found beside them; the found begin `late` [s] in the capture."""
    same = lambda a, b: a.side == b.side and abs(a.start + late - b.start) < _PAIR and abs(a.end + late - b.end) < _PAIR
    hit = sum(any(same(a, b) for a in found) for b in marked)
    return np.array([len(marked), hit, sum(not any(same(a, b) for b in marked) for a in found)])


def cut(feet: Feet, first: int, last: int) -> Feet:
    """The frames from `first` to before `last`."""
    part = lambda paths: {side: path[first:last] for side, path in paths.items()}
    return replace(feet, pelvis=feet.pelvis[first:last], heel=part(feet.heel), toe=part(feet.toe))


def scores_of_cuts(feet: Feet, contacts: Contacts, many: int) -> np.ndarray:
    """Score over all parts of a capture that hold `many` strides of a side."""
    total = np.zeros(3, dtype=int)
    seconds = len(feet.pelvis) / feet.fps
    for times in contacts.values():
        for a, b in zip(times, times[many:], strict=False):
            first, last = round((a - _CUT) * feet.fps), round((b + _CUT) * feet.fps)
            if first < 0 or last > len(feet.pelvis) or b - a > many * _STRIDE[1]:
                continue
            part = cut(feet, first, last)
            inside = wanted(contacts, first / feet.fps, min(last / feet.fps, seconds))
            total += score(strides_of(part), inside, first / feet.fps)
    return total


def captures(mocap: Path) -> Iterator[tuple[str, str, Feet, Contacts]]:
    """Group, name, feet and marked contacts of each capture."""
    for name, feet, marked, _ in recordings(mocap):
        contacts = {s: [e.time for e in marked if (e.kind, e.side) == ("initial_contact", s)] for s in feet.sides}
        if any(len(times) > 1 for times in contacts.values()):
            yield "laboratories' C3D, as marked", name, feet, contacts
    turning = ("26_01", "27_01", "29_01", "46_01")
    groups: list[tuple[str, list[Path], float | None]] = [
        ("CMU, straight", [p for p in sorted(mocap.glob("cmu_asfamc/*/*.amc")) if p.stem not in turning], 120.0),
        ("CMU, turning", [p for p in sorted(mocap.glob("cmu_asfamc/*/*.amc")) if p.stem in turning], 120.0),
        ("laboratories' TRC", sorted(mocap.glob("nimble/grf/*/*/*walk*.trc")) + sorted(mocap.glob("bmc/data/*.trc"))
         + sorted(mocap.glob("nimble/grf/Carmago*/*/*.trc")) + sorted(mocap.glob("nimble/osim/Lai*/*.trc")), None),
        ("treadmill", sorted(mocap.glob("nimble/osim/Hamner*/*/trials/*/markers.trc")), None),
    ]  # fmt: skip
    for kind in ("walk", "walk-back", "walk-left", "walk-right", "walk-turn-left", "walk-turn-right", "run", "dash"):
        paths = sorted(p for p in mocap.glob("bandai_namco/*/data/*.bvh") if p.stem.split("_")[1] == kind)
        groups.append((f"Bandai-Namco, {kind}", paths, None))
    for group, paths, fps in groups:
        for path in paths:
            try:
                feet = feet_of(read(path, fps=fps, unit="mm" if path.suffix == ".trc" else None, override=False))
            except MotionError as error:
                print(f"left out {path.name}: {error}")
                continue
            yield group, path.parent.name if path.stem == "markers" else path.stem, feet, stances(feet)


def bent(feet: Feet, radius: float) -> Feet:
    """A straight run along x, with the floor bent along straights and half turns, to the left and the right in turn."""
    length = np.pi * radius

    def change(points: np.ndarray) -> np.ndarray:
        s = np.linspace(-5, 5 + np.nanmax(points[:, 0]), 20_000)
        phase = s % (_STRAIGHT + length)
        side = np.where((s // (_STRAIGHT + length)) % 2 == 0, 1.0, -1.0)
        # A turn's curvature rises and falls over its first and last quarter.
        ease = np.clip(4 * np.minimum(phase - _STRAIGHT, _STRAIGHT + length - phase) / length, 0, 1) / 0.75
        heading = np.concatenate([[0], np.cumsum(side * ease / radius)[:-1] * np.diff(s)])
        way = np.stack([np.cos(heading), np.sin(heading)], -1)
        path = np.concatenate([[[0, 0]], np.cumsum(way[:-1] * np.diff(s)[:, None], axis=0)])
        at = lambda column: np.interp(points[:, 0], s, column)
        turned = at(heading)
        return np.stack([at(path[:, 0]) - np.sin(turned) * points[:, 1], at(path[:, 1]) + np.cos(turned) * points[:, 1],
                         points[:, 2]], -1)  # fmt: skip

    return _changed(feet, change)


def overground(feet: Feet) -> Feet:
    """A treadmill's run as it would be on the floor, along x from 0."""
    carried = belt(feet)
    forwards = -carried / np.linalg.norm(carried)
    turn = np.array([[forwards[0], forwards[1], 0], [-forwards[1], forwards[0], 0], [0, 0, 1]])
    time = np.arange(len(feet.pelvis))[:, None] / feet.fps
    moved = _changed(feet, lambda p: (p - time * [*carried, 0]) @ turn.T)
    origin = np.array([*moved.pelvis[0, :2], 0])
    return _changed(moved, lambda p: p - origin)


def repeated(feet: Feet, stride: Stride) -> Feet:
    """One stride along x, over and over."""
    first, last = (round(t * feet.fps) for t in (stride.start, stride.end))
    travel = (feet.pelvis[last] - feet.pelvis[first]) * [1, 0, 0]
    times = np.arange(int(_SECONDS * feet.fps / (last - first)))
    tiled = lambda p: (p[None, first:last] + times[:, None, None] * travel).reshape(-1, 3)
    return _changed(feet, tiled)


def _changed(feet: Feet, change: Callable[[np.ndarray], np.ndarray]) -> Feet:
    all_of = lambda paths: {side: change(path) for side, path in paths.items()}
    return replace(feet, pelvis=change(feet.pelvis), heel=all_of(feet.heel), toe=all_of(feet.toe))


def row(name: str, *scores: np.ndarray) -> str:
    """A line of a table: strides, share found, and those beside."""
    cells = [f"{n} | {100 * hit / n:.0f} % | {beside}" if n else "0 | – | –" for n, hit, beside in scores]
    return f"| {name} | {' | '.join(cells)} |"


def main() -> None:
    """Print the three tables."""
    mocap = Arguments(__doc__, mocap=("btkdata", "cmu_asfamc", "bandai_namco")).parse_args().mocap
    whole: dict[str, np.ndarray] = {}
    parts: dict[str, list[np.ndarray]] = {}
    runs = []
    for group, name, feet, contacts in captures(mocap):
        scored = score(strides_of(feet), wanted(contacts, 0.0, len(feet.pelvis) / feet.fps))
        whole[group] = whole.get(group, 0) + scored
        of_cuts = [scores_of_cuts(feet, contacts, many) for many in (1, 2, 3)]
        parts[group] = [a + b for a, b in zip(parts.get(group, [0, 0, 0]), of_cuts, strict=True)]
        if group == "treadmill":
            runs.append((name, feet))
    print("| captures | strides | found | beside |\n|-|-|-|-|")
    print("\n".join(row(group, scores) for group, scores in whole.items()))
    print("\n| cut to | 1: strides | found | beside | 2: strides | found | beside | 3: strides | found | beside |")
    print("|-|-|-|-|-|-|-|-|-|-|")
    print("\n".join(row(group, *scores) for group, scores in parts.items()))
    print("\n| jogging and turning | speed, m/s | radius, m | strides | found | beside |\n|-|-|-|-|-|-|")
    for name, feet in runs:
        straight = repeated(overground(feet), strides_of(feet)[0])
        found = strides_of(straight)
        contacts = {s: sorted({t for x in found if x.side == s for t in (x.start, x.end)}) for s in feet.sides}
        for radius in _RADII:
            scored = score(strides_of(bent(straight, radius)), wanted(contacts))
            print(row(f"{name} | {np.linalg.norm(belt(feet)):.1f} | {radius:g}", scored))


if __name__ == "__main__":
    main()
