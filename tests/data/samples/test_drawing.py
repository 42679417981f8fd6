import numpy as np

from motionenv.body import LIMBS
from motionenv.data.samples.drawing import Drawing
from motionenv.data.samples.groups import Group
from motionenv.render import Raycaster, Scene
from motionenv.types import Camera, Skeleton
from tests.data.walks import EVERYTHING

PLAIN = EVERYTHING.replace(
    pictures={"background": "black", "objects": 0, "occluders": 0, "noise": 0, "flicker": 0, "light": "fixed"},
    people={"passers_by": [0, 2]},
)


def alone(group: Group, i: int, frame: int) -> np.ndarray:
    """Depth of the walker of a sample alone, by the renderer of single bodies."""
    views, look = group.views, group.spec.pictures
    camera = Camera(views.K[i], views.R[i], views.t[i, frame], look.width, look.height)
    body = Skeleton(group.offsets[i], group.radii[i], float(group.heights[i]))
    return Raycaster(Scene(ground=False)).render(group.poses[i, frame], body, camera, rgb=False)


def test_the_walker_is_where_another_renderer_sees_her_and_the_nearer_person_is_in_front():
    group = Group(PLAIN, 0)
    drawn = Drawing(PLAIN, rgb=True).draw(group, np.arange(32))
    hides = 0
    for i in range(32):
        expected = alone(group, i, 2)
        mine = drawn["people"][i, 2] == 1
        assert np.array_equal(drawn["depth"][i, 2][mine], expected.depth[mine])
        assert np.array_equal(drawn["limbs"][i, 2][mine], expected.limbs[mine])
        gone = (expected.limbs > 0) & ~mine  # only behind somebody nearer
        assert (drawn["depth"][i, 2][gone] < expected.depth[gone]).all()
        assert (drawn["people"][i, 2][gone] > 1).all()
        hides += gone.any()
    assert hides
    assert np.array_equal(drawn["mask"] == 255, drawn["people"] == 1)
    assert np.array_equal(drawn["people"] > 0, drawn["limbs"] > 0)
    assert drawn["limbs"].max() <= len(LIMBS)
    assert (drawn["depth"][drawn["people"] == 0] == 20).all()


def test_pictures_do_not_depend_on_what_is_drawn_together():
    group, drawing = Group(EVERYTHING, 0), Drawing(EVERYTHING, rgb=True)
    together = drawing.draw(group, np.arange(8))
    for i in (5, 0):
        single = drawing.draw(group, np.array([i]))
        assert all(np.array_equal(single[name][0], together[name][i]) for name in together)


def test_scenery_hides_people_only_where_it_is_nearer():
    group = Group(EVERYTHING, 0)
    bare = EVERYTHING.replace(pictures={"objects": 0, "occluders": 0})
    full, plain = (Drawing(spec, rgb=True).draw(group, np.arange(32)) for spec in (EVERYTHING, bare))
    lost = (plain["people"] > 0) & (full["people"] == 0)
    assert lost.any()
    assert (full["depth"][lost] < plain["depth"][lost]).all()
    kept = (plain["people"] > 0) & ~lost
    assert np.array_equal(full["people"][kept], plain["people"][kept])
