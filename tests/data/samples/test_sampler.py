import numpy as np
import pytest

from motionenv.body import markers
from motionenv.data import Sampler
from motionenv.types import Camera, Skeleton
from tests.data.walks import EVERYTHING, SINGLE, same


@pytest.mark.parametrize("spec", [EVERYTHING, SINGLE])
def test_a_sample_is_a_function_of_its_index(spec):
    in_turn = list(Sampler(spec).samples(0, spec.samples))
    asked = Sampler(spec)
    order = np.random.default_rng(0).permutation(spec.samples)[:12]
    assert all(same(asked.sample(int(i)), in_turn[i]) for i in order)
    assert [int(sample["index"]) for sample in in_turn] == list(range(spec.samples))


def test_fields_agree_with_each_other():
    for sample in Sampler(EVERYTHING).samples(0, 8):
        body = Skeleton(sample["offsets"], sample["radii"], float(sample["height"]))
        np.testing.assert_allclose(sample["joints"], markers(sample["poses"], body), atol=1e-12)
        for frame in range(6):
            camera = Camera(sample["K"], sample["R"], sample["t"][frame], 48, 40)
            np.testing.assert_allclose(sample["pixels"][frame], camera.project(sample["joints"][frame])[0], atol=1e-9)
        assert sample["others_joints"].shape == (2, 6, 15, 3)
        assert sample["detected"].shape == (6, 15, 3)
        seen = np.isfinite(sample["detected"][..., 0])
        off = np.linalg.norm(sample["detected"][..., :2] - sample["pixels"], axis=-1)[seen]
        assert 0 < np.median(off) < 5
        assert ((sample["phase"] >= 0) & (sample["phase"] < 1)).all()


def test_asking_for_less_changes_nothing_else():
    full = Sampler(EVERYTHING).sample(5)
    less = Sampler(EVERYTHING.replace(output={"fields": ["joints", "rgb"]})).sample(5)
    assert set(less) == {"index", "walker", "joints", "rgb"}
    assert all(np.array_equal(less[name], full[name]) for name in less)


def test_another_seed_is_another_set_and_single_pictures_have_no_frames():
    one, other = Sampler(SINGLE).sample(3), Sampler(SINGLE.replace(seed=1)).sample(3)
    assert not np.array_equal(one["rgb"], other["rgb"])
    assert one["rgb"].shape == (48, 64, 3)
    assert one["others_joints"].shape == (3, 15, 3)
    assert one["t"].shape == (3,)
    assert Sampler(SINGLE).sample(19)["walker"] == one["walker"] != other["walker"]  # the second view of walker 3
    more = SINGLE.replace(frames=10 * SINGLE.frames, pictures={"noise": 1.0})  # who walks stays
    assert Sampler(more).sample(3)["walker"] == one["walker"]
