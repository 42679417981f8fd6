"""How often tracks of films from an unknown camera exchange left and right.

    motionenv bench tracking.film_sides [--mocap FOLDER]

WalkerTracking films captured CMU walks from the side: 192 × 192 pixels, 60 frames, clutter, clothes of random colours
that are equal on both sides, noise of 8 grey levels, MP4 compression, every second film mirrored. `track_video` gets
only the film. A track is correct if the distance of its left from its right ankle along the picture correlates with the
truth (0.8 or more), and exchanged if it correlates as strongly with the opposite sign. Shares have Wilson's 95 %
intervals.
"""

import tempfile
from pathlib import Path

import gymnasium
import numpy as np

import motionenv.envs  # noqa: F401 (registers the environments)
from benchmarks import Arguments
from benchmarks.tracking.tables import share
from motionenv import write
from motionenv.body import markers
from motionenv.errors import MotionError
from motionenv.models.training import read_walks
from motionenv.models.transforms import resample
from motionenv.render.video.encode import write_video
from motionenv.tracking.video.track import VideoTrack, track_video
from motionenv.types import MARKERS, Motion, Skeleton

CMU_FPS, FPS = 120.0, 30.0
SIZE, FRAMES, NOISE = 192, 60, 8.0
LEFT, RIGHT = MARKERS.index("left_ankle"), MARKERS.index("right_ankle")
ALIKE = 0.8


def walks(mocap: Path, count: int) -> list[Motion]:
    """`count` pieces of walks, cycling through people and each person's trials.

    Args:
        mocap: the folder above cmu_asfamc.
        count: number of pieces.
    """
    found = read_walks(mocap / "cmu_asfamc", fps=CMU_FPS).straight()
    trials: dict[str, list[Motion]] = {}
    for motion, person in zip(found.motions, found.subjects, strict=True):
        poses = resample(motion, FPS)[0]
        if len(poses) > FRAMES:
            trials.setdefault(person, []).append(Motion(poses, motion.skeleton, FPS, motion.name))
    rng, people, chosen = np.random.default_rng(0), list(trials), []
    for k in range(count):
        mine = trials[people[k % len(people)]]
        walk = mine[k // len(people) % len(mine)]
        first = int(rng.integers(len(walk.poses) - FRAMES))
        chosen.append(Motion(walk.poses[first : first + FRAMES + 1], walk.skeleton, FPS, walk.name))
    return chosen


def filmed(walk: Motion, film: Path, seed: int) -> np.ndarray:
    """Write a film of a walk; return the lead (T,) [m] of the left ankle over the right one along the picture."""
    file = film.with_suffix(".npz")
    write(walk, file)
    env = gymnasium.make(
        "motionenv/WalkerTracking-v1", motion=str(file), size=SIZE, observation="rgb", camera="side", fps=FPS,
        split="eval", horizon=FRAMES, background="clutter", noise=NOISE, start="line",
    )  # fmt: skip
    picture, _ = env.reset(seed=seed)
    nothing, pictures, poses, over = np.zeros(env.action_space.shape, np.float32), [], [], False
    while not over:
        # Mirroring exchanges the walker's sides, too, so the lead of the left ankle is unchanged.
        pictures.append(picture[:, ::-1] if seed % 2 else picture)
        truth = env.unwrapped.truth()
        poses.append(truth["pose"])
        picture, _, _, over, _ = env.step(nothing)
    env.close()
    write_video(film, iter(pictures), FPS)
    return ahead(np.array(poses), truth["skeleton"])


def ahead(poses: np.ndarray, skeleton: Skeleton) -> np.ndarray:
    """Lead (T,) [m] of the left ankle over the right one along x, in poses (T, 25)."""
    joints = markers(poses, skeleton)
    return joints[:, LEFT, 0] - joints[:, RIGHT, 0]


def agreement(track: VideoTrack, true: np.ndarray) -> float:
    """Correlation of a track's lead of the left ankle with the true one (T,)."""
    seen = track.followed
    if seen.sum() < 5:
        return 0.0  # lost: neither
    return float(np.corrcoef(ahead(track.motion.poses[seen], track.motion.skeleton), true[: len(seen)][seen])[0, 1])


def sides(film: Path, particles: int, seed: int, true: np.ndarray) -> float:
    """The agreement of the track of a film; 0 if it's refused."""
    try:
        return agreement(track_video(film, particles=particles, seed=seed), true)
    except MotionError as error:
        print(f"film {seed} is refused: {error}", flush=True)
        return 0.0


def main() -> None:
    """Print the table."""
    parser = Arguments(__doc__, mocap=("cmu_asfamc",))
    parser.add_argument("--films", type=int, default=22, quick=1, help="number of films (22)")
    parser.add_argument("--particles", type=int, default=500, quick=10, help="of the filter (500)")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        films = [Path(folder) / f"{k}.mp4" for k in range(asked.films)]
        true = [filmed(walk, films[k], k) for k, walk in enumerate(walks(asked.mocap, asked.films))]
        found = np.array([sides(film, asked.particles, k, true[k]) for k, film in enumerate(films)])
    right, wrong = found > ALIKE, found < -ALIKE
    cells = ("{:.0%} ({:.0%}–{:.0%})".format(*share(yes)) for yes in (right, wrong, ~right & ~wrong))
    print("| correct | exchanged | neither |\n|-|-|-|\n|", " | ".join(cells), "|", flush=True)


if __name__ == "__main__":
    main()
