"""Joint angles, contacts and speed of laboratory walks in six views, lifted and by peers, in degrees.

    motionenv bench lifting.degrees [--network FILE]

People of laboratories in no training data: two with Plug-in Gait's own angles and events in the file, and seven of whom
`motionenv.gait` computes them from the capture's markers; on these, pelvic tilt and a few settings were chosen. With
`--network`, one trained without six of CMU's subjects (see `free_walking.left_out`), straight walks of theirs make a
second table, with angles of their corrected skeletons. One camera sees points at 30 Hz, exactly or with the published
errors of detectors; lifting is told nothing but by how much the camera looks down, and the person's height. The hips'
truth is relative to a pelvis whose tilt no point shows: without the mean error, it doesn't count.

Errors are root mean squares in degrees, a mean over people; in brackets with each walk's mean error removed, the share
of angles inside their 90 % bands, and, where that isn't all, of how many films the angle is told. Contacts are the mean
and deviation of their errors, and how many were found.
"""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks import Arguments, has, headline
from benchmarks.free_walking import left_out
from benchmarks.lifting import laboratory
from benchmarks.lifting.laboratory import PICTURE, VIEWS, Walk, detected, film
from benchmarks.lifting.plane_angles import Estimate, in_the_plane, myogait
from benchmarks.mocap.events import errors as event_errors
from motionenv.gait.strides import Stride
from motionenv.lifting import Lifted, gait_of
from motionenv.lifting.free.lifter import fit_freely
from motionenv.lifting.gait import NAMES
from motionenv.lifting.side_labels import swapped_back
from motionenv.types import Event, Points

POINTS = ("exact", "detector's errors")
JOINTS = ("hip_flexion", "knee_flexion", "ankle_dorsiflexion", "pelvis_obliquity", "pelvis_rotation", "trunk_tilt")
_TALL = 0.896  # from head to ankles, of the height


def lifted(one: Walk, points: Points, view: str, network, draws: int) -> Estimate:
    """What lifting tells, at the person's height."""
    fit = fit_freely(points, None, elevation=VIEWS[view][1], height=one.height, network=network)
    walk = gait_of(Lifted(swapped_back(points, fit.swapped), fit.swapped, free=fit), draws=draws)
    angles, deviations = (dict(zip(NAMES, values.T, strict=True)) for values in (walk.angles, walk.deviations))
    events = tuple(Event(event.time, event.kind, event.side) for event in walk.events)
    return Estimate(angles, events, parameters(walk.strides), deviations)


def parameters(strides: tuple[Stride, ...]) -> dict[str, float]:
    """Means over strides: speed [m/s], step length [m] and cadence [steps/min]."""
    if not strides:
        return {}
    return {
        "speed": float(np.nanmean([s.speed for s in strides])),
        "step_length": float(np.nanmean([s.step_length for s in strides])),
        "cadence": 120 / float(np.mean([s.seconds for s in strides])),
    }


class Row:
    """Errors of one method in one view, by person."""

    def __init__(self) -> None:
        self.angles: dict = defaultdict(lambda: defaultdict(list))
        self.told: dict = defaultdict(list)
        self.contacts: list[float] = []
        self.parameters: dict = defaultdict(list)

    def add(self, one: Walk, found: Estimate) -> None:
        """Add the errors of one film."""
        for name in JOINTS:
            for key in (f"left_{name}", f"right_{name}"):
                if key in one.angles and key in found.angles:
                    off = found.angles[key] - one.angles[key]
                    self.told[name].append(np.isfinite(off).any())
                    if not self.told[name][-1]:
                        continue
                    band = 1.645 * found.deviations[key] if key in found.deviations else np.full(len(off), np.nan)
                    self.angles[name][one.person].append(figures(off, band))
        shifted = [replace_time(event, one.start) for event in found.events]
        seen = [e for e in one.trial.events.events if one.start < e.time < one.start + len(one.positions) / one.fps]
        self.contacts += event_errors(shifted, seen, "initial_contact")
        for name, value in parameters(one.trial.steady).items():
            self.parameters[name].append(found.parameters.get(name, np.nan) - value)

    def cells(self) -> dict[str, np.ndarray]:
        """By joint: rms, rms without the mean, and share in bands; a mean over people."""
        return {
            name: np.mean([np.nanmean(each, axis=0) for each in people.values()], axis=0)
            for name, people in self.angles.items()
        }

    def line(self) -> str:
        """The row of the table."""
        cells = self.cells()
        told = []
        for name in JOINTS:
            rms, centred, share = cells.get(name, [np.nan] * 3)
            band = f", {share:.0%}" if np.isfinite(share) else ""
            band += f", of {told_share:.0%}" if (told_share := np.mean(self.told[name] or [1])) < 1 else ""
            told.append(f"{rms:.1f} ({centred:.1f}{band})" if np.isfinite(rms) else "–")
        off = np.array(self.contacts)
        known = off[np.isfinite(off)]
        told.append(f"{known.mean():+.0f} ± {known.std():.0f}, {len(known)} of {len(off)}" if len(known) else "–")
        for name, unit in (("speed", ".2f"), ("step_length", ".2f"), ("cadence", ".1f")):
            value = np.array(self.parameters[name])
            value = value[np.isfinite(value)]
            told.append(f"{value.mean():+{unit}} ± {value.std():{unit}}" if len(value) else "–")
        return " | ".join(told)


def figures(off: np.ndarray, band: np.ndarray) -> list[float]:
    """Rms of errors [degrees], without their mean, and the share of them in their bands."""
    off = (off + 180) % 360 - 180
    known = np.isfinite(off) & np.isfinite(band)
    inside = float((np.abs(off) <= band)[known].mean()) if known.any() else np.nan
    return [float(np.sqrt(np.nanmean(off**2))), float(np.nanstd(off)), inside]


def replace_time(event, start: float):
    """The event, of a film that begins at `start` [s] of the capture."""
    return type(event)(event.time + start, event.kind, event.side)


def measured(
    walks: list[Walk], views: tuple[str, ...], network, peer: bool, draws: int
) -> Iterator[tuple[str, str, str, Row]]:
    """Points, view, method and errors."""
    for view in views:
        rows: dict = defaultdict(Row)
        for number, one in enumerate(walks):
            rng = np.random.default_rng([number, list(VIEWS).index(view)])
            _, exact, exact_feet = film(one, view, rng)
            high = exact.positions[..., 1]
            tall = float(np.nanmedian(np.nanmax(high, axis=1) - np.nanmin(high, axis=1))) / _TALL
            for name in POINTS:
                points, feet = (exact, exact_feet) if name == POINTS[0] else detected(exact, exact_feet, tall, rng)
                rows[name, "lift"].add(one, lifted(one, replace(points, feet=feet), view, network, draws))
                rows[name, "in the plane"].add(one, in_the_plane(points, feet, one.height))
                if peer:
                    size = PICTURE["width"], PICTURE["height"]
                    rows[name, "myogait"].add(one, myogait(points, feet, one.height, size))
        for (name, method), row in rows.items():
            yield name, view, method, row


def main() -> None:
    """Print a table."""
    parser = Arguments(__doc__, mocap=("btkdata", "nimble", "cmu_asfamc"))
    parser.add_argument("--network", type=Path, help="weights (.npz) without CMU's people left out")
    parser.add_argument("--draws", type=int, default=32, quick=8, help="from the posterior, for bands")
    asked = parser.parse_args()
    peer = has("myogait")
    network, groups = None, [laboratory.in_no_fit(asked.mocap, 1 if asked.quick else None)]
    if asked.network is not None:
        network = left_out.network(asked.network)
        groups.append(laboratory.cmu(asked.mocap, left_out.LEFT_OUT))
    views = ("side", "hand-held") if asked.quick else tuple(VIEWS)
    for walks in groups:
        _table(walks, views, network, peer, asked.draws)


def _table(walks: list[Walk], views: tuple[str, ...], network, peer: bool, draws: int) -> None:
    print(f"\n{len(walks)} walks of {len({one.person for one in walks})} people\n")
    print(
        "| points | view | by | hip | knee | ankle | pelvis obliquity | pelvis rotation | trunk lean | contacts [ms] "
        "| speed [m/s] | step length [m] | cadence [1/min] |\n|" + "-|" * 13
    )
    for name, view, method, row in measured(walks, views, network, peer, draws):
        print(f"| {name} | {view} | {method} | {row.line()} |", flush=True)
        if (name, view, method) == (POINTS[1], "side", "lift"):
            headline(hip=row.cells()["hip_flexion"][0], knee=row.cells()["knee_flexion"][0])


if __name__ == "__main__":
    main()
