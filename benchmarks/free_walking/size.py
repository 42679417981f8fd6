"""How large lifted bodies are, and what decides it: ankles' heights, statures, noise, cameras' heights and distances.

    motionenv bench free_walking.size

Each person stands before one camera of known pose. The first table is of exact points: by how much bodies are too
large (mean and deviation of the distances from the pelvis), and MPJPE; as lifted, without what is known of statures,
with an ankle 95 mm high whoever it is, with the true height of standing ankles, and at the true body unit. The
second is of people left out, seen from other heights and distances: by how much the body unit is too large, given the
true ankle, and how often its 90 % interval holds.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks import Arguments, headline
from benchmarks.free_walking import bandai, coverage, left_out
from motionenv.lifting import BAND
from motionenv.lifting.free.lifter import FreeFit, fit_freely
from motionenv.lifting.free.posture_network import BODY_UNIT
from motionenv.lifting.free.smoother import contacts
from motionenv.metrics import pelvis_mpjpe
from motionenv.render.cameras import fit_view
from motionenv.types import MARKERS, Camera, Markers

_M = {name: i for i, name in enumerate(MARKERS)}
#: By how much the camera looks down [rad], and how much farther away it is than it must be [m].
VIEWS = {
    "3°": (0.05, 0), "8°": (0.14, 0), "17°": (0.3, 0), "35°": (0.6, 0),
    "8°, 3 m farther": (0.14, 3), "8°, 6 m farther": (0.14, 6), "8°, 10 m farther": (0.14, 10),
}  # fmt: skip
DAMAGE = {name: (left_out.DAMAGE | left_out.DETECTED)[name] for name in ("clean", "5 px, 20 % missing")}
_ANKLE = 0.095  # [m]


def truth(one: Markers) -> tuple[float, float]:
    """The body unit and the height of standing ankles [m]."""
    places = one.positions[np.isfinite(one.positions).all(axis=(1, 2))]
    length = np.linalg.norm(places[:, _M["sternum"]] - places[:, _M["pelvis"]], axis=-1)
    for side in ("left", "right"):
        leg = places[:, [_M[f"{side}_{joint}"] for joint in ("hip", "knee", "ankle")]]
        length = length + 0.5 * np.linalg.norm(np.diff(leg, axis=1), axis=-1).sum(axis=1)
    unit = float(np.median(length)) / 2.88
    return unit, unit * contacts(places / unit, one.fps)[1]


def by_cause(fit: FreeFit, camera: Camera, one: Markers) -> np.ndarray:
    """By how much the body is too large [%] and MPJPE [mm] (5, 2), as lifted and with one thing known after another."""
    unit, ankle = truth(one)
    height, floor = camera.centre[2], fit._stretches[0][0].floor
    units = [
        fit.unit, height / (_ANKLE / BODY_UNIT - floor), (height - _ANKLE) / -floor, (height - ankle) / -floor, unit,
    ]  # fmt: skip
    told = []
    for each in units:
        places = fit.origin + (fit.positions - fit.origin) * each / fit.unit
        away = [np.nanmean(np.linalg.norm(p - p[:, [_M["pelvis"]]], axis=-1)) for p in (places, one.positions)]
        told.append((100 * (away[0] / away[1] - 1), 1e3 * np.nanmean(pelvis_mpjpe(places, one.positions))))
    return np.array(told)


def left_out_people(mocap: Path, quick: bool) -> dict[str, list[Markers]]:
    """Laboratories' people, as captured and in other styles, and CMU's, of whose walks every third will do."""
    found = {
        "laboratories": coverage.captured(mocap, 1 if quick else None),
        "… in other styles": coverage.varied(mocap, 1 if quick else 12, np.random.default_rng(5)),
    }
    return found if quick else found | {"CMU": left_out.captured(mocap)[::3]}


def causes(people: list[Markers], seed: int) -> str:
    """The cells of the first table."""
    each, ankles = [], []
    for number, one in enumerate(people):
        camera = bandai.cameras(one, np.random.default_rng([seed, number]))[0]
        each.append(by_cause(fit_freely(bandai.seen(one, camera), camera), camera, one))
        ankles.append(1e3 * truth(one)[1])
    mean, spread = np.mean(each, axis=0), np.std(each, axis=0)
    cells = [f"{size:+.1f} ± {off:.1f} %, {mm:.1f}" for (size, mm), (off, _) in zip(mean, spread, strict=True)]
    return f"{np.mean(ankles):.0f} ± {np.std(ankles):.0f} | {' | '.join(cells)}"


def from_afar(people: list[Markers], view: str, damage) -> tuple[str, float]:
    """A cell of the second table, and the mean error [%]."""
    down, farther = VIEWS[view]
    off, inside = [], []
    for number, one in enumerate(people):
        rng = np.random.default_rng([7, number])
        camera = fit_view(one.positions, rng.uniform(0, 2 * np.pi), elevation=down, **bandai.PICTURE)
        camera = replace(camera, t=camera.t + np.array([0, 0, farther]))
        fit = fit_freely(damage(bandai.seen(one, camera), rng), camera)
        unit, ankle = truth(one)
        off.append(100 * np.log((camera.centre[2] - ankle) / -fit._stretches[0][0].floor / unit))
        inside.append(abs(np.log(fit.unit / unit)) < BAND * fit.unit_deviation)
    return f"{np.mean(off):+.1f} ± {np.std(off):.1f} %, {np.mean(inside):.0%}", float(np.mean(off))


def main() -> None:
    """Print both tables."""
    parser = Arguments(__doc__, mocap=("btkdata", "nimble", "cmu_asfamc", "bandai_namco"))
    asked = parser.parse_args()
    known = left_out_people(asked.mocap, asked.quick)
    count, skip = (1, 0) if asked.quick else (bandai.CLIPS, bandai.CLIPS)
    shown = known | {
        f"Bandai-Namco, other {kind}": bandai.clips(asked.mocap, kind, count, skip=skip)
        for kind in ("forward walks", "turns")
    }
    print("| exact points | ankle [mm] | as lifted | no statures | 95 mm | true ankle | true unit |\n|-|-|-|-|-|-|-|")
    for seed, (name, people) in enumerate(shown.items()):
        print(f"| {name} | {causes(people, seed)} |", flush=True)
    print(f"| camera | points | {' | '.join(known)} |\n|-|-|{'-|' * len(known)}")
    worst = 0.0
    for view in list(VIEWS)[: 1 if asked.quick else None]:
        for name, damage in DAMAGE.items():
            cells = [from_afar(people, view, damage) for people in known.values()]
            print(f"| {view} | {name} | {' | '.join(told for told, _ in cells)} |", flush=True)
            worst = max(worst, *(abs(off) for _, off in cells))
    headline(worst=worst)


if __name__ == "__main__":
    main()
