"""One session that the tests of the report share: a real walk of a person with an awkward name."""

from dataclasses import replace

import pytest

from motionenv.gait import Session, read_trial, shipped_band


@pytest.fixture(scope="session")
def session(mocap) -> Session:
    """A walk with gaps, a standing trial, and a file that was left out."""
    folder = mocap / "btkdata/C3DSamples/PiG"
    walk, standing = (read_trial(folder / f"PiG_{name}.c3d") for name in ("Motion-FlatFoot-Hole", "Calibration3_FF"))
    walk = replace(walk, person="<b>Ann & “Bo”</b>", name="<script>alert(1)</script>")
    return Session((walk, standing), {"<i>.c3d": "is <empty> & broken"}, shipped_band())
