"""`motionenv.Client` against a running service."""

import numpy as np
import pytest

import motionenv
from motionenv import MotionError, ServiceError
from motionenv.errors import ExtrapolationWarning


def test_models_are_listed_and_described(client):
    assert {"walk/fpca", "walk/eigenwalkers", "mixed/tree"} <= {model["name"] for model in client.models()}
    told, model = client.model("walk/fpca"), motionenv.load("walk/fpca")
    assert [c["deviation"] ** 2 for c in told["components"]] == pytest.approx(model.fpca_.explained_variance_)
    assert told["height"] == model.height_
    assert told["ranges"]["speed"] == {"minimum": 0.1, "maximum": 3.0, "unit": "m/s"}
    assert told["card"]["people"]


def test_a_walker_is_who_is_asked_for(client):
    how = {"deviations": np.array([1.0, -2.0]), "variation": np.float64(0), "seed": np.int64(4), "speed": None}
    motion = client.synthesize("walk/fpca", 2, 50, **how)
    np.testing.assert_array_equal(motion.poses, motionenv.synthesize("walk/fpca", 2, 50, **how).poses)


def test_a_path_and_changing_speeds_are_those_of_python(client):
    how = {"path": np.array([[0, 0], [2, 0.5], [3, 2]]), "speed": np.array([[0, 0], [1, 2.5]]), "seed": 4}
    with pytest.warns(ExtrapolationWarning, match=r"speed 2\.5 m/s is beyond"):
        motion = client.synthesize("walk/fpca", 2, 50, **how)
    with pytest.warns(ExtrapolationWarning):
        np.testing.assert_array_equal(motion.poses, motionenv.synthesize("walk/fpca", 2, 50, **how).poses)


def test_without_a_seed_walkers_differ(client):
    one, other = (client.synthesize("walk/fpca", 1, 30) for _ in range(2))
    assert (one.poses != other.poses).any()


@pytest.mark.parametrize(
    "suffix", [".npz", ".csv", ".bvh", ".glb", ".c3d", ".trc", ".mot", ".json", ".npy", ".mp4", ".webp", ".png"]
)
def test_files_come_in_every_format(client, tmp_path, suffix):
    path = tmp_path / f"walk{suffix}"
    client.save(path, "walk/fpca", 1, 30, seed=1, picture={"width": 64, "height": 64})
    assert path.stat().st_size > 500
    assert [p.name for p in tmp_path.iterdir()] == [path.name]
    assert path.read_bytes() == client.film(
        "walk/fpca", 1, 30, suffix=suffix, seed=1, picture={"width": 64, "height": 64}
    )


def test_what_cant_be_saved_leaves_an_older_file_alone(client, tmp_path):
    path = tmp_path / "walk.bvh"
    path.write_text("mine")
    with pytest.raises(ServiceError) as refused:
        client.save(path, "walk/fpca", 1, 30, speed=50)
    assert refused.value.status == 422
    assert [(e["field"], e["bound"]) for e in refused.value.errors] == [("/speed", {"le": 3.0})]
    assert refused.value.request_id
    with pytest.raises(MotionError, match="suffix must be one of"):
        client.save(tmp_path / "walk.avi", "walk/fpca", 1, 30)
    assert [p.read_text() for p in tmp_path.iterdir()] == ["mine"]


def test_a_problem_says_what_python_would_say(client):
    with pytest.raises(ServiceError, match="there is no model 'walk/nobody'") as missing:
        client.synthesize("walk/nobody", 1, 30)
    assert missing.value.status == 404


def test_errors_cross_processes_whole():
    import pickle

    error = ServiceError("no", 422, [{"field": "/fps"}], "abc", 2.0)
    other = pickle.loads(pickle.dumps(error))
    assert (str(other), vars(other)) == (str(error), vars(error))
