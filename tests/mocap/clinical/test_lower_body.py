"""The lower body by the Conventional Gait Model: which way to a joint is taken, and what a standing trial adds."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from motionenv.mocap import read
from motionenv.mocap.clinical import clinical_angles
from motionenv.mocap.clinical.lower_body import calibrate, lower_body
from motionenv.mocap.clinical.measurements import Measurements, Side

PERSON = Measurements(*[Side(leg_length=0.9, knee_width=0.1, ankle_width=0.07)] * 2)

# A person who stands and faces x. Knees and ankles have their axes along y, with centres 0.1 m from the midline.
STANDING = {
    "left_asis": (0.16, 0.12, 1.0), "right_asis": (0.16, -0.12, 1.0), "sacrum": (0, 0, 1.0),
    "left_thigh": (0.08, 0.20, 0.7), "right_thigh": (0.08, -0.20, 0.7),
    "left_knee_lateral": (0.08, 0.157, 0.5), "right_knee_lateral": (0.08, -0.157, 0.5),
    "left_shank": (0.07, 0.20, 0.3), "right_shank": (0.07, -0.20, 0.3),
    "left_ankle_lateral": (0.06, 0.142, 0.09), "right_ankle_lateral": (0.06, -0.142, 0.09),
    "left_heel": (0.0, 0.10, 0.03), "right_heel": (0.0, -0.10, 0.03),
    "left_toe": (0.20, 0.10, 0.03), "right_toe": (0.20, -0.10, 0.03),
}  # fmt: skip


def standing(without=(), **more) -> dict[str, np.ndarray]:
    points = {k: v for k, v in (STANDING | more).items() if k not in without}
    return {name: np.tile(np.array(point, dtype=float), (3, 1)) for name, point in points.items()}


def test_the_two_sides_are_mirror_images():
    body = lower_body(standing(), PERSON)
    for joint in ("hip", "knee", "ankle"):
        left, right = getattr(body.left, joint), getattr(body.right, joint)
        np.testing.assert_allclose(left * [1, -1, 1], right, atol=1e-12)
    assert 0.05 < body.left.knee[0, 1] < 0.157
    for turn in (body.left.thigh, body.left.shank, body.left.foot, body.right.foot):
        np.testing.assert_allclose(turn @ turn.swapaxes(-1, -2), np.tile(np.eye(3), (3, 1, 1)), atol=1e-12)


def test_a_flat_foot_is_level_by_its_own_static_offsets():
    body = lower_body(standing(), PERSON)
    np.testing.assert_allclose(body.left.foot[0][:, 2], [-1, 0, 0], atol=1e-9)


@pytest.mark.parametrize(
    ("more", "without", "how"),
    [
        ({}, (), "chord function with wands"),
        ({}, ("left_thigh", "right_thigh"), "chord function without wands, in the plane of the pelvis' lateral axis"),
        ({"left_knee_medial": (0.08, 0.05, 0.5)}, (), "midway between lateral and medial markers"),
        ({"left_knee": (0.08, 0.1, 0.5)}, (), "the file's own centres"),
    ],
)
def test_what_is_there_decides_the_way(more, without, how):
    body = lower_body(standing(without=without, **more), PERSON)
    said = body.how["knee"] if "left_knee_medial" not in more and "left_knee" not in more else None
    centre = body.left.knee[0]
    assert said is None or said.startswith(how)
    if "left_knee" in more:
        np.testing.assert_allclose(centre, [0.08, 0.1, 0.5])
    elif "left_knee_medial" in more:
        np.testing.assert_allclose(centre, [0.08, 0.1035, 0.5])
    else:
        assert np.linalg.norm(centre - STANDING["left_knee_lateral"]) == pytest.approx(0.057)


def test_one_leg_or_no_pelvis_leaves_the_rest_unknown():
    one = lower_body(standing(without=[name for name in STANDING if name.startswith("right_k")]), PERSON)
    assert one.right.knee is None
    assert one.right.shank is None
    assert one.left.shank is not None
    none = lower_body(standing(without=("sacrum",)), PERSON)
    assert none.pelvis is None
    assert none.left.hip is None


def test_a_standing_trial_with_medial_markers_locates_the_axes_of_the_walk():
    """Wands 20 degrees off: with the standing trial the walk has the centres of the true axes, without it not."""
    off = {"left_thigh": (0.08 + 0.06, 0.195, 0.7), "left_shank": (0.07 + 0.04, 0.19, 0.3)}
    medial = {"left_knee_medial": (0.08, 0.043, 0.5), "left_ankle_medial": (0.06, 0.058, 0.09)}
    truth = lower_body(standing(**off, **medial), PERSON)
    calibration = calibrate(standing(**off, **medial), PERSON)
    walk = lower_body(standing(**off), PERSON, calibration)
    plain = lower_body(standing(**off), PERSON)
    for joint in ("knee", "ankle"):
        right = getattr(truth.left, joint)
        assert np.linalg.norm(getattr(walk.left, joint) - right, axis=-1).max() < 0.004
        assert np.linalg.norm(getattr(plain.left, joint) - right, axis=-1).min() > 0.008
    assert set(calibration.feet) == {"left", "right"}


def with_turned_wands(degrees: float) -> tuple[dict[str, np.ndarray], Measurements]:
    """Wands that are turned inwards about the limbs by an angle [degrees], and the person with that offset stated."""
    points, true = standing(), lower_body(standing(), PERSON)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        leg = getattr(true, side)
        for wand, above, centre in (("thigh", leg.hip, leg.knee), ("shank", leg.knee, leg.ankle)):
            axis = (above - centre)[0]
            turn = Rotation.from_rotvec(sign * np.radians(degrees) * axis / np.linalg.norm(axis)).as_matrix()
            points[f"{side}_{wand}"] = centre + (points[f"{side}_{wand}"] - centre) @ turn.T
    stated = replace(PERSON.left, thigh_rotation=np.radians(degrees), shank_rotation=np.radians(degrees))
    return points, replace(PERSON, left=stated, right=stated)


@pytest.mark.parametrize("degrees", [-25.0, 15.0])
def test_stated_rotations_of_wands_are_undone(degrees):
    """ThighRotation and ShankRotation, the angle about the limb from the wand to the lateral marker."""
    points, stated = with_turned_wands(degrees)
    true, found, plain = lower_body(standing(), PERSON), lower_body(points, stated), lower_body(points, PERSON)
    for side in ("left", "right"):
        for joint in ("hip", "knee", "ankle"):
            right = getattr(getattr(true, side), joint)
            np.testing.assert_allclose(getattr(getattr(found, side), joint), right, atol=1e-4)
        assert np.linalg.norm(getattr(plain, side).knee - getattr(true, side).knee, axis=-1).min() > 0.01


def test_wands_far_off_are_believed_where_the_person_was_measured_or_as_asked():
    """Wands in front of thighs whose knees are bent: in the axis' plane, they would make a knee of much varus."""
    bent = {"left_ankle_lateral": (-0.3, 0.142, 0.3), "right_ankle_lateral": (-0.3, -0.142, 0.3)}
    points = standing(left_thigh=(0.25, 0.15, 0.7), right_thigh=(0.25, -0.15, 0.7), **bent)
    free = lower_body(points, PERSON)
    measured = lower_body(points, replace(PERSON, given=True))
    assert free.how["knee"].startswith("chord function without wands")
    assert free.how["wands of the thighs"].startswith("left out")
    assert (measured.how["knee"], measured.how["wands of the thighs"][:12]) == (
        "chord function with wands",
        "used, though",
    )
    np.testing.assert_array_equal(lower_body(points, PERSON, wands="use").left.knee, measured.left.knee)
    ignored = lower_body(points, replace(PERSON, given=True), wands="ignore")
    np.testing.assert_array_equal(ignored.left.knee, lower_body(standing(**bent), PERSON, wands="ignore").left.knee)
    assert not ignored.left.ankle_axis
    assert not any("wands of" in name for name in ignored.how)


def test_tibial_torsion_turns_the_ankles_axis_outwards_from_the_knees():
    twisted = replace(PERSON, left=replace(PERSON.left, tibial_torsion=-0.3))
    assert lower_body(standing(), twisted).left.torsion == pytest.approx(0.3)
    assert lower_body(standing(), twisted).right.torsion == 0


def test_wands_that_make_the_knee_bend_sideways_are_left_out(mocap):
    """One trial in two files: C3D cuts the names of its medial markers, which show the knees' axes in the TRC.

    The wands' plane gives half of the flexion as varus, though on average it is what legs have.
    """
    full, cut = read(mocap / "btkdata/TRCSamples/Gait.trc"), read(mocap / "bmc/data/Gait.c3d")
    assert np.nanstd(full.positions[:, full.index("C7")] - cut.positions[:, cut.index("C7")]) < 1e-3
    truth, auto, believed = clinical_angles(full), clinical_angles(cut), clinical_angles(cut, wands="use")
    for name in ("left_knee_flexion", "right_knee_flexion"):
        assert np.nanstd(auto[name] - truth[name]) < 4
        assert np.nanstd(believed[name] - truth[name]) > 8


def test_wands_of_shanks_that_twist_them_more_than_legs_are_left_out():
    """Shins are twisted by 15 to 45°: at 30° the wand is believed, at 70° the knee's axis serves instead."""
    plain, some, far = (lower_body(with_turned_shanks(degrees), PERSON) for degrees in (0.0, 30.0, 70.0))
    for body in (plain, some):
        assert body.how == {name: why for name, why in body.how.items() if "wands of" not in name}
        assert (body.left.ankle_axis, body.right.ankle_axis) == (True, True)
    assert far.how["wands of the shanks"] == "left out, as they don't lie in the plane of the ankle's axis"
    assert (far.left.ankle_axis, far.right.ankle_axis) == (False, False)
    used = lower_body(with_turned_shanks(70.0), PERSON, wands="use")
    for side in ("left", "right"):  # [m] from where the ankles are
        off = [np.linalg.norm(getattr(body, side).ankle - getattr(plain, side).ankle, axis=-1) for body in (far, used)]
        assert off[0].max() < 0.01 < 0.03 < off[1].min()


def with_turned_shanks(degrees: float) -> dict:
    """The standing person with wands turned outwards about the shanks from the ankles' axes."""
    points, true = standing(), lower_body(standing(), PERSON)
    for side, leg, sign in (("left", true.left, 1), ("right", true.right, -1)):
        axis = (leg.knee - leg.ankle)[0]
        turn = Rotation.from_rotvec(sign * np.radians(degrees) * axis / np.linalg.norm(axis)).as_matrix()
        points[f"{side}_shank"] = leg.ankle + (points[f"{side}_shank"] - leg.ankle) @ turn.T
    return points
