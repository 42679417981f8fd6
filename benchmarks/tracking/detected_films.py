"""How well `track_video` follows people who turn, in films with clutter and a passer-by, by detections.

    motionenv bench tracking.detected_films [--mocap FOLDER] [--people cmu] [--films 12]

Films of 256² pixels and at most four seconds at 30 frames/s from a standing camera of known pose that sees all of a
captured motion, from 1 to 14 degrees above: clothes and a textured background of random colours, noise of 6 grey
levels, MP4 compression, and somebody else who crosses the picture in front or behind. Detections are the projections of
both people's markers with the errors of `DetectorErrors` at its defaults; the passer-by's are in the same list, and
nothing says who is meant, except in the rows "and a point". In that of "BlazePose", it detects people itself.

Captured are Bandai-Namco's turns ("bandai", reported), or CMU's straight walks bent along random paths ("cmu"), on
whose first eight films the settings of `motionenv.tracking.video.guide` were chosen.

- "lift alone" is `motionenv.lifting.fit_freely` of the right person's detections, as a baseline.
- "error": mean distance of 15 joints about the pelvis, in the world's axes: the median over films of that of frames
  called followed, and the mean of all frames with a pose. "kept": share of all frames that are called followed and have
  an error below 150 mm. "false": share of the frames called followed with an error above that. "exchanged": share of
  the films in which the legs of more than half of the frames are nearer to the truth with left and right exchanged.
  "refused": films without any pose.
"""

import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.ndimage import gaussian_filter

from benchmarks import Arguments, headline
from benchmarks.free_walking import bandai
from benchmarks.tracking.made_films import dressed
from motionenv import tracking
from motionenv.body import markers as joints_of
from motionenv.body.fitting import fit_poses, fit_skeleton
from motionenv.errors import MotionError
from motionenv.lifting import fit_freely
from motionenv.mocap.keypoints import DetectorErrors
from motionenv.models.paths import bend, random_path
from motionenv.models.synthesis import synthesize
from motionenv.models.training import read_walks
from motionenv.render import render
from motionenv.render.cameras import fit_view
from motionenv.render.video.encode import write_video
from motionenv.types import MARKERS, Camera, Points

WAYS = ("lift alone", "BlazePose and a point", "detections", "detections and a point")
FPS, SIZE, MOST, CLOSE = 30.0, 256, 120, 0.15
LEGS = [MARKERS.index(f"{side}_{joint}") for side in ("left", "right") for joint in ("knee", "ankle")]
SHOULDERS = [MARKERS.index("left_shoulder"), MARKERS.index("right_shoulder")]
PELVIS = MARKERS.index("pelvis")


@dataclass(frozen=True)
class Film:
    """A film: its pictures (T, 256, 256, 3), camera, true joints (T, 15, 3), and the detections of both people."""

    name: str
    pictures: np.ndarray
    camera: Camera
    joints: np.ndarray
    people: list[Points]


def captured(mocap: Path, people: str, count: int) -> Iterator[tuple[str, np.ndarray]]:
    """Names and joints (T, 15, 3) of motions, at most `MOST` frames of each."""
    if people == "bandai":
        for clip in bandai.clips(mocap, "turns", count):
            yield clip.name, clip.positions[: MOST + 1]
        return
    found = read_walks(mocap / "cmu_asfamc", fps=120.0).straight()
    names = list(dict.fromkeys(found.subjects))
    for k in range(count):
        rng = np.random.default_rng([16, k])
        motion = found.motions[found.subjects.index(names[k % len(names)])]
        bent = bend(motion, random_path(rng, 20.0, radius=float(rng.uniform(0.8, 2.0))))
        yield motion.name, joints_of(bent.poses[::4], bent.skeleton)[: MOST + 1]


def film_of(name: str, joints: np.ndarray, seed: int) -> Film:
    """Draw a motion (T, 15, 3) and a passer-by."""
    rng = np.random.default_rng([17, seed])
    joints = joints - np.nanmean(joints[:, PELVIS], axis=0) * [1, 1, 0]
    camera = fit_view(joints, rng.uniform(0, 2 * np.pi), elevation=rng.uniform(0.02, 0.25), width=SIZE, height=SIZE)
    nodes = np.concatenate([joints, joints[:, SHOULDERS].mean(axis=1, keepdims=True)], axis=1)
    body = fit_skeleton(nodes)
    poses = fit_poses(nodes, body, FPS)
    other, other_body = _passer_by(rng, camera, len(poses))
    pictures, nearest = np.repeat(_texture(rng)[None], len(poses), axis=0), np.full((len(poses), SIZE, SIZE), np.inf)
    for some, skeleton in ((poses, body), (other, other_body)):
        seen = render(some, skeleton, camera, scene=dressed(rng))
        depth = np.where(np.asarray(seen.limbs) > 0, np.asarray(seen.depth), np.inf)
        front = depth < nearest
        pictures, nearest = np.where(front[..., None], seen.rgb, pictures), np.minimum(depth, nearest)
    noisy = pictures + 6 * rng.standard_normal(pictures.shape)
    people = [_detected(places, camera, rng) for places in (joints_of(other, other_body), joints)]
    return Film(name, np.clip(noisy, 0, 255).astype(np.uint8), camera, joints, people)


def _passer_by(rng: np.random.Generator, camera: Camera, frames: int):
    """Poses and body of somebody who crosses the picture 1.5 m in front of its middle or behind."""
    walk = synthesize("walk/fpca", frames / FPS, FPS, seed=int(rng.integers(2**31)))
    across, ahead = camera.R[0, :2] * rng.choice([-1, 1]), camera.R[2, :2] / np.linalg.norm(camera.R[2, :2])
    poses = walk.poses.copy()
    c, s = across / np.linalg.norm(across)
    middle = poses[frames // 2, :2].copy()
    poses[:, :2] = (poses[:, :2] - middle) @ [[c, s], [-s, c]] + rng.choice([-1.5, 1.5]) * ahead
    poses[:, 5] += np.arctan2(s, c)
    return poses, walk.skeleton


def _texture(rng: np.random.Generator) -> np.ndarray:
    """A background (256, 256, 3) of structure at several scales."""
    rough = sum(gaussian_filter(rng.standard_normal((SIZE, SIZE, 3)), (s, s, 0.3)) * s for s in (3, 8, 24, 60))
    return np.clip(rng.uniform(80, 160) + 30 * rough / rough.std(), 0, 255)


def _detected(joints: np.ndarray, camera: Camera, rng: np.random.Generator) -> Points:
    """Detections of a person's joints (T, 15, 3), where half of them are in the picture."""
    places = camera.project(joints)[0]
    inside = ((places >= 0) & (places < SIZE)).all(axis=-1).mean(axis=1) > 0.5
    seen = DetectorErrors().apply(Points(places, FPS, "px"), rng)
    positions = np.where(inside[:, None, None], seen.positions, np.nan)
    return Points(positions, FPS, "px", confidence=np.where(inside[:, None], seen.confidence, 0.0))


def scored(found: np.ndarray, followed: np.ndarray, true: np.ndarray) -> dict[str, float]:
    """Figures of one film, of joints (T, 15, 3) found and true, and whether they are called followed (T,)."""
    relative, truth = (places - places[:, [PELVIS]] for places in (found, true))
    error = np.linalg.norm(relative - truth, axis=-1).mean(axis=1)
    legs, right = relative[:, LEGS], truth[:, LEGS]
    orders = [0, 1, 2, 3], [2, 3, 0, 1]
    as_is, swapped = (np.linalg.norm(legs[:, order] - right, axis=-1).mean(axis=1) for order in orders)
    posed = np.isfinite(error)
    return {
        "error": 1e3 * float(error[followed].mean()) if followed.any() else np.nan,
        "all": 1e3 * float(error[posed].mean()),
        "kept": float((followed & (error < CLOSE)).mean()),
        "false": float((error[followed] >= CLOSE).mean()) if followed.any() else 0.0,
        "exchanged": float((swapped < as_is)[posed].mean() > 0.5),
    }


def played(film: Film, path: Path, particles: int, way: str) -> dict[str, float]:
    """What `track_video` makes of one film, with given or its own detections, or what lifting alone does."""
    begun = time.process_time()
    if way == "lift alone":
        found = fit_freely(film.people[1], film.camera).positions
        scores = scored(found, np.isfinite(found[:, 0, 0]), film.joints)
    else:
        told, known = {}, tracking.Film(path, detections=film.people if way.startswith("detections") else None)
        if way != "detections":
            early = len(film.joints) // 4
            told = {"point": film.camera.project(film.joints[early, PELVIS])[0], "at": early / FPS}
        track = tracking.track_video(known, film.camera, particles=particles, seed=0, threads=1, **told)
        body = track.motion.skeleton
        scores = scored(joints_of(track.expected, body), track.followed, film.joints)
    return scores | {"seconds": (time.process_time() - begun) / len(film.joints) * FPS}


def main() -> None:
    """Print the table."""
    parser = Arguments(__doc__, mocap=("bandai_namco", "cmu_asfamc"))
    parser.add_argument("--people", choices=("bandai", "cmu"), default="bandai")
    parser.add_argument("--films", type=int, default=12, quick=1)
    parser.add_argument("--particles", type=int, default=1000, quick=10)
    parser.add_argument("--way", choices=WAYS, action="append")
    asked = parser.parse_args()
    ways = asked.way or list(WAYS)
    rows: dict[str, list[dict[str, float]]] = {way: [] for way in ways}
    refused = dict.fromkeys(ways, 0)
    with tempfile.TemporaryDirectory() as folder:
        for seed, (name, joints) in enumerate(captured(asked.mocap, asked.people, asked.films)):
            film, path = film_of(name, joints, seed), Path(folder) / f"{seed}.mp4"
            write_video(path, iter(film.pictures), FPS)
            for way in ways:
                try:
                    rows[way].append(played(film, path, asked.particles, way))
                    print(f"{name}: {way}: { ({k: round(v, 2) for k, v in rows[way][-1].items()}) }", flush=True)
                except MotionError as error:
                    refused[way] += 1
                    print(f"{name}: {way}: refused: {error}", flush=True)
    tell(rows, refused, asked.films)


def tell(rows: dict[str, list[dict[str, float]]], refused: dict[str, int], films: int) -> None:
    """Print a row for each way."""
    print("\n| given | error, median [mm] | mean of all frames | kept | false | exchanged | refused | s per s |")
    print("|-|-|-|-|-|-|-|-|")
    for way, each in rows.items():
        mean = {key: float(np.nanmean([one[key] for one in each])) for key in each[0]} if each else {}
        if not mean:
            continue
        share = len(each) / (len(each) + refused[way])
        print(
            f"| {way} | {np.nanmedian([one['error'] for one in each]):.0f} | {mean['all']:.0f} | "
            f"{mean['kept'] * share:.0%} | {mean['false']:.0%} | {mean['exchanged']:.0%} | "
            f"{refused[way]} of {films} | {mean['seconds']:.1f} |"
        )
        names = {"detections": ("error", "kept"), "BlazePose and a point": ("peer_error", "peer_kept")}.get(way)
        if names:
            numbers = np.nanmedian([one["error"] for one in each]), 100 * mean["kept"] * share
            headline(**dict(zip(names, numbers, strict=True)))


if __name__ == "__main__":
    main()
