"""Joint centres found from clusters alone, against those of markers on the same knees and ankles.

The captures carry both: markers on hips, knees and ankles, and rigid clusters on thighs and shanks. The thickness of
limbs that places functional joints outwards (`functional._THICK`) comes from these captures too, so that this is
how well they are described, not how well a stranger would be.

    motionenv bench mocap.clusters [--mocap FOLDER]
"""

from pathlib import Path

import numpy as np

from benchmarks import Arguments
from motionenv.mocap import read
from motionenv.mocap.clinical import Measurements, lower_body
from motionenv.mocap.marker_sets import find_landmarks
from motionenv.types import Markers

FILES = (
    "nimble/osim/LaiArnoldSubject6/walking1.trc",
    "nimble/grf/Subject4/MarkerData/walking1.trc",
    "nimble/grf/Subject4/MarkerData/walking2.trc",
    "nimble/grf/Subject4/MarkerData/walking4.trc",
)


def clusters_only(markers: Markers) -> dict[str, np.ndarray]:
    """The landmarks of OpenSim's marker set without those on hips, knees and ankles, and its clusters."""
    on_joints = ("hip", "knee", "ankle")
    at = {k: v for k, v in find_landmarks(markers).positions.items() if not any(j in k for j in on_joints)}
    for side, letter in (("left", "L"), ("right", "r")):
        for limb, words in (("thigh", ("thigh",)), ("shank", ("sh", "shank"))):
            names = [n for n in markers.names if n.startswith(tuple(f"{letter}_{word}" for word in words))]
            at |= {f"{side}_{limb}_cluster_{i}": markers.positions[:, markers.index(n)] for i, n in enumerate(names, 1)}
    return at


def bend(leg) -> np.ndarray:
    """Angle [degrees] between thigh and shank, 0 when straight."""
    a, b = leg.hip - leg.knee, leg.knee - leg.ankle
    cosine = (a * b).sum(-1) / np.linalg.norm(a, axis=-1) / np.linalg.norm(b, axis=-1)
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))


def main() -> None:
    """Print a row per capture and side."""
    mocap = Arguments(__doc__, mocap=("nimble",)).parse_args().mocap
    print("| capture | side | knee off, mm | ankle off, mm | knee flexion, rms ° |\n|-|-|-|-|-|")
    for file in FILES:
        markers = read(mocap / file)
        known = lower_body(find_landmarks(markers).positions, Measurements())
        found = lower_body(clusters_only(markers), Measurements())
        for side in ("left", "right"):
            a, b = getattr(known, side), getattr(found, side)
            apart = (np.linalg.norm(getattr(a, j) - getattr(b, j), axis=-1) for j in ("knee", "ankle"))
            off = [1000 * np.nanmedian(distance) for distance in apart]
            flexion = np.sqrt(np.nanmean((bend(a) - bend(b)) ** 2))
            print(f"| {Path(file).parts[2]} {Path(file).stem} | {side} | {off[0]:.0f} | {off[1]:.0f} | {flexion:.1f} |")


if __name__ == "__main__":
    main()
