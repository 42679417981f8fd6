"""Forces and centres of pressure: at known places, and below feet; `test_reader.py` compares with ezc3d."""

import ezc3d
import numpy as np
import pytest

from motionenv.mocap.readers import c3d


def test_a_foot_is_where_the_plate_feels_it(mocap):
    """In mid-stance the centre of pressure is below the foot that is on the plate, and the plate carries the weight."""
    got = c3d.read(mocap / "btkdata" / "C3DSamples" / "PiG" / "PiG_Motion3_FF.c3d")
    heels = got.positions[:, [got.index("LHEE"), got.index("RHEE")]]
    for plate in got.recording.plates:
        loaded = np.flatnonzero(plate.force[:, 2] > 300)
        middle = loaded[len(loaded) // 2]
        heel = heels[round(middle / plate.fps * got.fps)]
        assert np.linalg.norm(heel[:, :2] - plate.centre[middle, :2], axis=-1).min() < 0.2
        assert abs(plate.centre[middle, 2]) < 0.01
        assert plate.force[middle, 2] > 400


def save_plate(folder, kind, rows, units, corners, origin):
    """A C3D file made by ezc3d, with one point and one force plate."""
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [100.0]
    file["parameters"]["POINT"]["LABELS"]["value"] = ["A"]
    file.add_parameter("POINT", "UNITS", ["mm"])
    file["data"]["points"] = np.ones((4, 1, len(rows)))
    file["parameters"]["ANALOG"]["RATE"]["value"] = [100.0]
    file["parameters"]["ANALOG"]["LABELS"]["value"] = list("abcdef")
    file["parameters"]["ANALOG"]["UNITS"]["value"] = units
    file["data"]["analogs"] = np.array(rows).T[None]
    told = {
        "USED": [1], "TYPE": [kind], "CHANNEL": np.arange(1.0, 7)[:, None], "CORNERS": corners.T[..., None],
        "ORIGIN": np.array(origin)[:, None], "ZERO": [1, 0],
    }  # fmt: skip
    for name, value in told.items():
        file.add_parameter("FORCE_PLATFORM", name, value)
    path = folder / "plate.c3d"
    file.write(str(path))
    return path


@pytest.mark.parametrize("sign", [1, -1], ids=["of the ground", "on the plate"])
@pytest.mark.parametrize("kind", [1, 2])
def test_a_force_at_a_known_place_on_a_plate_in_the_floor(tmp_path, kind, sign):
    """A plate of 0.6 m x 0.4 m, whose transducer is 40 mm below; z of its frame is down."""
    force = np.array([15.0, -20.0, 700.0])  # world, on the foot
    at = np.array([[0.30, 0.15, 0.0], [0.40, 0.25, 0.0], [0.45, 0.30, 0.0]])  # world
    middle, axes = np.array([0.4, 0.3, 0.0]), np.diag([1.0, -1.0, -1.0])
    stored = sign * axes @ force
    places = (at - middle) @ axes  # the plate's frame
    arms = np.add(places, [0, 0, -0.04])  # from the transducer
    third = np.cross(arms, stored) * 1000 if kind == 2 else places * 1000
    rows = [[*stored, *values] for values in third]
    corners = np.array([[700.0, 100, 0], [100, 100, 0], [100, 500, 0], [700, 500, 0]])  # +x+y, -x+y, -x-y, +x-y
    units = ["N"] * 3 + (["Nmm"] * 3 if kind == 2 else ["mm", "mm", "Nmm"])
    (plate,) = c3d.read(save_plate(tmp_path, kind, rows, units, corners, [0.0, 0.0, -40.0])).recording.plates
    np.testing.assert_allclose(plate.force, np.tile(force, (3, 1)), atol=1e-3)
    np.testing.assert_allclose(plate.centre, at, atol=1e-6)
    np.testing.assert_allclose(plate.corners, corners / 1000)
    assert plate.fps == 100
