"""Captured walks, independently estimated stride times, and occlusions, for benchmarks and tests."""

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.signal import find_peaks

from motionenv.mocap.readers import asfamc
from motionenv.mocap.retargeting import retarget, to_markers
from motionenv.types import MARKERS, Markers

SAME_PERSON = {"37": "12", "38": "07"}  # of CMU, by the database's descriptions and by their build


class Walk(NamedTuple):
    """A walk: `angles` (frames, m) are the input of motionenv; the extremes of the series `legs` are gait events."""

    name: str
    angles: np.ndarray
    legs: list[np.ndarray]


def straight_trials(mocap) -> list[str]:
    """The trials marked as straight in the list that accompanies the CMU walks."""
    rows = (line.split("|") for line in (mocap / "CMU_TRIALS.md").read_text().splitlines())
    return [row[1].strip() for row in rows if len(row) > 9 and row[-2].strip() == "yes"]


def cmu_markers(mocap: Path) -> tuple[list[Markers], list[str]]:
    """The 15 markers of the straight CMU walks, and the person of each."""
    trials = straight_trials(mocap)
    read = [to_markers(asfamc.read(mocap / "cmu_asfamc" / t[:2] / f"{t}.amc", fps=120)) for t in trials]
    return read, [SAME_PERSON.get(t[:2], t[:2]) for t in trials]


def read_cmu(mocap) -> list[Walk]:
    """The 55 straight CMU walks: 19 joint angles; positions of ankles and knees ahead of the pelvis."""
    walks = []
    for trial in straight_trials(mocap):
        markers = asfamc.read(mocap / "cmu_asfamc" / trial[:2] / f"{trial}.amc", fps=120)
        points = dict(zip(MARKERS, np.moveaxis(to_markers(markers).positions, 1, 0), strict=True))
        ahead = points["pelvis"][-1] - points["pelvis"][0]
        joints = [f"{side}_{joint}" for side in ("left", "right") for joint in ("ankle", "knee")]
        legs = [(points[j] - points["pelvis"])[:, :2] @ ahead[:2] for j in joints]
        walks.append(Walk(trial, retarget(markers).angles, legs))
    return walks


def read_santos(mocap) -> list[Walk]:
    """25 people × 4 walks: four markers of a leg relative to the pelvis; knee angle, thigh and shank for the events."""
    walks = []
    for person in sorted((mocap / "santos25").glob("user*")):
        trials = sorted({re.search(r"_(\d{4})_", path.name)[1] for path in person.glob("*.csv")})
        for trial in trials:
            points = {
                m: np.loadtxt(next(person.glob(f"*_{trial}_{m}_*")), delimiter=",") / 1000
                for m in ("ias", "ftc", "fle", "fax", "ttc")
            }
            thigh, shank = points["fle"] - points["ftc"], points["ttc"] - points["fle"]
            lower = points["fax"] - points["ttc"]
            lengths = np.linalg.norm(thigh, axis=1) * np.linalg.norm(lower, axis=1)
            knee = np.arccos((thigh * lower).sum(axis=1) / lengths)
            angles = np.hstack([points[m] - points["ias"] for m in ("ftc", "fle", "fax", "ttc")])
            walks.append(Walk(f"{person.name}_{trial}", angles, [knee, thigh[:, 0], shank[:, 0]]))
    return walks


def stride_time(legs, fps) -> float:
    """Median time between equal events [s]: the prominent extremes of every series and of its derivative."""
    times = np.concatenate([between for x in legs for y in (x, np.gradient(x)) for between in _intervals(y, fps)])
    return float(np.median(times[np.abs(times / np.median(times) - 1) < 0.25]))


def _intervals(x, fps):
    smooth = gaussian_filter1d(x, 0.02 * fps)
    for y in (smooth, -smooth):
        peaks, _ = find_peaks(y, prominence=0.5 * np.ptp(y), distance=int(0.5 * fps))
        left, here, right = y[peaks - 1], y[peaks], y[peaks + 1]
        yield np.diff(peaks + 0.5 * (left - right) / (left - 2 * here + right)) / fps


def remove_blocks(z, seed, share=0.3, length=22) -> np.ndarray:
    """`z` with 30 % of the frames missing in blocks of about 0.2 s, all channels at once."""
    rng, gone = np.random.default_rng(seed), np.zeros(len(z), dtype=bool)
    while gone.mean() < share:
        start = rng.integers(0, len(z) - length)
        gone[start : start + length] = True
    z = np.array(z)
    z[gone] = np.nan
    return z
