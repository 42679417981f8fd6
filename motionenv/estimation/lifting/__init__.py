"""3D walking from 2D points of one camera: paper B's reconstruction (Zhang & Troje 2006), and beyond it.

    >>> from motionenv.estimation.lifting import lift
    >>> lifted = lift(read_points("points.csv"))
    >>> lifted.refined.alpha, lifted.markers(), lifted.band, lifted.motion()

`known` holds the paper's closed forms for a known view, `unknown` finds the view too. Both work on Fourier series,
which `series` makes of raw points. `refine` explains the raw points themselves, with all that may be unknown.
"""

from motionenv.estimation.lifting.known import Reconstruction, least_squares, maximum_a_posteriori
from motionenv.estimation.lifting.lifter import UNLIKE, Lifted, OtherView, lift
from motionenv.estimation.lifting.projecting import project_markers
from motionenv.estimation.lifting.refined import Refined
from motionenv.estimation.lifting.refining import Start, refine
from motionenv.estimation.lifting.series import Series, fourier_points
from motionenv.estimation.lifting.unknown import Views, find_view

__all__ = [
    "UNLIKE",
    "Lifted",
    "OtherView",
    "Reconstruction",
    "Refined",
    "Series",
    "Start",
    "Views",
    "find_view",
    "fourier_points",
    "least_squares",
    "lift",
    "maximum_a_posteriori",
    "project_markers",
    "refine",
]
