"""Choose the settings of the fit of all frames, one after the other, on people left out.

    motionenv bench free_walking.tune --network a.npz --models A B [--count 24]

MPJPE [mm] about the pelvis, a mean of three kinds of points of clips (see `left_out`); and the share of coordinates
inside their 90 % bands, by joint, which calibrates `smoother._UNSEEN`. The last rows are of a detector's points.
"""

from dataclasses import replace

import numpy as np

from benchmarks.free_walking import left_out
from motionenv.lifting.free.lifter import fit_freely
from motionenv.lifting.free.posture_network import PostureNetwork
from motionenv.lifting.free.smoother import DEFAULTS, Settings
from motionenv.metrics import pelvis_mpjpe
from motionenv.types import MARKERS

TRIED = {
    "posture": (1.0, 2.0, 4.0), "velocity": (0.2, 0.35, 0.6), "limb": (0.01, 0.03, 0.08), "floor": (0.03, 0.06, 0.12),
    "sliding": (0.2, 0.5, 1.2), "acceleration": ((3.0, 3.0, 8.0), (6.0, 6.0, 12.0), (12.0, 12.0, 20.0)),
    "least_ray": (0.004, 0.01, 0.02), "rounds": (5, 7, 10),
}  # fmt: skip


def errors(sequences: list[left_out.Sequence], network: PostureNetwork, settings: Settings) -> tuple[float, np.ndarray]:
    """Mean error [mm], and the share of each joint's coordinates inside their bands (15,)."""
    each, inside = [], []
    for sequence in sequences:
        fit = fit_freely(sequence.points, sequence.camera, network=network, settings=settings)
        each.append(1000 * pelvis_mpjpe(fit.positions, sequence.truth).mean())
        about = lambda places: places - places[:, [MARKERS.index("pelvis")]]
        off = np.abs(about(fit.positions) - about(sequence.truth))
        inside.append((off < 1.645 * fit.deviations).mean(axis=(0, 2)))
    return float(np.mean(each)), np.mean(inside, axis=0)


def main() -> None:
    """Print errors by setting, and coverage by joint."""
    parser = left_out.arguments(__doc__, models=True)
    parser.add_argument("--count", type=int, default=24, quick=1)
    asked = parser.parse_args()
    network = left_out.network(asked.network)
    people = left_out.varied(asked.mocap, tuple(asked.models), asked.count)
    varied, detected = (list(left_out.sequences(people, damages=d)) for d in (left_out.DAMAGE, left_out.DETECTED))
    captured = list(left_out.sequences(left_out.captured(asked.mocap)[: 1 if asked.quick else None]))
    for name, people in (("as captured", captured), ("varied", varied)):
        error, inside = errors(people, network, DEFAULTS)
        shares = ", ".join(f"{m} {i:.0%}" for m, i in zip(MARKERS, inside, strict=True))
        print(f"{name}: {error:.1f} mm; in band {shares}")
    print("| setting | value | varied [mm] |\n|-|-|-|")
    for name, values in TRIED.items():
        for value in values[:1] if asked.quick else values:
            error, _ = errors(varied, network, replace(DEFAULTS, **{name: value}))
            print(f"| {name} | {value} | {error:.2f} |", flush=True)
    for value in (0.06, 0.1, 0.14)[: 1 if asked.quick else None]:
        error, inside = errors(detected, network, replace(DEFAULTS, detector_ray=value))
        print(f"| detector_ray | {value} | {error:.2f}, {inside.mean():.0%} in band |", flush=True)


if __name__ == "__main__":
    main()
