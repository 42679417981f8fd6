import numpy as np

from motionenv.data.samples.drawing import Drawing
from motionenv.data.samples.groups import Group
from motionenv.data.samples.walkers import PELVIS
from tests.data.walks import EVERYTHING


def test_passers_by_keep_apart_are_as_many_as_asked_and_are_seen():
    spec = EVERYTHING.replace(people={"passers_by": [1, 3], "views": 8})
    group = Group(spec, 1)
    passers = group.passers
    assert passers.present.shape == (3, 128)
    assert passers.present[0].mean() > 0.8  # some would walk into somebody
    assert 0.1 < passers.present[2].mean() < passers.present[1].mean() < passers.present[0].mean()
    roots = np.concatenate([group.joints[None, :, :, PELVIS, :2], passers.poses[..., :2]])
    for i in range(4):
        for j in range(i):
            apart = np.linalg.norm(roots[i] - roots[j], axis=-1)
            assert np.nanmin(apart) > 0.59
    assert np.isnan(passers.joints[~passers.present]).all()
    truth = passers.truth(np.arange(128), Drawing(spec, rgb=False).draw(group, np.arange(128)))
    seen = (truth["others_visibility"] > 0).any(axis=(2, 3))
    assert seen[passers.present.T].mean() > 0.7
    assert not truth["others_visibility"][~passers.present.T].any()
