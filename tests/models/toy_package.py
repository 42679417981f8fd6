"""Somebody else's package that brings a gait model of ten lines, as pip leaves it when it has installed one."""

from pathlib import Path

MODULE = """\
import numpy as np
from motionenv import Motion
from motionenv.models import FixedModel


class Bounce(FixedModel):
    kind, card_ = "bounce", {"data": "none", "model licence": "CC0"}

    def make_motion(self, walker, request, rng):
        body, seconds = self.body(request.height), np.arange(request.frames) / request.fps
        poses = np.zeros((request.frames, 25))
        poses[:, 0] = (request.speed or 1.0) * seconds
        poses[:, 2] = body.height * (0.55 + 0.03 * np.cos(4 * np.pi * seconds))
        return Motion(poses, body, request.fps, "bounce")
"""
ENTRIES = """\
[motionenv.models]
toy/bounce = toy_gait:Bounce
bounce = toy_gait:Bounce
toy/broken = toy_gait_that_is_missing:Model
toy/failing = toy_gait:failing
walk/fpca = toy_gait:Bounce
"""


def install(folder: Path) -> Path:
    """Put the package into a folder, which installs it for processes with that folder in PYTHONPATH."""
    about = folder / "toy_gait-1.0.dist-info"
    about.mkdir(parents=True)
    (folder / "toy_gait.py").write_text(MODULE + "\n\ndef failing():\n    raise RuntimeError('out of order')\n")
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: toy-gait\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(ENTRIES)
    return folder
