"""Groups of walkers: the same person in all views, people who pass by, and what pictures show of both."""

import numpy as np

from motionenv.body import LIMBS, limb_segments
from motionenv.data import Specification
from motionenv.data.samples.drawing import Drawing
from motionenv.data.samples.groups import Group
from motionenv.data.samples.views import HIDDEN, OUTSIDE, SEEN, visibility
from motionenv.data.samples.walkers import PELVIS
from motionenv.render import Raycaster, Scene
from motionenv.types import MARKERS, POSE, Camera, Skeleton
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


CHEST = ("left_trunk", "right_trunk", "left_shoulder", "right_shoulder")
#: Limbs that meet at a joint, which therefore don't hide it.
MEET = {
    "shoulder": (*CHEST, "{}_upper_arm"), "elbow": ("{}_upper_arm", "{}_forearm"),
    "wrist": ("{}_forearm", "{}_hand"), "hip": ("pelvis", "{}_thigh", *CHEST[:2]), "knee": ("{}_thigh", "{}_shin"),
    "ankle": ("{}_shin", "{}_foot"),
}  # fmt: skip


def hidden_by_rays(joint: np.ndarray, centre: np.ndarray, ends: np.ndarray, radii: np.ndarray) -> bool:
    """Brute force: whether the line from the camera to a joint comes within a limb, limbs as many spheres."""
    share = np.linspace(0, 1, 60)[:, None, None]
    balls = (ends[:, 0] * (1 - share) + ends[:, 1] * share).reshape(-1, 3)
    sizes = (radii[:, 0] * (1 - share[..., 0]) + radii[:, 1] * share[..., 0]).reshape(-1)
    line = joint - centre
    at = np.clip((balls - centre) @ line / (line @ line), 0, 1)
    return bool((np.linalg.norm(balls - centre - at[:, None] * line, axis=1) < sizes).any())


def test_hidden_joints_are_those_behind_other_limbs():
    spec = Specification(people={"views": 4}, cameras={"margin": [0.05, 0.1]}, pictures={"width": 256, "height": 256})
    group = Group(spec, 0)
    which = np.arange(64)
    pixels, depth = group.views.project(group.joints)
    found = visibility(pixels, depth, Drawing(spec, rgb=False).draw(group, which), 1)[:, 0]
    agree = []
    for i in which:
        body = Skeleton(group.offsets[i], group.radii[i], float(group.heights[i]))
        ends = limb_segments(group.poses[i, 0], body)
        centre = -group.views.R[i].T @ group.views.t[i, 0]
        for j, name in enumerate(MARKERS):
            side, _, part = name.rpartition("_")
            if part in MEET:
                own = {limb.format(side) for limb in MEET[part]}
                others = [k for k, limb in enumerate(LIMBS) if limb not in own]
                rays = hidden_by_rays(group.joints[i, 0, j], centre, ends[others], group.radii[i, others])
                agree.append((found[i, j] == HIDDEN) == rays)
    assert np.mean(agree) > 0.97  # the rest is at limbs' edges, within a pixel


def test_outside_the_picture_and_behind_the_camera():
    empty = np.zeros((1, 1, 4, 6), np.uint8)
    drawn = {"depth": np.full((1, 1, 4, 6), 20.0), "limbs": empty, "people": empty}
    pixels = np.tile([[[[2.0, 2.0]]]], (1, 1, 15, 1))
    pixels[0, 0, :5] = [[-0.6, 1], [5.6, 1], [1, -0.6], [1, 3.6], [np.nan, 1]]
    depth = np.full((1, 1, 15), 3.0)
    depth[0, 0, 5] = -1
    found = visibility(pixels, depth, drawn, 1)[0, 0]
    assert (found[:6] == OUTSIDE).all()
    assert (found[6:] == SEEN).all()
    drawn["depth"][:] = 2.0  # something in front
    assert (visibility(pixels, depth, drawn, 1)[0, 0, 6:] == HIDDEN).all()
    drawn["limbs"] = np.full_like(empty, 1 + LIMBS.index("left_thigh"))
    drawn["people"] = np.ones_like(empty)
    own = [MARKERS.index(name) for name in ("left_knee", "left_hip", "pelvis") if MARKERS.index(name) > 5]
    found = visibility(pixels, depth, drawn, 1)[0, 0]
    assert set(np.flatnonzero(found == SEEN)) == set(own)
    assert (visibility(pixels, depth, drawn, 2)[0, 0, 6:] == HIDDEN).all()  # somebody else's thigh
