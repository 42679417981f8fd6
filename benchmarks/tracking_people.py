"""People for the benchmark of trackers: captured walks, cut to episodes, and priors fitted without each person."""

import tempfile
from collections.abc import Iterator
from concurrent.futures import Executor
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from motionenv import write
from motionenv.body import from_height
from motionenv.estimation.tracking.velocity_prior import velocity_change
from motionenv.models.reaching import RIGHT_ARM, reach
from motionenv.models.training import read_walks
from motionenv.models.tree import MotionTree
from motionenv.models.tree.capture import read_clips
from motionenv.models.tree.database import Clip, build_database
from motionenv.models.tree.frames import resample
from motionenv.models.walking import WalkingModel
from motionenv.types import POSE, Motion

SAME_PERSON = {"37": "12", "38": "07"}  # by the database's descriptions and by their build
FPS = 30.0
REACHING = "reach"
REACHES, REACH_FRAMES = 60, 300  # clips of made-up reaching that a tree is made of, and frames of each
CMU_FPS = 120.0  # which AMC files don't say


@dataclass(frozen=True)
class Cut:
    """A piece of a captured walk as an episode.

    Attributes:
        folder: of the priors' files.
        motion: file that holds its frames, or "reach".
        poses: (2, 25) the pose a frame before them, and the first of them; NaN where these aren't known.
        person: who walks.
        trial: file that it is from.
        frames: how many.
    """

    folder: str
    motion: str
    poses: np.ndarray
    person: str
    trial: str
    frames: int


@dataclass(frozen=True)
class People:
    """Straight walks of people, and whatever else was captured of them.

    Attributes:
        captured: straight walks.
        walks: the same at `FPS`.
        persons: the person of each.
        clips: all that was captured, walks too.
        names: who is tracked.
        folder: for files that episodes and workers read; lives as long as this does.
    """

    captured: list[Motion]
    walks: list[Motion]
    persons: list[str]
    clips: list[Clip]
    names: list[str]
    folder: tempfile.TemporaryDirectory = field(default_factory=tempfile.TemporaryDirectory)

    def file(self, name: str) -> Path:
        """Where the file called `name` goes."""
        return Path(self.folder.name) / name

    def cuts(self, count: int, frames: int, seed: int) -> Iterator[Cut]:
        """`count` episodes of `frames` frames, of one person after the other, each person's trials in turn.

        A trial of fewer frames isn't used; where in a trial an episode starts is drawn.

        Args:
            count: how many.
            frames: of each.
            seed: of the starts.
        """
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
        """`count` episodes of `frames` frames of the environment's own arms that reach, which no tree has seen."""
        unknown = np.full((2, len(POSE)), np.nan)
        return [Cut(self.folder.name, REACHING, unknown, REACHING, REACHING, frames)] * count

    def fit(self, pool: Executor) -> None:
        """Fit what priors are made of without each person, a file each.

        They are `walk_PERSON.npz`, the functional model; `tree_PERSON.npz` and `arm_PERSON.npz`, of body and right arm;
        and `change_PERSON.npy`, how much velocities change from frame to frame.

        Args:
            pool: of processes.
        """
        jobs = [pool.submit(_fit_reaching, Path(self.folder.name))]
        for name in self.names:
            others = [i for i, person in enumerate(self.persons) if person != name]
            walks, persons = [self.captured[i] for i in others], [self.persons[i] for i in others]
            clips = [clip for clip in self.clips if clip.person != name]
            jobs.append(pool.submit(_fit, Path(self.folder.name), name, walks, persons, clips))
        for job in jobs:
            job.result()


def read_people(mocap: Path, most: int | None = None) -> People:
    """The people in a folder of capture, or in its folder `cmu_asfamc`.

    Args:
        mocap: folder of AMC files, of CMU's rate and numbering of trials; or one above it.
        most: how many people to track at most; None takes all.
    """
    inside = mocap / "cmu_asfamc"
    folder = inside if inside.is_dir() else mocap
    found = read_walks(folder, fps=CMU_FPS)
    walks = [Motion(resample(m, FPS)[0], m.skeleton, FPS, m.name) for m in found.motions]
    clips = [Clip(c.motion, c.name, c.activity, SAME_PERSON.get(c.person, c.person))
             for c in read_clips(folder, fps=CMU_FPS)]  # fmt: skip
    persons = list(found.subjects)
    return People(list(found.motions), walks, persons, clips, list(dict.fromkeys(persons))[:most])


def _fit(folder: Path, name: str, walks: list[Motion], persons: list[str], clips: list[Clip]) -> None:
    WalkingModel().fit(walks, persons).save(folder / f"walk_{name}.npz")
    database = build_database(clips, mirrored=True)
    MotionTree().fit(database).save(folder / f"tree_{name}.npz")
    MotionTree(part="right_arm").fit(database).save(folder / f"arm_{name}.npz")
    np.save(folder / f"change_{name}.npy", velocity_change(walks)[0])


def _fit_reaching(folder: Path) -> None:
    poses = np.zeros((REACHES, REACH_FRAMES, len(POSE)))
    for k in range(REACHES):
        poses[k][:, RIGHT_ARM] = reach(REACH_FRAMES, FPS, np.random.default_rng([1, k]))
    motions = [Motion(p, from_height(), FPS, REACHING) for p in poses]
    tree = MotionTree(part="right_arm").fit(
        build_database(Clip(motion, REACHING, REACHING, REACHING) for motion in motions)
    )
    tree.save(folder / f"arm_{REACHING}.npz")
    np.save(folder / f"change_{REACHING}.npy", velocity_change(motions)[0])
