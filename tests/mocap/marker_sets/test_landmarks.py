"""Landmarks: both sides alike, joint centres named as the body's nodes."""

from motionenv.body import NODES
from motionenv.mocap.marker_sets.landmarks import LANDMARKS, MIDDLE, SIDED


def test_each_landmark_is_on_both_sides_or_in_the_middle():
    left = {name.removeprefix("left_") for name in LANDMARKS if name.startswith("left_")}
    right = {name.removeprefix("right_") for name in LANDMARKS if name.startswith("right_")}
    assert left == right == set(SIDED)
    assert len(LANDMARKS) == 2 * len(SIDED) + len(MIDDLE)


def test_every_node_of_the_body_can_be_named():
    assert set(NODES) <= set(LANDMARKS)
