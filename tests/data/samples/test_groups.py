import numpy as np

from motionenv.data.samples.groups import Group
from motionenv.data.samples.walkers import PELVIS
from motionenv.types import POSE
from tests.data.walks import EVERYTHING


def test_views_of_a_walker_show_the_same_person_elsewhere():
    group = Group(EVERYTHING, 2)
    assert np.array_equal(group.offsets[0], group.offsets[16])  # 16 walkers, then their second views
    assert not np.array_equal(group.poses[0], group.poses[16])
    assert not np.array_equal(group.views.R[0], group.views.R[16])


def test_the_world_begins_at_the_walker_who_heads_for_x():
    group = Group(EVERYTHING, 2)
    assert not group.poses[:, 0, :2].any()
    heading = group.poses[..., POSE.index("root_heading")]
    assert np.allclose(np.sin(heading).mean(axis=1), 0, atol=1e-9)
    assert (np.cos(heading).mean(axis=1) > 0).all()
    assert np.allclose(group.joints[:, :, PELVIS], group.poses[..., :3])
