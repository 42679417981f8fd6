"""
How do fifteen points become a 3D walk?
=======================================

They are the picture of a walker whose view isn't known. A fifth of them is missing, and the right wrist always.
"""

import numpy as np

import motionenv
from motionenv.lifting import lift, project_markers
from motionenv.lifting.plot import lifted_walk
from motionenv.types import MARKERS, Markers, Points

walk = motionenv.synthesize("walk/fpca", seconds=4, fps=30, seed=7)
seen = project_markers(Markers(MARKERS, motionenv.markers(walk.poses, walk.skeleton), 30), alpha=np.radians(40))
rng = np.random.default_rng(1)
points = seen.positions + 0.01 * rng.standard_normal(seen.positions.shape)
points[rng.random(points.shape[:2]) < 0.2] = np.nan
points[:, MARKERS.index("right_wrist")] = np.nan

lifted = lift(Points(points, 30, "m", seen.truth))
figure = lifted_walk(lifted)
print(f"view angle: {np.degrees(lifted.posterior.alpha):.1f}°, in truth 40°")
