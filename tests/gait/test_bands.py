"""Reference bands."""

import numpy as np
import pytest

from benchmarks.mocap.band import made
from motionenv.errors import FormatError, MotionError
from motionenv.gait import band_of, load_band, shipped_band
from motionenv.gait.trial import ANGLES


def test_every_person_counts_once(people):
    band = band_of(people, "synthesised")
    knee = ANGLES.index("knee_flexion")
    each = [np.concatenate([t.both_sides() for t in trials])[:, :, knee].mean(0) for trials in people.values()]
    np.testing.assert_allclose(band.mean["knee_flexion"], np.mean(each, axis=0))
    np.testing.assert_allclose(band.sd["knee_flexion"], np.std(each, axis=0, ddof=1))
    np.testing.assert_array_equal(band.of("knee_flexion"), [band.mean["knee_flexion"], band.sd["knee_flexion"]])
    assert (band.people, band.of("no_such_angle")) == (3, None)


def test_a_band_is_read_back(people, tmp_path):
    band = band_of(people, "drei Leute – <b>")
    band.save(tmp_path / "group.json")
    again = load_band(tmp_path / "group.json")
    assert (again.people, again.who, again.mean.keys()) == (band.people, band.who, band.mean.keys())
    for name in band.mean:
        np.testing.assert_allclose(again.mean[name], band.mean[name], atol=0.005001)
        np.testing.assert_allclose(again.sd[name], band.sd[name], atol=0.005001)
    assert again.scores.keys() == band.scores.keys() != set()
    for key, values in band.scores.items():
        np.testing.assert_allclose(again.scores[key], values, atol=0.005001)
    assert [p.name for p in tmp_path.iterdir()] == ["group.json"]


def test_two_people_are_no_group(people):
    with pytest.raises(MotionError, match="at least 3 people with strides, got 2"):
        band_of({"a": people["a"], "b": people["b"]}, "two")


@pytest.mark.parametrize(
    "text", ["", "[]", "{}", '{"format": "motionenv gait band", "people": 3, "who": "", "mean": {"x": [1]}, "sd": {}}']
)
def test_other_files_are_refused(text, tmp_path):
    path = tmp_path / "band.json"
    path.write_text(text)
    with pytest.raises(FormatError, match="isn't a band"):
        load_band(path)
    with pytest.raises(FormatError, match="can't be read"):
        load_band(tmp_path / "missing.json")


def test_the_shipped_band_is_of_people_who_walk():
    band = shipped_band()
    assert band.people >= 10
    assert str(band.people) in band.who or "people" in band.who
    knee, hip = band.mean["knee_flexion"], band.mean["hip_flexion"]
    assert 50 < knee.max() < 75
    assert 65 < knee.argmax() < 80
    assert hip[:10].mean() > 15 > -5 > hip.min() - 20
    for name, mean in band.mean.items():
        assert abs(mean[0] - mean[-1]) < 3, name
        assert (band.sd[name] > 0).all()


@pytest.mark.slow
def test_the_shipped_band_is_what_the_command_makes(mocap):
    """python -m benchmarks.mocap.band: the same curves, but for rounding."""
    band, shipped = made(mocap), shipped_band()
    assert (shipped.people, shipped.who) == (band.people, band.who)
    assert shipped.mean.keys() == band.mean.keys()
    for name in band.mean:
        np.testing.assert_allclose(shipped.mean[name], band.mean[name], atol=0.02)
        np.testing.assert_allclose(shipped.sd[name], band.sd[name], atol=0.02)
    for key, values in band.scores.items():
        np.testing.assert_allclose(shipped.scores[key], values, atol=0.02)
