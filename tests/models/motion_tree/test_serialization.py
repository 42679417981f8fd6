"""Trees as files: what comes back is the same, and arrays that would lead astray are refused."""

import json
import pickle

import numpy as np
import pytest

import motionenv
from motionenv.errors import ModelError
from motionenv.models.motion_tree.model import MotionTree
from motionenv.models.motion_tree.serialization import pack, unpack


def test_saved_and_loaded_it_draws_the_same(tree, stranger, tmp_path):
    tree.save(tmp_path / "tree.npz", card={"data": "synthesised"})
    loaded = motionenv.load(tmp_path / "tree.npz")
    assert loaded.card_ == {"data": "synthesised"}
    assert (loaded.database_.clips, loaded.database_.activities) == (tree.database_.clips, tree.database_.activities)
    for method in ("tree", "exact"):
        a, b = (t.sample(stranger, 9, seed=1, method=method) for t in (tree, loaded))
        np.testing.assert_array_equal(a.poses, b.poses)
        np.testing.assert_array_equal(a.log_probability, b.log_probability)
    there = pickle.loads(pickle.dumps(loaded))
    np.testing.assert_array_equal(there.sample(stranger, 9, seed=1).poses, loaded.sample(stranger, 9, seed=1).poses)


def test_arrays_that_do_not_belong_together_are_refused(tree):
    arrays, meta = tree.to_arrays()
    with pytest.raises(ModelError, match="damaged.*build it again"):
        MotionTree.from_arrays({**arrays, "frames": arrays["frames"][:-40]}, meta)


@pytest.mark.parametrize(
    ("name", "at", "value"),
    [
        ("frames", 5, 10**6),
        ("frames", 5, 3),
        ("database_starts", 1, 4),
        ("basis_channels", 0, 50),
        ("descent_starts", 1, 0),
        ("descent_members", 7, -1),
        ("descent_members", 7, 10**6),
        ("descent_nodes", (0, slice(0, 4)), 99),  # a level
        ("descent_nodes", (3, slice(8, 12)), 0),  # a child that comes before its parent: a way without an end
        ("descent_nodes", (0, slice(12, 16)), 127),  # a child that there isn't
        ("index_blocks", (-1, 0, -1), 0.0),
        ("index_blocks", None, np.zeros((2, 4, 32), np.float32)),
        ("forecast_pose", None, np.zeros(24)),
    ],
)
def test_arrays_that_point_outside_each_other_are_refused(tree, name, at, value):
    arrays, meta = tree.to_arrays()
    damaged = value if at is None else arrays[name].copy()
    if at is not None:
        damaged[at] = value
    with pytest.raises(ModelError, match="damaged.*build it again"):
        MotionTree.from_arrays({**arrays, name: damaged}, meta)


def test_packed_it_is_plain_arrays_and_json_from_which_all_labels_come_back(tree):
    arrays, meta = pack(tree)
    assert all(a.dtype.kind in "biuf" and a.flags.c_contiguous for a in arrays.values())
    again = MotionTree()
    unpack(again, arrays, json.loads(json.dumps(meta)))
    for name in ("clips", "activities", "persons"):
        assert getattr(again.database_, name) == getattr(tree.database_, name)
    assert np.shares_memory(again.database_.poses, arrays["database_poses"])
    np.testing.assert_array_equal(again.database_.skeleton.offsets, tree.database_.skeleton.offsets)


def test_the_array_that_is_wrong_is_named_with_what_it_should_be(tree):
    arrays, meta = pack(tree)
    says = r"damaged \(forecast_pose is float64 \(24,\), expected float64 \(25,\)\)"
    with pytest.raises(ModelError, match=says):
        unpack(MotionTree(), {**arrays, "forecast_pose": np.zeros(24)}, meta)
