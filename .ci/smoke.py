"""What a newcomer does first, with the installed package alone: a walk, a film, files, an environment, a lifted walk.

Run it anywhere but in a checkout: python smoke.py. It says nothing and exits with 0, or shows what is broken.
"""

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import gymnasium
import numpy as np

import motionenv
import motionenv.envs
from motionenv import gait
from motionenv.envs.agents import Kalman, evaluate
from motionenv.lifting import project_markers
from motionenv.metrics import pelvis_mpjpe
from motionenv.render import film
from motionenv.types import MARKERS, Markers

with TemporaryDirectory() as folder:
    here = Path(folder)
    walk = motionenv.synthesize("walk/fpca", seconds=4, fps=30, seed=7)
    motionenv.write_video(here / "walk.mp4", film(walk, width=160, height=120), walk.fps)
    for suffix in ("bvh", "glb", "c3d", "trc", "mot", "csv", "npz"):
        motionenv.write(walk, here / f"walk.{suffix}")
    again = motionenv.retarget(motionenv.read(here / "walk.bvh"))
    apart = motionenv.markers(again.poses, again.skeleton) - motionenv.markers(walk.poses, walk.skeleton)
    assert np.abs(apart).max() < 0.02, "a BVH file isn't the walk that was written"
    gait.write_report([here / "walk.bvh"], here / "report.html")

    places = Markers(MARKERS, motionenv.markers(walk.poses, walk.skeleton), walk.fps)
    seen = project_markers(places, alpha=np.radians(40))
    error = pelvis_mpjpe(motionenv.lift(seen).positions, seen.truth.positions).mean()
    assert error < 0.04, "a lifted walk is wrong"

    env = gymnasium.make("motionenv/WalkerTracking-v1", observation="mask", horizon=10)
    assert np.isfinite(evaluate(env, Kalman(env), episodes=1, seed=7).errors).all()

    command = [Path(sys.executable).parent / "motionenv", "synth", "walk/eigenwalkers", "--seconds", "2"]
    subprocess.run([*command, "--out", here / "other.bvh"], check=True, stdout=subprocess.DEVNULL)
    assert (here / "other.bvh").stat().st_size > 10_000, "the command wrote no walk"
