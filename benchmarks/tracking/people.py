"""Data of the tracking benchmark: captured walks cut into episodes, and priors fitted without each person."""

import tempfile
from collections.abc import Iterator
from concurrent.futures import Executor
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from benchmarks.captured_walks import SAME_PERSON
from motionenv import write
from motionenv.body import from_height
from motionenv.body.arm_reaching import RIGHT_ARM, reach
from motionenv.models.motion_tree import MotionTree
from motionenv.models.motion_tree.database import Clip, build_database
from motionenv.models.motion_tree.training import read_clips
from motionenv.models.training import read_walks
from motionenv.models.transforms import resample
from motionenv.models.walking.model import WalkingModel
from motionenv.tracking.priors.velocity import velocity_change
from motionenv.types import POSE, Motion

FPS = 30.0
REACHING = "reach"
REACHES, REACH_FRAMES = 60, 300  # number of synthetic reaching clips for a tree, and frames of each
CMU_FPS = 120.0  # AMC files don't state it


@dataclass(frozen=True)
class Cut:
    """A piece of a captured walk as an episode.

    Attributes:
        folder: folder of the priors' files.
        motion: file of its frames, or "reach".
        poses: (2, 25) the pose before the first frame, and the first pose; NaN if unknown.
        person: label of the person.
        trial: file of the whole walk.
        frames: number of frames.
    """

    folder: str
    motion: str
    poses: np.ndarray
    person: str
    trial: str
    frames: int


@dataclass(frozen=True)
class People:
    """Captured motion of several people.

    Attributes:
        captured: straight walks.
        walks: the same walks at `FPS`.
        persons: the person of each walk.
        clips: all captured motion, including the walks.
        names: people to track.
        longest: frames of an episode at most.
        folder: temporary folder of the files for episodes and workers.
    """

    captured: list[Motion]
    walks: list[Motion]
    persons: list[str]
    clips: list[Clip]
    names: list[str]
    longest: int | None = None
    folder: tempfile.TemporaryDirectory = field(default_factory=tempfile.TemporaryDirectory)

    def file(self, name: str) -> Path:
        """Path of the file `name` in the temporary folder."""
        return Path(self.folder.name) / name

    def cuts(self, count: int, frames: int, seed: int) -> Iterator[Cut]:
        """`count` episodes of `frames` frames, cycling through people and each person's trials.

        Starts within trials are random; trials with too few frames are skipped.

        Args:
            count: number of episodes.
            frames: frames of each episode.
            seed: seed of the random starts.
        """
        frames = min(frames, self.longest or frames)
        rng = np.random.default_rng(seed)
        long = [i for i, walk in enumerate(self.walks) if len(walk.poses) > frames]
        queues = {name: [i for i in long if self.persons[i] == name] for name in self.names}
        able = [name for name in self.names if queues[name]]
        for k in range(count):
            queue = queues[able[k % len(able)]]
            walk = self.walks[queue[k // len(able) % len(queue)]]
            first = 1 + int(rng.integers(len(walk.poses) - frames))
            path = self.file(f"cut{frames}_{seed}_{k}.npz")
            piece = Motion(walk.poses[first : first + frames], walk.skeleton, FPS, walk.name)
            write(piece, path)
            yield Cut(
                self.folder.name, str(path), walk.poses[first - 1 : first + 1], able[k % len(able)], walk.name, frames
            )

    def reaches(self, count: int, frames: int) -> list[Cut]:
        """`count` episodes of `frames` frames with the environment's reaching arm, which no tree has seen."""
        unknown = np.full((2, len(POSE)), np.nan)
        frames = min(frames, self.longest or frames)
        return [Cut(self.folder.name, REACHING, unknown, REACHING, REACHING, frames)] * count

    def fit(self, pool: Executor) -> None:
        """Fit the parts of the priors without each person, and save each to a file.

        `walk_PERSON.npz` is the functional model, `tree_PERSON.npz` and `arm_PERSON.npz` are the trees of body and
        right arm, and `change_PERSON.npy` holds the changes of velocity between frames.

        Args:
            pool: pool of processes.
        """
        jobs = [pool.submit(_fit_reaching, Path(self.folder.name))]
        for name in self.names:
            others = [i for i, person in enumerate(self.persons) if person != name]
            walks, persons = [self.captured[i] for i in others], [self.persons[i] for i in others]
            clips = [clip for clip in self.clips if clip.person != name]
            jobs.append(pool.submit(_fit, Path(self.folder.name), name, walks, persons, clips))
        for job in jobs:
            job.result()


def read_people(mocap: Path, only: str | None = None, longest: int | None = None) -> People:
    """The people in a folder of capture.

    Args:
        mocap: the folder above cmu_asfamc.
        only: the person to track; None tracks all.
        longest: frames of an episode at most.
    """
    folder = mocap / "cmu_asfamc"
    found = read_walks(folder, fps=CMU_FPS).straight()
    walks = [Motion(resample(m, FPS)[0], m.skeleton, FPS, m.name) for m in found.motions]
    clips = [Clip(c.motion, c.name, c.activity, SAME_PERSON.get(c.person, c.person))
             for c in read_clips(folder, fps=CMU_FPS)]  # fmt: skip
    persons = list(found.subjects)
    names = [only] if only else list(dict.fromkeys(persons))
    return People(list(found.motions), walks, persons, clips, names, longest)


def _fit(folder: Path, name: str, walks: list[Motion], persons: list[str], clips: list[Clip]) -> None:
    WalkingModel().fit(walks, persons).save(folder / f"walk_{name}.npz")
    database = build_database(clips, mirrored=True)
    MotionTree().fit_database(database).save(folder / f"tree_{name}.npz")
    MotionTree(part="right_arm").fit_database(database).save(folder / f"arm_{name}.npz")
    np.save(folder / f"change_{name}.npy", velocity_change(walks)[0])


def _fit_reaching(folder: Path) -> None:
    poses = np.zeros((REACHES, REACH_FRAMES, len(POSE)))
    for k in range(REACHES):
        poses[k][:, RIGHT_ARM] = reach(REACH_FRAMES, FPS, np.random.default_rng([1, k]))
    motions = [Motion(p, from_height(), FPS, REACHING) for p in poses]
    tree = MotionTree(part="right_arm").fit_database(
        build_database(Clip(motion, REACHING, REACHING, REACHING) for motion in motions)
    )
    tree.save(folder / f"arm_{REACHING}.npz")
    np.save(folder / f"change_{REACHING}.npy", velocity_change(motions)[0])
