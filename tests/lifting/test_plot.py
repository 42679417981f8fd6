"""The figure of a lifted walk draws what was lifted, and shares no state."""

import sys

import numpy as np
import pytest

from motionenv.body import EDGES, markers
from motionenv.lifting import lift, project_markers
from motionenv.models.synthesis import synthesize
from motionenv.types import MARKERS, Markers

pytest.importorskip("matplotlib")
from motionenv.lifting.plot import lifted_walk


def test_lifted_walk_draws_postures_truth_and_bands():
    motion = synthesize("walk/fpca", 3, 30, seed=7)
    walk = Markers(MARKERS, markers(motion.poses, motion.skeleton), motion.fps)
    lifted = lift(project_markers(walk, np.radians(40)))
    before = "matplotlib.pyplot" in sys.modules
    figure = lifted_walk(lifted)
    assert ("matplotlib.pyplot" in sys.modules) == before
    seen, unseen, over_time = np.array(figure.axes).reshape(3, 5)
    assert [len(panel.lines) for panel in seen] == [2 * len(EDGES) + 1] * 5  # estimate, truth, and the points
    assert [len(panel.lines) for panel in unseen] == [2 * len(EDGES)] * 5
    estimate, truth = over_time[0].lines[:2]
    assert over_time[0].get_title() == "left ankle"
    assert len(estimate.get_ydata()) == len(motion.poses)
    assert np.abs(estimate.get_ydata() - truth.get_ydata()).mean() < 0.1
