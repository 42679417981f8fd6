"""Track real films, four views of Pose2Sim's clip of a man who balances on a beam, and compare with its 3D joints.

    motionenv bench tracking.real_film [--mocap FOLDER] [--detections FOLDER] [--pictures FOLDER]

The folder of --mocap has pose2sim, with its Demo_SinglePerson and from_history. People are detected by BlazePose; the
folder of --detections may have cam01.json to cam04.json of another detector. Cameras are given, lens distortion is
ignored. Errors are means of 12 joints about the middle of the hips, in
the world's axes; the truth is triangulated from all four views. "detections off" is the median distance of the detected
joints from the projected true ones, "lift alone" the error of the lifted detections.
"""

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np

from benchmarks import Arguments, scratch
from motionenv.body import markers
from motionenv.errors import MotionError
from motionenv.lifting import fit_freely
from motionenv.mocap.keypoints.detector import detect_people, detector
from motionenv.mocap.keypoints.points2d import points_of, read_people
from motionenv.render.draw2d.overlay import draw_pose
from motionenv.render.video.decode import narrowed, read_frames, video_info
from motionenv.render.video.encode import write_image
from motionenv.tracking import Film, VideoTrack, track_video
from motionenv.tracking.video.candidates import at_frames
from motionenv.tracking.video.detection import resized
from motionenv.types import MARKERS, Camera, Points

VIEWS, JOINT_FPS, SUBPIXELS = ("cam01", "cam02", "cam03", "cam04"), 60.0, 64
SHOWN, WIDE = 6, 360  # pictures of a film that are drawn, and their width
SHORT = {"left": "L", "right": "R"}
JOINTS = {
    f"{side}_{joint}": SHORT[side] + joint.capitalize()
    for joint in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")
    for side in SHORT
}
SAME = [MARKERS.index(name) for name in JOINTS]


def film(folder: Path, view: str) -> Path:
    """The film of a view."""
    return folder / f"Demo_SinglePerson/videos/{view}.mp4"


def calibrated(folder: Path, view: str) -> Camera:
    """The camera of a view, from the Qualisys calibration."""
    info = video_info(film(folder, view))
    tree = ET.parse(folder / "Demo_SinglePerson/calibration/Calib.qca.txt")
    node = next(c for c in tree.getroot().iter("camera") if c.get("serial") == view)
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


def error_of(places: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Errors (T,) [mm] of markers (T, 15, 3), about the hips."""
    return 1000 * np.linalg.norm(about_hips(places[:, SAME]) - about_hips(true), axis=-1).mean(axis=1)


def line_of_detections(points: Points, camera: Camera, true: np.ndarray) -> str:
    """How far the detections of a view, and what is lifted from them, are from the truth."""
    frames = min(len(true), len(points.positions))
    seen = camera.project(true[:frames])[0]
    off = np.linalg.norm(points.positions[:frames, SAME] - seen, axis=-1)
    lifted = error_of(fit_freely(points, camera).positions[:frames], true[:frames])
    return f"{np.nanmedian(off):.0f} px of {np.median(np.ptp(seen[..., 1], axis=1)):.0f} | {np.nanmean(lifted):.0f} mm"


def line_of_track(track: VideoTrack, true: np.ndarray) -> str:
    """Frames followed, their error and overlap, and the first reason for a loss."""
    error = error_of(markers(track.expected, track.motion.skeleton), true)
    held, lost = track.followed, [loss.reason for loss in track.losses if not loss.left]
    mean = f"{np.nanmean(error[held]):.0f} mm" if held.any() else f"– ({np.nanmean(error):.0f} mm)"
    return f"{held.sum()} of {len(held)} | {mean} | {np.nanmean(track.overlap):.2f} | {', '.join(sorted(set(lost)))}"


def drawn(path: Path, track: VideoTrack, out: Path) -> None:
    """Write some of the film's pictures with the expected figure."""
    camera = resized(track.camera, WIDE, round(track.camera.height * WIDE / track.camera.width))
    pictures = [narrowed(p, WIDE) for p in read_frames(path, fps=track.motion.fps)]
    places = markers(track.expected, track.motion.skeleton)
    some = np.linspace(0, len(pictures) - 1, SHOWN).astype(int)
    write_image(out, np.concatenate([draw_pose(pictures[i], places[i], camera, width=2.0) for i in some], axis=1))


def main() -> None:
    """Print the table."""
    parser = Arguments(__doc__, mocap=("pose2sim",))
    parser.add_argument("--detections", type=Path, help="folder of cam01.json to cam04.json")
    parser.add_argument("--pictures", type=Path, quick=scratch(), help="folder for a PNG of each film")
    parser.add_argument("--particles", type=int, default=1000, quick=10)
    asked = parser.parse_args()
    folder = asked.mocap / "pose2sim"
    print(
        "| view | given | detections off | lift alone | frames followed | error | overlap | lost |\n" + "|-" * 8 + "|"
    )
    for view in VIEWS[:1] if asked.quick else VIEWS:
        path, camera = film(folder, view), calibrated(folder, view)
        info, true = video_info(path), triangulated(folder)
        tracks, frames = detect_people(read_frames(path), detector(), name=str(path))
        people: dict[str, list[Points]] = {"BlazePose": points_of(path, tracks, frames, info.fps)}
        if asked.detections is not None:
            people["file"] = read_people(asked.detections / f"{view}.json", info.fps, (info.width, info.height))
        for given, points in people.items():
            about = line_of_detections(points[0], camera, true)
            try:
                track = track_video(Film(path, detections=points), camera, person=1, particles=asked.particles, seed=0)
            except MotionError as error:
                print(f"| {view} | {given} | {about} | refused: {error} | | | |", flush=True)
                continue
            at = at_frames(true, JOINT_FPS, track.motion.fps, len(track.overlap))
            print(f"| {view} | {given} | {about} | {line_of_track(track, at)} |", flush=True)
            if asked.pictures is not None:
                asked.pictures.mkdir(parents=True, exist_ok=True)
                drawn(path, track, asked.pictures / f"{view}-{given}.png")


if __name__ == "__main__":
    main()
