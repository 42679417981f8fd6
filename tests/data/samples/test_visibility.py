import numpy as np

from motionenv.body import LIMBS, limb_segments
from motionenv.data import Specification
from motionenv.data.samples.drawing import Drawing
from motionenv.data.samples.groups import Group
from motionenv.data.samples.visibility import HIDDEN, OUTSIDE, SEEN, visibility
from motionenv.types import MARKERS, Skeleton

#: Limbs that meet at a joint, which therefore don't hide it.
MEET = {
    "shoulder": ("shoulders", "{}_upper_arm", "torso"), "elbow": ("{}_upper_arm", "{}_forearm"),
    "wrist": ("{}_forearm", "{}_hand"), "hip": ("pelvis", "{}_thigh", "torso"), "knee": ("{}_thigh", "{}_shin"),
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
