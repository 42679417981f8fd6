"""People for the benchmark of trackers: captured walks, cut to episodes, and priors fitted without each person."""

import tempfile
from collections.abc import Iterator
from concurrent.futures import Executor
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from motionenv import write
from motionenv.models.training import read_walks
from motionenv.models.tree import MotionTree
from motionenv.models.tree.capture import read_clips
from motionenv.models.tree.database import Clip, build_database
from motionenv.models.tree.frames import resample
from motionenv.models.walking import WalkingModel
from motionenv.types import Motion

SAME_PERSON = {"37": "12", "38": "07"}  # by the database's descriptions and by their build
FPS = 30.0
CMU_FPS = 120.0  # which AMC files don't say


@dataclass(frozen=True)
class Cut:
    """A piece of a captured walk as an episode.

    Attributes:
        motion: file that holds its frames.
        poses: (2, 25) the pose a frame before them, and the first of them.
        person: who walks.
        trial: file that it is from.
        frames: how many.
    """

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
            yield Cut(str(path), walk.poses[first - 1 : first + 1], able[k % len(able)], walk.name, frames)

    def fit(self, pool: Executor) -> None:
        """Fit the priors without each person, a file each: `walk_PERSON.npz`, `tree_PERSON.npz`, `arm_PERSON.npz`."""
        jobs = [pool.submit(_fit_walk, self.captured, self.persons, name, self.file(f"walk_{name}.npz"))
                for name in self.names]  # fmt: skip
        for name in self.names:
            clips = [clip for clip in self.clips if clip.person != name]
            jobs.append(pool.submit(_fit_trees, clips, self.file(f"tree_{name}.npz"), self.file(f"arm_{name}.npz")))
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


def _fit_walk(captured: list[Motion], persons: list[str], name: str, path: Path) -> None:
    others = [i for i, person in enumerate(persons) if person != name]
    WalkingModel().fit([captured[i] for i in others], [persons[i] for i in others]).save(path)


def _fit_trees(clips: list[Clip], body: Path, arm: Path) -> None:
    database = build_database(clips, mirrored=True)
    MotionTree().fit(database).save(body)
    MotionTree(part="right_arm").fit(database).save(arm)
