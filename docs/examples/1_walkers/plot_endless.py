"""
How do I get motion without an end, and steer it?
=================================================

A motion tree draws each next pose from a database of motion, given the last ten frames (paper C). A
`motionenv.models.motion_tree.MotionGenerator` goes on for as long as you ask it for frames, and its target may change
between calls.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.models.motion_tree import MotionGenerator, Target
from motionenv.types import POSE

tree = motionenv.load("mixed/tree")  # built on first use, which takes some seconds
generator = MotionGenerator(tree, "walk", seed=0)
course = ("walk", "turn left", "walk", "turn right", "walk")
parts = []
for activity in course:
    generator.target = Target(activity=activity)
    parts.append(generator.step(240))  # 8 seconds at 30 frames/s
poses = np.concatenate(parts)
print(f"{len(poses)} frames")
print(f"activities in this tree: {', '.join(tree.activities)}")

# %%
# The pelvis from above, and its heading. Turns are as wide as those in the database, with radii of 4.5 to 10 m: nobody
# turns on the spot, as nobody there does.
#
# ``Target`` also takes a heading and a speed: ``Target(heading=1.57)`` turns until the walker faces along y.

colours = {"walk": "0.5", "turn left": "#0072b2", "turn right": "#d55e00"}
figure, (above, over_time) = plt.subplots(1, 2, figsize=(9, 3.8), layout="constrained")
for i, (activity, part) in enumerate(zip(course, parts, strict=True)):
    line = {"color": colours[activity], "linewidth": 2}
    above.plot(part[:, 0], part[:, 1], label=None if activity in course[:i] else activity, **line)
    over_time.plot(8 * i + np.arange(240) / 30, np.degrees(part[:, POSE.index("root_heading")]), **line)
above.set(aspect="equal", xlabel="x [m]", ylabel="y [m]", title="from above")
above.legend()
over_time.set(xlabel="time [s]", ylabel="heading [°]", title="over time")
