"""Depth-camera walks of 100 people (Andersson & Araujo 2015) as walkers with markers missing; for tests and benchmarks.

The camera turns with the walker, who passes it facing +x and -x in turn. Only the side near the camera is measured, so
each pass yields the markers of that side and of the middle; `Eigenwalkers.fit` averages a person's passes in phase. The
camera's depth drifts while it turns, so passes are cut into short pieces. The data state no frame rate; 30 frames per
second is assumed.
"""

from itertools import pairwise

import numpy as np
from scipy.ndimage import uniform_filter1d

from motionenv.errors import MotionError
from motionenv.models.eigenwalkers.extraction import fourier_walker
from motionenv.models.eigenwalkers.fourier_series import FourierWalker
from motionenv.types import MARKERS, Markers

FPS = 30.0
MIDDLE = {"head": "Head", "sternum": "Shoulder-Center", "pelvis": "Hip-centro"}
JOINTS = {"shoulder": "Shoulder", "elbow": "Elbow", "wrist": "Wrist", "hip": "Hip", "knee": "Knee", "ankle": "Ankle"}
SIDES = {"left": "Left", "right": "Right"}
PIECE = 90  # frames; in three seconds a walker hardly turns relative to the camera or changes speed
LEAST_SHARE = 0.6  # least share of variance in the two harmonics; below, the period is unreliable
TOES = 0.05  # [m] least mean lead of the toes over the ankles along x; below, the walker is turning


def pass_walkers(folder, people: int = 100) -> tuple[list[FourierWalker], list[str], int]:
    """Walkers of all pieces in which a period is found, the person of each, and the number of all pieces.

    Args:
        folder: folder with kinectgait_001_100.npz.
        people: number of people to read.
    """
    walkers, persons, pieces = [], [], 0
    with np.load(folder / "kinectgait_001_100.npz") as file:
        names, unit = list(file["names"]), float(file["metres_per_unit"])
        for key in sorted(k for k in file.files if "/" in k and int(k[6:9]) <= people):
            joints = dict(zip(names, np.moveaxis(file[key] * unit, 1, 0), strict=True))
            for piece, heading in _pieces(joints):
                pieces += 1
                try:
                    walker = fourier_walker(_markers(joints, piece, heading), frequencies=(0.6, 1.4), steady=0.0)
                except MotionError:
                    continue
                if walker.shares.sum() >= LEAST_SHARE:
                    walkers.append(walker)
                    persons.append(key.split("/")[0])
    return walkers, persons, pieces


def _pieces(joints):
    """Yield frames and heading (±1 along x) of each piece in which the toes point in one direction."""
    toes = sum(joints[f"Foot-{s}"][:, 0] - joints[f"Ankle-{s}"][:, 0] for s in SIDES.values())
    toes = uniform_filter1d(toes, int(FPS / 2))
    heading = np.where(np.abs(toes) > TOES, np.sign(toes), 0.0)
    edges = np.flatnonzero(np.diff(heading, prepend=0, append=0))
    for start, end in pairwise(edges):
        for first in range(start, end - PIECE + 1, PIECE) if heading[start] else ():
            yield slice(first, first + PIECE), heading[start]


def _markers(joints, frames, heading) -> Markers:
    """Markers of a piece relative to the pelvis, without the far side, moving at 1 m/s along x."""
    near = "left" if heading > 0 else "right"
    source = MIDDLE | {f"{near}_{joint}": f"{name}-{SIDES[near]}" for joint, name in JOINTS.items()}
    positions = np.full((frames.stop - frames.start, len(MARKERS), 3), np.nan)
    for marker, name in source.items():
        x, y, z = (joints[name] - joints["Hip-centro"])[frames].T
        positions[:, MARKERS.index(marker)] = np.stack([heading * x, -heading * z, y], axis=-1)
    positions[..., 0] += np.arange(len(positions))[:, None] / FPS
    return Markers(MARKERS, positions, FPS)
