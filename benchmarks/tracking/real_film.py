"""Track a real film, one view of Pose2Sim's four-camera clip of a man on a beam, and compare with its 3D joints.

python -m benchmarks.tracking.real_film FOLDER   (with Pose2Sim's demo: Demo_SinglePerson and from_history)
"""

import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np

from motionenv.body import markers
from motionenv.render.video.decode import video_info
from motionenv.tracking import FPCAPrior, MixturePrior, VelocityPrior
from motionenv.tracking.video.track import track_video
from motionenv.types import MARKERS, Camera, Skeleton

VIEW, JOINT_FPS, SUBPIXELS = "cam03", 60.0, 64
SHORT = {"left": "L", "right": "R"}
JOINTS = {
    f"{side}_{joint}": SHORT[side] + joint.capitalize()
    for joint in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")
    for side in SHORT
}


def calibrated(folder: Path) -> Camera:
    """The view's camera, from the Qualisys calibration."""
    info = video_info(folder / f"Demo_SinglePerson/videos/{VIEW}.mp4")
    tree = ET.parse(folder / "Demo_SinglePerson/calibration/Calib.qca.txt")
    node = next(c for c in tree.getroot().iter("camera") if c.get("serial") == VIEW)
    place, inner = node.find("transform").attrib, node.find("intrinsic").attrib
    R = np.diag([1.0, -1.0, -1.0]) @ [[float(place[f"r{i}{j}"]) for j in (1, 2, 3)] for i in (1, 2, 3)]
    f, c = ([float(inner[f"{name}{axis}"]) / SUBPIXELS for axis in "UV"] for name in ("focalLength", "centerPoint"))
    K = np.array([[f[0], 0, c[0]], [0, f[1], c[1]], [0, 0, 1]])
    return Camera(K, R, -R @ [float(place[k]) / 1000 for k in "xyz"], info.width, info.height)


def triangulated(folder: Path) -> np.ndarray:
    """Joints (T, 12, 3) [m] triangulated from all cameras, in the order of `JOINTS`."""
    path = folder / "from_history/S00_P00_T01_BalancingTrial_0-100.trc"
    rows = [line.split("\t") for line in path.read_text().splitlines()]
    names = [n for n in rows[3][2:] if n]
    table = np.array([[float(v) for v in row[2 : 2 + 3 * len(names)]] for row in rows[6:] if len(row) > 5])
    return table.reshape(len(table), -1, 3)[:, [names.index(n) for n in JOINTS.values()]][..., [2, 0, 1]]


def about_hips(joints: np.ndarray) -> np.ndarray:
    """Joints (T, 12, 3) relative to the midpoint of the hips."""
    hips = [i for i, name in enumerate(JOINTS) if name.endswith("_hip")]
    return joints - joints[:, hips].mean(axis=1, keepdims=True)


def mixture(skeleton: Skeleton, fps: float) -> MixturePrior:
    """Mixture of the walking prior and, with weight 0.3, constant velocity."""
    return MixturePrior(FPCAPrior(skeleton=skeleton, fps=fps), VelocityPrior(skeleton=skeleton, fps=fps), 0.3)


def main() -> None:
    """Print the table."""
    folder = Path(sys.argv[1])
    camera, true = calibrated(folder), triangulated(folder)
    print("| prior | frames followed | relative error, first ten | all | overlap |\n|-|-|-|-|-|")
    for name, prior in {"fpca": None, "mixture": mixture}.items():
        found = track_video(
            folder / f"Demo_SinglePerson/videos/{VIEW}.mp4", camera, prior=prior, height=1.75, person=1, seed=0
        )
        if not found.followed.any():
            print(f"| {name} | 0 of {len(found.followed)}: LOST, {found.losses[0].reason} | – | – | "
                  f"{np.nanmean(found.overlap):.2f} |", flush=True)  # fmt: skip
            continue
        joints = markers(found.motion.poses, found.motion.skeleton)[:, [MARKERS.index(m) for m in JOINTS]]
        at = np.minimum(np.arange(len(joints)) * JOINT_FPS / found.motion.fps, len(true) - 1).round().astype(int)
        error = 1000 * np.linalg.norm(about_hips(joints) - about_hips(true[at]), axis=-1).mean(axis=1)
        first = np.flatnonzero(found.followed)[:10]
        print(
            f"| {name} | {found.followed.sum()} of {len(joints)} | {error[first].mean():.0f} mm "
            f"| {np.nanmean(error):.0f} mm | {np.nanmean(found.overlap):.2f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
