"""What bands would cover where only a part of the body is ever seen, or nothing for a while.

    motionenv bench free_walking.parts

Clips of Bandai-Namco before a camera of which only the elevation is known. `Lifted.determined` follows from this table:
bands don't hold for what isn't seen, nor for anything where no leg is.
"""

import numpy as np

from benchmarks import Arguments
from benchmarks.free_walking import bandai
from benchmarks.free_walking.__main__ import PELVIS, _turned_alike
from motionenv.lifting import fit_freely
from motionenv.types import MARKERS, Points

_PARTS = {
    "all": lambda name: True,
    "legs alone": lambda name: name == "pelvis" or any(part in name for part in ("hip", "knee", "ankle")),
    "all but knees and ankles": lambda name: not any(part in name for part in ("knee", "ankle")),
    "right side and trunk": lambda name: not name.startswith("left"),
    "knees and ankles alone": lambda name: any(part in name for part in ("knee", "ankle")),
}


def _covered(points: Points, elevation: float, hidden: np.ndarray) -> np.ndarray:
    """Shares of coordinates inside their 90 % bands, of markers that are seen and of `hidden` ones (frames, 15)."""
    shown = Points(np.where(hidden[..., None], np.nan, points.positions), points.fps, "px", points.truth)
    fit = fit_freely(shown, elevation=elevation)
    truth = points.truth.positions
    places = _turned_alike(fit.positions, truth)
    inside = np.abs((places - places[:, [PELVIS]]) - (truth - truth[:, [PELVIS]])) < 1.645 * fit.deviations
    others = np.arange(len(MARKERS)) != PELVIS
    seen, unseen = (inside[which & others] for which in (~hidden, hidden))
    return np.array([seen.mean(), unseen.mean() if len(unseen) else np.nan])


def main() -> None:
    """Print the table."""
    parser = Arguments(__doc__, mocap=True)
    parser.add_argument("--clips", type=int, default=8, quick=1)
    asked = parser.parse_args()
    print("| seen | in band, forward walks: seen | unseen | turns: seen | unseen |\n|-|-|-|-|-|")
    rows = {name: [[part(marker) for marker in MARKERS]] for name, part in _PARTS.items()}
    for name in [*rows, "all, but for 1.2 s"]:
        found = []
        for kind in ("forward walks", "turns"):
            each = []
            for clip in bandai.clips(asked.mocap, kind, asked.clips):
                camera = bandai.cameras(clip, np.random.default_rng(sum(map(ord, clip.name))))[0]
                points = bandai.seen(clip, camera)
                hidden = ~np.broadcast_to(rows.get(name, rows["all"]), points.positions.shape[:2])
                if name not in rows:
                    first = len(hidden) // 3
                    hidden = np.zeros_like(hidden)
                    hidden[first : first + round(1.2 * points.fps)] = True
                each.append(_covered(points, bandai.elevation(camera), hidden))
            known = np.array(each)
            found += [f"{share:.0%}" if np.isfinite(share) else "" for share in known.mean(axis=0)]
        print(f"| {name} | {' | '.join(found)} |", flush=True)


if __name__ == "__main__":
    main()
