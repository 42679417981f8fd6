"""
How do I get motion without an end, and steer it?
=================================================

A motion tree draws what comes next from a database of motion. The target may change between steps; nobody turns on
the spot, because nobody in this database does.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.body import markers
from motionenv.models.motion_tree import MotionGenerator, Target
from motionenv.types import MARKERS

tree = motionenv.load("mixed/tree")
generator = MotionGenerator(tree, "walk", seed=2)
poses = []
headings = (0, 90, 0)
for heading in np.radians(headings):
    generator.target = Target(heading=heading, speed=1.2)
    poses.append(generator.step(420))  # 14 seconds at 30 frames/s

figure, axis = plt.subplots(figsize=(5, 4.5), layout="constrained")
for i, (part, heading) in enumerate(zip(poses, headings, strict=True)):
    pelvis = markers(part, tree.body())[:, MARKERS.index("pelvis")]
    axis.plot(*pelvis[:, :2].T, color=plt.cm.viridis(i / 3), label=f"{14 * i} to {14 * i + 14} s: to {heading}°")
axis.set(aspect="equal", xlabel="x [m]", ylabel="y [m]")
axis.legend(fontsize="small")
