"""Shared parts of the motion tree's benchmarks: Bandai-Namco's capture, held-out clips, larger databases, options."""

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from benchmarks import Arguments, scratch
from motionenv.body.skeleton import mirror
from motionenv.models.motion_tree.database import Clip, Database, build_database
from motionenv.models.motion_tree.features import FPS, WINDOW
from motionenv.models.motion_tree.training import read_clips
from motionenv.types import Motion

HISTORY = WINDOW + 2  # frames that a tree uses: a window, and two before it for velocities


def options(doc: str) -> Arguments:
    """The command line of these scripts."""
    parser = Arguments(doc, mocap=("bandai_namco",))
    parser.add_argument("--large", action="store_true", help="also databases of 5,000,000 windows")
    parser.add_argument("--plot", type=Path, quick=scratch() / "speed.png", help="file for a plot")
    return parser


def capture(asked: argparse.Namespace) -> list[Clip]:
    """All clips."""
    return list(read_clips(asked.mocap / "bandai_namco"))


def held_out(clips: list[Clip]) -> tuple[Database, Database]:
    """Databases of four fifths of the clips for fitting, and of every fifth, on the same skeleton."""
    known = build_database(c for i, c in enumerate(clips) if i % 5 != 4)
    return known, build_database(clips[4::5], skeleton=known.skeleton)


def histories(database: Database, count: int | None = None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Histories (n, 12, 25), the next poses (n, 25) and the sequence (n,) of each; `count` of them, or all."""
    last = np.concatenate([np.arange(a + HISTORY - 1, b - 1) for a, b in zip(*bounds(database), strict=True)])
    if count is not None and count < len(last):
        last = last[np.linspace(0, len(last) - 1, count).astype(int)]
    frames = last[:, None] + np.arange(1 - HISTORY, 1)
    return database.poses[frames].astype(float), database.poses[last + 1].astype(float), database.sequence_of(last)


def bounds(database: Database) -> tuple[np.ndarray, np.ndarray]:
    """First frame of each sequence, and the first one after it."""
    return database.starts[:-1], database.starts[1:]


def enlarged(clips: list[Clip], windows: int, seed: int = 0) -> Iterator[Clip]:
    """Yield clips with at least `windows` windows: the clips themselves, then rounds of variants.

    A variant has another speed (0.8 to 1.25 times), is mirrored with probability ½, and its joint angles have a slow
    random change (knots every half second, 0.2 standard deviations of each angle over all clips). So windows remain
    plausible motion with nearly the capture's spectrum of variance, and none repeats.
    """
    rng = np.random.default_rng(seed)
    spread = 0.2 * np.concatenate([c.motion.angles for c in clips]).std(0)
    made, turn = 0, 0
    while made < windows:
        for clip in clips:
            new = clip if turn == 0 else _variant(clip, spread, rng)
            made += max(int(new.motion.seconds * FPS - 1e-9) - WINDOW, 0)
            yield new
            if made >= windows:
                return
        turn += 1


def _variant(clip: Clip, spread: np.ndarray, rng: np.random.Generator) -> Clip:
    motion = clip.motion
    poses = mirror(motion.poses) if rng.random() < 0.5 else motion.poses.copy()
    knots = np.arange(0.0, motion.seconds + 1.0, 0.5)
    slow = CubicSpline(knots, rng.normal(size=(len(knots), 19)) * spread)
    poses[:, 6:] += slow(np.arange(len(poses)) / motion.fps)
    pace = 1.25 ** rng.uniform(-1, 1)
    return Clip(Motion(poses, motion.skeleton, motion.fps * pace, motion.name), clip.name, clip.activity, clip.person)
