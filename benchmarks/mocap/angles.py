"""Clinical angles against those that Plug-in Gait stored in the same files, with and without their measurements.

motionenv bench mocap.angles [--mocap FOLDER]
"""

import numpy as np

from benchmarks import Arguments
from motionenv.errors import MotionError
from motionenv.mocap import read, retarget
from motionenv.mocap.clinical import Measurements, clinical_angles
from motionenv.types import POSE, Markers

#: Stored output, and the first of our three angles that it holds.
OUTPUTS = {"Pelvis": "pelvis_tilt", "Hip": "hip_flexion", "Knee": "knee_flexion", "Ankle": "ankle_dorsiflexion"}
_LETTERS = {"left": "L", "right": "R"}


def stored(markers: Markers, side: str, output: str) -> np.ndarray | None:
    """The file's own angles (frames, 3) [degrees] of one joint; None if it has none."""
    outputs = markers.recording.outputs if markers.recording else {}
    wanted = f"{_LETTERS[side]}{output}Angle"
    return next((values for name, values in outputs.items() if name.startswith(wanted)), None)


def errors(markers: Markers, measurements: Measurements | None) -> dict[str, float]:
    """Rms difference [degrees] in flexion (of the pelvis: tilt), the larger of both sides, by joint.

    Args:
        markers: a capture that holds Plug-in Gait's outputs.
        measurements: None takes those of the file.
    """
    angles = clinical_angles(markers, measurements=measurements)
    found: dict[str, float] = {}
    for side in _LETTERS:
        for output, name in OUTPUTS.items():
            theirs = stored(markers, side, output)
            if theirs is None:
                continue
            off = angles[f"{side}_{name}"] - theirs[:, 0]
            if np.isfinite(off).any():
                found[output] = max(found.get(output, 0.0), float(np.sqrt(np.nanmean(off**2))))
    return found


def body_knee(markers: Markers) -> float:
    """Rms difference [degrees] of the 25-DOF body's knees from the stored knee flexion, the larger of both sides."""
    motion = retarget(markers)
    worst = 0.0
    for side in _LETTERS:
        theirs = stored(markers, side, "Knee")
        off = np.degrees(motion.poses[:, POSE.index(f"{side}_knee_flexion")]) - theirs[:, 0]
        worst = max(worst, float(np.sqrt(np.nanmean(off**2))))
    return worst


def main() -> None:
    """Print a row per file."""
    mocap = Arguments(__doc__, mocap=("btkdata",)).parse_args().mocap
    head = "| file | has measurements | with them: pelvis / hip / knee / ankle | without | the body's knee |"
    print(f"{head}\n|-|-|-|-|-|")
    for path in sorted(p for p in mocap.rglob("*") if p.suffix.lower() == ".c3d"):
        try:
            markers = read(path)
            if stored(markers, "left", "Knee") is None:
                continue
            given, without = errors(markers, None), errors(markers, Measurements())
        except MotionError as error:
            print(f"| {path.name} | | {str(error).partition(': ')[2][:80]} | | |")
            continue
        has = any(key.endswith("LLEGLENGTH") for key in markers.recording.parameters)
        cells = [" / ".join(f"{e[o]:.1f}" if o in e else "–" for o in OUTPUTS) for e in (given, without)]
        print(f"| {path.name} | {'yes' if has else 'no'} | {cells[0]} | {cells[1]} | {body_knee(markers):.1f} |")


if __name__ == "__main__":
    main()
