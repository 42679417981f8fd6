"""Whom `track_video` follows, and whether it knows when it is lost, on made-up films with the truth.

    motionenv bench tracking.choosing --first 2000 --films 60

The films are those of `benchmarks/tracking/made_films.py`, and people in them are detected by BlazePose; films 2000 to
2059 are reported. The verdict's threshold was chosen on films 1000 to 1119, with an earlier tracker. Nothing but the
film is given, except for films with two walkers: there, a point on the one that is meant, in the middle of the time
it's visible.

The choice is right if the chosen person's box overlaps the true one (intersection over union above 0.5 in the median
frame); where nobody is or the camera moves, if the film is refused. A frame declared followed is false if the
figure's silhouette overlaps the whole walker's (as if nothing hid it) by less than 0.4, or if its joints are off by
more than 0.12 of the walker's height in the picture, left and right exchanged if that is better. All other frames
with a figure, followed or lost, are good.
"""

import tempfile
from collections import Counter
from pathlib import Path

import numpy as np

from benchmarks import Arguments
from benchmarks.tracking.made_films import FPS, KINDS, MadeFilm, made_film
from benchmarks.tracking.tables import share
from motionenv.body import markers
from motionenv.errors import MotionError
from motionenv.render import render
from motionenv.tracking.video import VideoTrack, track_video
from motionenv.types import MARKERS

LEAST_OVERLAP, MOST_OFF = 0.4, 0.12
_EXCHANGED = [MARKERS.index(m.replace("left", "*").replace("right", "left").replace("*", "right")) for m in MARKERS]


def boxes(masks: np.ndarray) -> np.ndarray:
    """First and last column, first and last row (T, 4) of masks (T, height, width); NaN where there are few pixels."""
    found = np.full((len(masks), 4), np.nan)
    for t, mask in enumerate(masks):
        rows, columns = np.nonzero(mask)
        if len(rows) > 20:
            found[t] = columns.min(), columns.max(), rows.min(), rows.max()
    return found


def same(one: np.ndarray, other: np.ndarray) -> float:
    """Median intersection over union of boxes (T, 4) over the frames that have both; 0 if none has."""
    low, high = np.maximum(one, other), np.minimum(one, other)
    common = np.prod(np.maximum(high[:, 1::2] - low[:, ::2] + 1, 0), axis=1)
    areas = [np.prod(b[:, 1::2] - b[:, ::2] + 1, axis=1) for b in (one, other)]
    values = common / (areas[0] + areas[1] - common)
    return float(np.nanmedian(values)) if np.isfinite(values).any() else 0.0


def quality(film: MadeFilm, track: VideoTrack, poses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Overlap with the whole walker, and joints' error [walker's heights] (T,) of poses (T, 25); NaN without pose."""
    overlap, off = np.full((2, len(poses)), np.nan)
    known = np.flatnonzero(np.isfinite(poses[:, 0]))
    true = film.camera.project(markers(film.poses, film.skeleton))[0]
    for t in known:
        body = np.asarray(render(poses[t], track.motion.skeleton, track.camera, rgb=False).limbs) > 0
        overlap[t] = (body & film.whole[t]).sum() / max((body | film.whole[t]).sum(), 1)
        joints = track.camera.project(markers(poses[t], track.motion.skeleton))[0]
        error = min(np.linalg.norm(joints[order] - true[t], axis=1).mean() for order in (_EXCHANGED, slice(None)))
        off[t] = error / np.ptp(true[t][:, 1])
    return overlap, off


def tracked(film: MadeFilm, path: Path, particles: int, seed: int) -> VideoTrack:
    """`track_video` on the film, given a point on the walker if two people walk."""
    film.write(path)
    given = {}
    if film.kind == "walker":
        shown = boxes(film.shown)
        alone = np.isfinite(shown[:, 0]) & ~(film.shown & film.other).any(axis=(1, 2))
        at = np.flatnonzero(alone)[alone.sum() // 2] if alone.any() else np.flatnonzero(np.isfinite(shown[:, 0]))[0]
        left, right, top, bottom = shown[at]
        given = {"point": ((left + right) / 2, (top + bottom) / 2), "at": at / FPS}
    return track_video(path, particles=particles, seed=seed, **given)


def main() -> None:
    """Print the tables."""
    parser = Arguments(__doc__)
    parser.add_argument("--films", type=int, default=60, quick=2, help="number of films (60)")
    parser.add_argument("--first", type=int, default=2000, help="first film (2000)")
    parser.add_argument("--particles", type=int, default=300, quick=10, help="of the filter (300)")
    asked = parser.parse_args()
    counts: dict[str, Counter] = {kind: Counter() for kind in (*sorted(set(KINDS)), "all")}
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(asked.first, asked.first + asked.films):
            film = made_film(seed)
            row = judged(film, Path(folder) / f"{seed}.mp4", asked.particles, seed)
            for kind in (film.kind, "all"):
                counts[kind].update(row)
            print(f"film {seed}: {film.kind}: {dict(row)}", flush=True)
    print(
        "\n| film | films | right choice | frames in the picture | good | of them followed | followed | of them false |"
    )
    print("|-|-|-|-|-|-|-|-|")
    for kind, n in counts.items():
        print(
            f"| {kind} | {n['films']} | {n['right']} | {n['seen']} | {n['good']} | {n['kept']} "
            f"({n['kept'] / max(n['good'], 1):.0%}) | {n['followed']} | {n['false']} "
            f"({n['false'] / max(n['followed'], 1):.1%}) |"
        )
    n = counts["all"]
    print("right choice: {:.0%} ({:.0%}–{:.0%})".format(*share(np.arange(n["films"]) < n["right"])))


def judged(film: MadeFilm, path: Path, particles: int, seed: int) -> Counter:
    """What became of one film: counts of films, right choices and frames."""
    refused = film.kind in ("nobody", "turning")
    seen = 0 if refused else int((film.shown.sum(axis=(1, 2)) > 0.5 * film.whole.sum(axis=(1, 2)).clip(1)).sum())
    try:
        track = tracked(film, path, particles, seed)
    except MotionError as error:
        reason = str(error).split("\n")[0][:50]
        return Counter({"films": 1, "right": int(refused), "seen": seen, f"refused: {reason}": 1})
    right = not refused and same(track.person.boxes, boxes(film.whole)) > 0.5
    good = np.zeros(len(track.followed), dtype=bool)
    if not refused:
        overlap, off = quality(film, track, track.expected)
        good = (overlap >= LEAST_OVERLAP) & (off <= MOST_OFF)
    kept, false = (int((track.followed & which).sum()) for which in (good, ~good))
    counted = {"seen": seen, "good": int(good.sum()), "kept": kept, "followed": kept + false, "false": false}
    return Counter({"films": 1, "right": int(right), **counted})


if __name__ == "__main__":
    main()
