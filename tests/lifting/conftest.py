"""The prior, and real walks as 2D points."""

import numpy as np
import pytest

from motionenv.lifting.view_geometry import project_markers
from motionenv.mocap import read, to_markers
from motionenv.models.eigenwalkers.extraction import steady_stretch
from motionenv.models.eigenwalkers.walker_prior import WalkerPrior
from motionenv.models.registry import load
from motionenv.types import Points

TRIALS = ("02/02_01", "07/07_08", "12/12_02", "35/35_10", "49/49_01")
VIEWS = np.radians([0, 30, 60, 90, 150])


@pytest.fixture(scope="package")
def prior() -> WalkerPrior:
    return load("walk/prior")


@pytest.fixture(scope="package")
def views(mocap) -> list[Points]:
    """Real walks at 30 frames per second, from five directions each."""
    out = []
    for trial in TRIALS:
        markers = to_markers(read(mocap / "cmu_asfamc" / f"{trial}.amc", fps=120))
        for alpha in VIEWS:
            points = project_markers(markers, alpha).positions[steady_stretch(markers)][::4]
            out.append(Points(points, 30, "m", name=f"{trial} at {alpha:.2f}"))
    return out
