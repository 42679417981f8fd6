"""How well a film's background tells how its camera turns, and what that is worth to `lift`.

    motionenv bench lifting.camera_motion [--films 6]

Films of Bandai-Namco's turns in a room of structure (`moving_films`), compressed as MP4, by a camera that stands,
shakes in a hand (0.5 degrees rms, 1 to 3 Hz), pans, shakes and sways by 7 mm, walks beside the person, or zooms.
People's boxes are those of their true joints. "Off" is the rms angle [degrees] between found and true rotations, their
mean offset removed, with the focal length known, and with one found from the film; "focal" is the error of that. The
lifter gets true projections with a detector's errors (`DetectorErrors`), the intrinsics, and how far the camera looks
down on average: "as filmed", "steadied", and "tripod", the points of a camera that stands still. MPJPE as in
`free_walking`; "knee" and "thigh" are mean absolute errors [degrees] of the knee's flexion and of the thigh's angle to
the vertical, "speed" is that of the pelvis over the ground [m/s].

Real films are those of Pose2Sim, whose cameras stand: as they are, and as a camera would see them that turns within
their pictures by known rotations, with boxes around what moves. Thresholds were chosen on films of CMU's walks, while
the real films were looked at, too.
"""

import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.ndimage import find_objects, gaussian_filter1d, label, map_coordinates, uniform_filter
from scipy.spatial.transform import Rotation

from benchmarks import Arguments
from benchmarks.free_walking import bandai
from benchmarks.free_walking.__main__ import figures
from benchmarks.lifting.moving_films import FPS, KINDS, PELVIS, MovingFilm, boxes, moving_film, shaken
from motionenv.lifting import CameraMotion, camera_motion, fit_freely
from motionenv.mocap.keypoints import DetectorErrors
from motionenv.render.video.decode import read_frames
from motionenv.render.video.encode import write_video
from motionenv.types import MARKERS, Markers, Points

LONGEST = 90  # frames
_FIELD, _FOCAL = (200, 225), 420.0  # [pixels] of the camera that turns within a real film
_REAL_FOCAL = 1681.0  # [pixels] of Pose2Sim's cameras, by their calibration
_RATE, _MOVED = 60.0, 25.0  # [Hz] of these films; [grey levels] by which people differ from the median picture


def off(motion: CameraMotion, turns: np.ndarray) -> float:
    """Rms angle [degrees] between found and true rotations, without their mean; NaN if it isn't said to turn."""
    if motion.kind != "turns":
        return np.nan
    apart = (Rotation.from_matrix(motion.rotations) * Rotation.from_matrix(turns).inv()).as_rotvec()
    return float(np.degrees(np.sqrt(((apart - apart.mean(axis=0)) ** 2).sum(axis=1).mean())))


def projected(film: MovingFilm) -> np.ndarray:
    """Pixels (T, 15, 2) of the joints."""
    return np.stack([camera.project(at)[0] for camera, at in zip(film.cameras, film.joints, strict=True)])


def lifted(film: MovingFilm, motion: CameraMotion) -> dict[str, dict[str, float]]:
    """Errors of the lifter as filmed, steadied, and by a camera on a tripod."""
    inner, mean = film.cameras[0].K, Rotation.from_matrix(np.stack([c.R for c in film.cameras])).mean()
    down = float(np.arcsin(-mean.as_matrix()[2, 2]))
    world = film.joints - np.stack([camera.centre for camera in film.cameras]).mean(axis=0)
    tripod = world @ mean.as_matrix().T @ inner.T
    truth = Markers(MARKERS, film.joints, FPS)
    out = {}
    for name, places in (("as filmed", projected(film)), ("tripod", tripod[..., :2] / tripod[..., 2:])):
        exact = Points(places, FPS, "px", truth=truth)
        seen = DetectorErrors().apply(exact, rng=5)
        for way, points in ((name, seen), *((("steadied", motion.steadied(seen)),) if name == "as filmed" else ())):
            fit = fit_freely(points, inner, elevation=down)
            out[way] = figures(fit, exact, inner) | angles(fit.positions, film.joints)
    return out


def angles(found: np.ndarray, true: np.ndarray) -> dict[str, float]:
    """Mean absolute errors [degrees] of knees and thighs, and of the pelvis' velocity [m/s]."""
    errors: dict[str, list] = {"knee": [], "thigh": []}
    for side in ("left", "right"):
        at = [MARKERS.index(f"{side}_{joint}") for joint in ("hip", "knee", "ankle")]
        each = []
        for places in (found, true):
            thigh, shank = (
                way / np.linalg.norm(way, axis=-1, keepdims=True)
                for way in np.diff(places[:, at], axis=1).swapaxes(0, 1)
            )
            each.append((np.arccos((thigh * shank).sum(axis=-1).clip(-1, 1)), np.arccos(-thigh[:, 2])))
        for name, one, other in zip(errors, *each, strict=True):
            errors[name].append(np.degrees(np.abs(one - other)).mean())
    ways = [gaussian_filter1d(places[:, PELVIS, :2], 3, axis=0) for places in (found, true)]
    speeds = [np.linalg.norm(np.diff(way, axis=0), axis=1) * FPS for way in ways]
    return {name: float(np.mean(each)) for name, each in errors.items()} | {
        "speed": float(np.abs(speeds[0] - speeds[1]).mean())
    }


def real_films(folder: Path, few: bool) -> Iterator[str]:
    """Rows of a table of the real films."""
    paths = sorted(folder.glob("Demo_*/videos/*.mp4"))
    for path in paths[:1] if few else paths:
        frames = list(read_frames(path, width=544))[: 12 if few else None]
        people = moving(frames)
        yield row(path, "as filmed", camera_motion(frames, people), np.tile(np.eye(3), (len(frames), 1, 1)))
        time = np.linspace(-0.5, 0.5, len(frames))[:, None]
        rng = np.random.default_rng(3)
        for name, turn in (
            ("tilts by 20°", np.radians(20) * time * [1, 0.05, 0.1]),
            ("shakes", shaken(rng, len(frames), _RATE)),
        ):
            turns = Rotation.from_rotvec(turn)
            inside, seen = turned(frames, people, turns)
            with tempfile.TemporaryDirectory() as scratch:
                write_video(Path(scratch) / "film.mp4", iter(inside), _RATE)
                kept = list(read_frames(Path(scratch) / "film.mp4"))
            true = (turns * turns[0].inv()).as_matrix()
            yield row(path, name, camera_motion(kept, seen), true)


def row(path: Path, name: str, motion: CameraMotion, true: np.ndarray) -> str:
    """A row of the table of real films."""
    wide = f"{motion.inner[0, 0] / _FOCAL - 1:+.0%}" if motion.kind == "turns" else ""
    return (
        f"| {path.parts[-3]} {path.stem} | {name} | {motion.kind}{', doubtful' if motion.doubtful else ''} | "
        f"{motion.degrees:.2f}° | {motion.agree:.0%} | {off(motion, true):.3f} | {wide} |"
    )


def moving(frames: list[np.ndarray]) -> list[np.ndarray]:
    """Boxes (n, 4) around what differs from the median picture, in each frame."""
    typical = np.median(frames[:: max(1, len(frames) // 15)], axis=0)
    out = []
    for frame in frames:
        differs = uniform_filter((np.abs(frame - typical).max(axis=-1) > _MOVED).astype(np.float32), 9) > 0.3
        found = [part for part in find_objects(label(differs)[0]) if part[0].stop - part[0].start > 0.05 * len(frame)]
        out.append(np.array([[c.start, r.start, c.stop, r.stop] for r, c in found]).reshape(-1, 4))
    return out


def turned(frames: list[np.ndarray], people: list[np.ndarray], turns: Rotation):
    """Frames and boxes as a camera of `_FOCAL` sees them that turns within their pictures."""
    high, wide = frames[0].shape[:2]
    inner = np.array([[_FOCAL, 0, (_FIELD[0] - 1) / 2], [0, _FOCAL, (_FIELD[1] - 1) / 2], [0, 0, 1]])
    scale = wide / 1088
    whole = np.array([[_REAL_FOCAL * scale, 0, (wide - 1) / 2], [0, _REAL_FOCAL * scale, (high - 1) / 2], [0, 0, 1]])
    rows, columns = np.mgrid[: _FIELD[1], : _FIELD[0]]
    rays = np.stack([columns, rows, np.ones_like(rows)], axis=-1) @ np.linalg.inv(inner).T
    pictures, seen = [], []
    for frame, some, turn in zip(frames, people, turns.as_matrix(), strict=True):
        at = rays @ turn @ whole.T
        at = (at[..., :2] / at[..., 2:])[..., ::-1]
        each = [map_coordinates(frame[..., c].astype(np.float32), at.transpose(2, 0, 1), order=1) for c in range(3)]
        pictures.append(np.clip(np.stack(each, axis=-1), 0, 255).astype(np.uint8))
        corners = some[:, [[0, 1], [2, 1], [0, 3], [2, 3]]].reshape(-1, 4, 2)
        back = np.insert(corners, 2, 1.0, axis=-1) @ np.linalg.inv(whole).T @ turn.T @ inner.T
        back = back[..., :2] / back[..., 2:]
        seen.append(np.concatenate([back.min(axis=1), back.max(axis=1)], axis=-1))
    return pictures, seen


def made_films(mocap: Path, kind: str, count: int, few: bool) -> tuple[str, list[str]]:
    """A row of the table of rotations, and rows of the lifter's."""
    kinds, offs, guessed, focal, errors = [], [], [], [], []
    for number, clip in enumerate(bandai.clips(mocap, "turns", count)):
        rng = np.random.default_rng([31, number, KINDS.index(kind)])
        film = moving_film(kind, clip.positions[: 20 if few else LONGEST], rng, texture=float(rng.choice([0.4, 1.0])))
        with tempfile.TemporaryDirectory() as scratch:
            write_video(Path(scratch) / "film.mp4", iter(film.pictures), FPS)
            frames = list(read_frames(Path(scratch) / "film.mp4"))
        people = boxes(projected(film))
        known, unknown = (camera_motion(frames, people, inner) for inner in (film.cameras[0].K, None))
        kinds.append(known.kind + ", doubtful" * known.doubtful)
        offs.append(off(known, film.turns))
        guessed.append(off(unknown, film.turns))
        focal.append(abs(unknown.inner[0, 0] / film.cameras[0].K[0, 0] - 1) if unknown.kind == "turns" else np.nan)
        if kind not in ("walks", "zooms"):
            errors.append(lifted(film, known))
    told = ", ".join(f"{kinds.count(one)} {one}" for one in sorted(set(kinds)))
    with np.errstate(all="ignore"):
        numbers = [np.mean(each) for each in (offs, guessed, focal)]
    first = f"| {kind} | {told} | {numbers[0]:.3f} | {numbers[1]:.3f} | {numbers[2]:.1%} |"
    rows = []
    for way in errors[0] if errors else ():
        mean = {name: np.mean([one[way][name] for one in errors]) for name in errors[0][way]}
        rows.append(
            f"| {kind} | {way} | {mean['mpjpe']:.1f} | {mean['aligned']:.1f} | {mean['knee']:.1f} | "
            f"{mean['thigh']:.1f} | {mean['heading']:.1f} | {mean['speed']:.2f} | {mean['in_band']:.0%} |"
        )
    return first, rows


def main() -> None:
    """Print the tables."""
    parser = Arguments(__doc__, mocap=("bandai_namco",))
    parser.add_argument("--films", type=int, default=6, quick=1)
    asked = parser.parse_args()
    print("| camera | told | off [°] | off, focal length found | focal |\n|-|-|-|-|-|")
    rest = []
    for kind in KINDS:
        first, rows = made_films(asked.mocap, kind, asked.films, asked.quick)
        print(first, flush=True)
        rest += rows
    print(
        "\n| camera | points | MPJPE [mm] | P-MPJPE [mm] | knee [°] | thigh [°] | heading [°] | speed [m/s] | in band |"
    )
    print("|-|-|-|-|-|-|-|-|-|", *rest, sep="\n")
    real = asked.mocap / "pose2sim"
    if real.is_dir():
        print("\n| film | camera | told | angle | agree | off [°] | focal |\n|-|-|-|-|-|-|-|")
        for line in real_films(real, asked.quick):
            print(line, flush=True)


if __name__ == "__main__":
    main()
