"""Jobs through the client, on a running service."""

import pytest

import motionenv
from motionenv import MotionError, ServiceError
from motionenv.mocap import MarkerMap


@pytest.fixture(scope="module")
def capture(tmp_path_factory):
    """Walks of three people as files."""
    folder = tmp_path_factory.mktemp("capture")
    for person in range(3):
        motionenv.write(motionenv.synthesize("walk/fpca", 6, 60, seed=person), folder / f"{person}_01.npz")
    return sorted(folder.iterdir())


def test_a_model_is_fitted_and_walks(client, capture):
    seen = []
    job = client.fit("by-client", capture).wait(lambda job: seen.append((job.status, job.progress)), timeout=120)
    assert (job.status, job.kind, job.model) == ("done", "fit", "fitted/by-client")
    assert seen[-1] == ("done", 1.0)
    assert [progress for _, progress in seen] == sorted(progress for _, progress in seen)
    assert sorted(job.result()["used"]) == [path.name for path in capture]
    assert client.synthesize("fitted/by-client", 1, 30, seed=1).poses.shape == (30, 25)
    assert job.id in [other.id for other in client.jobs()]
    client.remove_model("fitted/by-client")
    job.remove()
    with pytest.raises(ServiceError, match="no such job") as gone:
        client.job(job.id)
    assert gone.value.status == 404


def test_jobs_that_fail_say_why(client, tmp_path):
    broken = tmp_path / "broken.bvh"
    broken.write_text("HIERARCHY\nnonsense")
    job = client.convert([broken], ".glb")
    with pytest.raises(ServiceError, match=r"broken\.bvh"):
        job.wait(timeout=60)
    with pytest.raises(MotionError, match="can't read"):
        client.inspect([tmp_path / "nothing.bvh"])


def test_films_are_rendered_at_leisure_and_cancelled(client, tmp_path):
    small = {"width": 32, "height": 32}
    job = client.render("walk/fpca", 1, 30, seed=1, picture=small)
    job.wait(timeout=60).save(tmp_path / "walk.mp4")
    assert (tmp_path / "walk.mp4").read_bytes()[4:8] == b"ftyp"
    long = client.render("walk/fpca", 600, 60, picture={"width": 1280, "height": 720})
    with pytest.raises(MotionError, match="takes longer than"):
        long.wait(timeout=0.2)
    with pytest.raises(ServiceError, match="cancelled"):
        long.cancel().wait(timeout=30)
    assert (long.refresh().status, job.cancel().status) == ("cancelled", "done")


def test_points_are_mapped_and_reported_on(client, tmp_path):
    path = tmp_path / "me_01.c3d"
    motionenv.write(motionenv.synthesize("walk/fpca", 6, 60, seed=1, speed=1.2), path)
    told = client.points([path]).wait(timeout=60).result()
    assert told["marker_set"] == "markers"
    known = MarkerMap.parse(told["map"])
    assert client.points([path], marker_map=known).wait(timeout=60).result()["assigned"] == told["assigned"]
    report = client.report([path], ".json", marker_map=known).wait(timeout=120).result()
    speed = next(one for one in report["parameters"] if one["name"] == "speed")
    assert speed["mean"] == pytest.approx(1.2, abs=0.1)
    assert client.report([path]).wait(timeout=120).result().startswith(b"<!doctype html>")
