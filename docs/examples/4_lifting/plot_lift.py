"""
How do fifteen points become a 3D walk?
=======================================

`lift` fits the postures that a network considers likely to the 2D points of all frames. The input here is poor on
purpose: 10 mm of noise, a fifth of the points missing, the right wrist never seen, and the view unknown.
"""

import numpy as np

import motionenv
from motionenv.lifting import lift, project_markers
from motionenv.lifting.plot import lifted_walk
from motionenv.types import MARKERS, Markers, Points

walk = motionenv.synthesize("walk/fpca", seconds=4, fps=30, seed=7)
truth = Markers(MARKERS, motionenv.markers(walk.poses, walk.skeleton), 30)
seen = project_markers(truth, alpha=np.radians(40))
rng = np.random.default_rng(1)
points = seen.positions + 0.01 * rng.standard_normal(seen.positions.shape)
points[rng.random(points.shape[:2]) < 0.2] = np.nan
points[:, MARKERS.index("right_wrist")] = np.nan

lifted = lift(Points(points, 30, "m", seen.truth))
off = lifted.positions - seen.truth.positions
off = off - off[:, [MARKERS.index("pelvis")]]
error = 1000 * np.linalg.norm(off, axis=-1).mean()
print(f"error per joint, about the pelvis: {error:.0f} mm")

# %%
# Top: five moments of a second as the camera saw them, with the points in black. Middle: the same moments with depth
# across, which the camera can't see. Bottom: the depth of five markers over time with 90 % intervals. The
# right wrist was never seen: its place is what people usually do, without an interval.

figure = lifted_walk(lifted)
