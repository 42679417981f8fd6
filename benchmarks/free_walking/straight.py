"""Straight walks of people left out, before cameras.

    motionenv bench free_walking.straight --network a.npz

The network hasn't seen the six subjects (see `left_out`). MPJPE aligns the pelvis in the axes of the world if the
camera is known, and P-MPJPE every frame; "in band" are joint coordinates inside their 90 % bands.
"""

from dataclasses import replace

import numpy as np

from benchmarks.free_walking import bandai, left_out
from motionenv.lifting import BAND
from motionenv.lifting.free.lifter import fit_freely
from motionenv.metrics import aligned_mpjpe, pelvis_mpjpe
from motionenv.types import MARKERS, Markers

_PELVIS = MARKERS.index("pelvis")


def noisy(pixels: float):
    """Points with so many pixels of noise."""
    return lambda points, rng: replace(
        points, positions=points.positions + pixels * rng.standard_normal(points.positions.shape)
    )


KNOWN, UNKNOWN = "known", "unknown"
DAMAGE = {
    "clean": lambda points, rng: points, "1 px": noisy(1.0), "2 px": noisy(2.0), "5 px": noisy(5.0),
    "5 px, 20 % missing": bandai.noisy, "bursts": bandai.bursts,
}  # fmt: skip


def _figures(positions, deviations, truth) -> list[float]:
    about = lambda places: np.delete(places - places[:, [_PELVIS]], _PELVIS, axis=1)
    inside = np.abs(about(positions) - about(truth)) < BAND * np.delete(deviations, _PELVIS, axis=1)
    return [1e3 * pelvis_mpjpe(positions, truth).mean(), 1e3 * aligned_mpjpe(positions, truth).mean(), inside.mean()]


def main() -> None:
    """Print the table."""
    parser = left_out.arguments(__doc__)
    asked = parser.parse_args()
    network = left_out.network(asked.network)
    print("| points | camera | MPJPE [mm] | P-MPJPE [mm] | in band |\n|-|-|-|-|-|")
    walks = left_out.captured(asked.mocap)[: 1 if asked.quick else None]
    for name, damage in DAMAGE.items():
        for lifter, rows in _compared(walks, damage, network).items():
            mpjpe, aligned, inside = np.mean(rows, axis=0)
            shown, share = ("", "") if lifter != KNOWN else (f"{mpjpe:.1f}", f"{inside:.0%}")
            print(
                f"| {name} | {lifter} | {shown} | {aligned:.1f} | {share} |",
                flush=True,
            )


def _compared(walks: list[Markers], damage, network) -> dict[str, list[list[float]]]:
    """Figures of every walk, with the camera and without."""
    table: dict[str, list[list[float]]] = {KNOWN: [], UNKNOWN: []}
    for number, walk in enumerate(walks):
        rng = np.random.default_rng([0, number])
        camera = bandai.cameras(walk, rng)[0]
        points = damage(bandai.seen(walk, camera), rng)
        truth = points.truth.positions
        down = bandai.elevation(camera)
        for lifter, told in ((KNOWN, camera), (UNKNOWN, None)):
            fit = fit_freely(points, told, elevation=down, network=network)
            table[lifter].append(_figures(fit.positions, fit.deviations, truth))
    return table


if __name__ == "__main__":
    main()
