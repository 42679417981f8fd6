"""How often 90 % bands hold, by group of people and motion.

    motionenv bench free_walking.coverage [--count 12]

The bands' dependence on how strange a motion is was chosen on laboratories' people, as captured and in other styles and
proportions; Bandai-Namco's actors are of nobody that anything was chosen on. Cameras are known. The mean error of the
joints' coordinates about the pelvis (root mean square) stands beside the share of them inside their bands.
"""

from collections.abc import Iterator

import numpy as np

from benchmarks import Arguments, headline
from benchmarks.free_walking import bandai, clips, left_out
from benchmarks.lifting import laboratory
from motionenv.lifting import BAND
from motionenv.lifting.free.lifter import fit_freely
from motionenv.mocap import read, retarget
from motionenv.types import MARKERS, Markers, Motion

_PELVIS = MARKERS.index("pelvis")
_SHORTEST = 45  # frames
DAMAGE = left_out.DAMAGE | left_out.DETECTED


def captured(mocap, most: int | None) -> list[Markers]:
    """Walks of laboratories, standing over the origin on average."""
    found = []
    for one in laboratory.in_no_fit(mocap, most):
        middle = np.nanmean(one.positions[:, _PELVIS], axis=0) * [1, 1, 0]
        found.append(Markers(MARKERS, one.positions - middle, one.fps))
    return [one for one in found if len(one.positions) >= _SHORTEST]


def varied(mocap, count: int, rng: np.random.Generator) -> list[Markers]:
    """Clips of those with Plug-in Gait in other styles, proportions and definitions of joints (see `clips`)."""
    files = [mocap / file for each in laboratory.OWN_ANGLES.values() for file in each]
    sources = clips.Sources([_whole(retarget(read(file, override=False))) for file in files], [], [])
    found: list[Markers] = []
    while len(found) < count:
        made = clips.restyled(sources, rng, 128, left_out.FPS)
        if made is not None and len(made) >= _SHORTEST:
            found.append(Markers(MARKERS, made, left_out.FPS))
    return found


def _whole(motion: Motion) -> Motion:
    """The longest stretch of a motion in which all is known."""
    first, end = laboratory.longest(np.isfinite(motion.poses).all(axis=1))
    return Motion(motion.poses[first:end], motion.skeleton, motion.fps)


def shares(people: list[Markers], seed: int) -> Iterator[tuple[str, float, float]]:
    """Kind of points, share of coordinates in their bands, and rms error [mm], of each one before one camera."""
    for number, one in enumerate(people):
        rng = np.random.default_rng([seed, number])
        camera = bandai.cameras(one, rng)[0]
        for name, damage in DAMAGE.items():
            fit = fit_freely(damage(bandai.seen(one, camera), rng), camera)
            about = lambda places: np.delete(places - places[:, [_PELVIS]], _PELVIS, axis=1)
            off = np.abs(about(fit.positions) - about(one.positions))
            known = np.isfinite(off)
            inside = off < BAND * np.delete(fit.deviations, _PELVIS, axis=1)
            yield name, float(inside[known].mean()), 1e3 * float(np.sqrt((off[known] ** 2).mean()))


def main() -> None:
    """Print a table."""
    parser = Arguments(__doc__, mocap=("btkdata", "nimble", "bandai_namco"))
    parser.add_argument("--count", type=int, default=12, quick=1, help="clips of each kind")
    asked = parser.parse_args()
    groups = {
        "laboratories, as captured": captured(asked.mocap, 1 if asked.quick else None),
        "laboratories, in other styles": varied(asked.mocap, asked.count, np.random.default_rng(77)),
    } | {f"Bandai-Namco, {kind}": bandai.clips(asked.mocap, kind, asked.count) for kind in bandai.KINDS}
    print(f"| people | {' | '.join(DAMAGE)} |\n|-|" + "-|" * len(DAMAGE))
    least, most = 1.0, 0.0
    for seed, (group, people) in enumerate(groups.items()):
        told = list(shares(people, seed))
        means = {name: np.mean([row[1:] for row in told if row[0] == name], axis=0) for name in DAMAGE}
        print(f"| {group} | {' | '.join(f'{s:.0%}, {e:.0f} mm' for s, e in means.values())} |", flush=True)
        if group.startswith("Bandai"):
            least, most = (f(b, *(s for s, _ in means.values())) for f, b in ((min, least), (max, most)))
    headline(least=least, most=most)


if __name__ == "__main__":
    main()
