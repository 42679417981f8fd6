"""A tree of walks of a shipped model, and a walk of somebody who is not in it."""

import pytest

import motionenv
from motionenv.models.motion_tree.database import Clip, build_database
from motionenv.models.motion_tree.model import MotionTree
from motionenv.types import Motion


@pytest.fixture(scope="package")
def database():
    model = motionenv.load("walk/fpca")
    walks = [model.synthesize(seconds=6, fps=30, seed=i, height=1.75) for i in range(12)]
    return build_database([Clip(w, f"walk {i}", "walk", str(i)) for i, w in enumerate(walks)])


@pytest.fixture(scope="package")
def tree(database):
    return MotionTree().fit_database(database)


@pytest.fixture(scope="package")
def stranger(database):
    """A person who is not in the database, on its body."""
    walk = motionenv.load("walk/fpca").synthesize(seconds=4, fps=30, seed=99, height=1.75)
    return Motion(walk.poses, database.skeleton, walk.fps, walk.name)
