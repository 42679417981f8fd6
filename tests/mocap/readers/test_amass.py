"""AMASS's files with a synthetic body model, whose vertices are turned one by one, as the models' papers write it."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from motionenv import mocap as files
from motionenv.errors import FormatError
from motionenv.mocap.readers import amass
from motionenv.types import Markers

PARENTS = [-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21]
VERTICES = 40


def body_model(folder, rng, joints=24):
    """A body model of random vertices, each joint a convex combination of them."""
    parents = [*PARENTS, *range(len(PARENTS) - 1, joints - 1)][:joints]
    arrays = {
        "J_regressor": rng.dirichlet(np.ones(VERTICES), joints),
        "v_template": rng.normal(0, 0.5, (VERTICES, 3)),
        "shapedirs": rng.normal(0, 0.05, (VERTICES, 3, 10)),
        "kintree_table": np.array([np.array(parents, dtype=np.int64).astype(np.uint32), np.arange(joints)]),
    }
    path = folder / "model.npz"
    np.savez(path, **arrays)
    return path, arrays, parents


def trial(folder, rng, many=24, /, **changes):
    """An AMASS file."""
    arrays = {
        "poses": rng.normal(0, 0.8, (7, 3 * many)), "trans": rng.normal(0, 1, (7, 3)), "betas": rng.normal(0, 1, 16),
        "gender": np.array("female"), "mocap_framerate": np.array(120.0), **changes,
    }  # fmt: skip
    path = folder / "walk_poses.npz"
    np.savez(path, **{key: value for key, value in arrays.items() if value is not None})
    return path, arrays


def by_hand(model, parents, file):
    """Positions (frames, J, 3) and rotations by composing each joint's chain from the root, in the file's frame."""
    shaped = model["v_template"].copy()
    for i in range(10):
        shaped += model["shapedirs"][:, :, i] * file["betas"][i]
    rest = model["J_regressor"] @ shaped
    frames, joints = len(file["poses"]), len(parents)
    places, turns = np.zeros((frames, joints, 3)), np.zeros((frames, joints, 3, 3))
    for t in range(frames):
        for j in range(joints):
            chain, at = [], j
            while at >= 0:
                chain.append(at)
                at = parents[at]
            turn, place = Rotation.identity(), rest[0] + file["trans"][t]
            for before, at in zip([None, *chain[::-1]], chain[::-1], strict=False):
                if before is not None:
                    place = place + turn.apply(rest[at] - rest[before])
                turn = turn * Rotation.from_rotvec(file["poses"][t, 3 * at : 3 * at + 3])
            places[t, j], turns[t, j] = place, turn.as_matrix()
    return places, turns


def test_poses_give_the_joints_of_the_body_model(tmp_path):
    rng = np.random.default_rng(5)
    model_path, model, parents = body_model(tmp_path, rng)
    path, file = trial(tmp_path, rng)
    got = files.read(path, body_model=model_path)
    assert isinstance(got, Markers)
    places, turns = by_hand(model, parents, file)
    np.testing.assert_allclose(got.positions, places, atol=1e-12)  # AMASS's world is z up, as ours
    # in the rest pose y is up and z forward; our axes of a joint are z, x, y of the model's
    np.testing.assert_allclose(got.rotations, turns[..., [2, 0, 1]], atol=1e-12)
    assert got.parents == tuple(parents)
    assert got.fps == 120
    assert got.names[:5] == ("pelvis", "left_hip", "right_hip", "spine1", "left_knee")
    assert len(got.names) == 24
    tipped = files.read(path, body_model=model_path, up="y")
    np.testing.assert_allclose(tipped.positions, places[..., [2, 0, 1]], atol=1e-12)


def test_the_body_is_common_to_models_with_other_hands(tmp_path):
    """Poses of SMPL-H on SMPL: the first 22 joints are the same."""
    rng = np.random.default_rng(6)
    model_path, model, parents = body_model(tmp_path, rng)
    path, file = trial(tmp_path, rng, 52)
    got = amass.read(path, body_model=model_path)
    assert got.names == amass.JOINTS[22]
    places, _ = by_hand(model, parents[:22], {**file, "poses": file["poses"][:, :66]} | {"betas": file["betas"]})
    np.testing.assert_allclose(got.positions, places, atol=1e-12)


def test_parts_of_smplx_are_its_poses(tmp_path):
    rng = np.random.default_rng(7)
    model_path, *_ = body_model(tmp_path, rng, joints=22)
    path, file = trial(tmp_path, rng, 22)
    expected = amass.read(path, body_model=model_path).positions
    poses = file["poses"]
    path, _ = trial(
        tmp_path, rng, poses=None, root_orient=poses[:, :3], pose_body=poses[:, 3:], trans=file["trans"],
        betas=file["betas"], mocap_framerate=None, mocap_frame_rate=np.array(60.0),
    )  # fmt: skip
    got = amass.read(path, body_model=model_path)
    np.testing.assert_allclose(got.positions, expected, atol=1e-12)
    assert got.fps == 60


@pytest.mark.parametrize(("count", "key"), [(22, "joints"), (24, "Jtr"), (52, "joint_positions"), (127, "joints")])
def test_positions_of_joints_need_no_body_model(tmp_path, count, key):
    """HumanML3D's are y up, AMASS's z up: a person stands along the axis that is up."""
    body = np.random.default_rng(8).uniform(-0.25, 0.25, (5, count, 3))
    body[:, :22, 2] = np.linspace(1.7, 0, 22)  # the pelvis comes before the feet
    path, _ = trial(tmp_path, np.random.default_rng(9), poses=None, **{key: body})
    got = files.read(path)
    n = min(count, 55)
    np.testing.assert_allclose(got.positions, body[:, :n])
    assert got.names[1] == "left_hip"
    assert len(got.names) == n
    trial(tmp_path, np.random.default_rng(9), poses=None, **{key: body[..., [1, 2, 0]]})
    np.testing.assert_allclose(files.read(path).positions, body[:, :n])
    trial(tmp_path, np.random.default_rng(9), poses=None, **{key: body * 1000})
    with pytest.raises(FormatError, match=r"in metres the joints would span 1\.\d+e\+03 m; .*--unit mm"):
        files.read(path)
    np.testing.assert_allclose(files.read(path, unit="mm").positions, body[:, :n])


def test_what_is_missing_is_asked_for(tmp_path):
    rng = np.random.default_rng(10)
    path, _ = trial(tmp_path, rng)
    with pytest.raises(FormatError, match=r"shape of a female body.*smplh/female/model\.npz.*--body-model"):
        files.read(path)
    path, _ = trial(tmp_path, rng, mocap_framerate=None)
    with pytest.raises(FormatError, match=r"frame rate; pass fps= \(--fps\)"):
        files.read(path)
    assert files.read(path, fps=30, body_model=body_model(tmp_path, rng)[0]).fps == 30
    pickle = tmp_path / "model.pkl"
    pickle.write_bytes(b"\x80\x04N.")
    with pytest.raises(FormatError, match=r"model\.pkl: body models are read as NPZ.*numpy\.savez"):
        files.read(path, fps=30, body_model=pickle)


BAD = {
    "hands only": ({"poses": np.zeros((7, 45))}, "poses: must have shape"),
    "text": ({"poses": np.full((7, 72), "a")}, "poses: must have shape"),
    "infinite": ({"poses": np.full((7, 72), np.inf)}, "poses: must have shape .* and finite values"),
    "short translation": ({"trans": np.zeros((6, 3))}, r"trans: must have shape \(7, 3\)"),
    "some joints": ({"poses": None, "joints": np.zeros((7, 17, 3))}, r"joints: must have shape \(frames, 22, 24"),
}


@pytest.mark.parametrize(("changes", "problem"), BAD.values(), ids=BAD)
def test_other_arrays_are_refused_by_name(tmp_path, changes, problem):
    rng = np.random.default_rng(11)
    path, _ = trial(tmp_path, rng, **changes)
    model = None if "joints" in changes else body_model(tmp_path, rng)[0]
    with pytest.raises(FormatError, match=problem):
        files.read(path, body_model=model)


def test_a_body_model_is_checked(tmp_path):
    rng = np.random.default_rng(12)
    path, _ = trial(tmp_path, rng)
    model_path, arrays, _ = body_model(tmp_path, rng)
    np.savez(model_path, **{key: value for key, value in arrays.items() if key != "shapedirs"})
    with pytest.raises(FormatError, match=r"model\.npz: isn't a body model: it has no shapedirs"):
        files.read(path, body_model=model_path)
    np.savez(model_path, **{**arrays, "v_template": np.zeros((3, 3))})
    with pytest.raises(FormatError, match="the shapes don't fit"):
        files.read(path, body_model=model_path)


def test_files_of_others_are_named_by_their_arrays(mocap, tmp_path):
    path = tmp_path / "a.npz"
    np.savez(path, clips=np.zeros(3), speed=np.zeros(2))
    with pytest.raises(FormatError, match="another kind, with clips, speed: neither motionenv's .* nor AMASS's"):
        files.read(path)
