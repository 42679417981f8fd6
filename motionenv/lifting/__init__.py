"""Lift 2D points of one camera to 3D: people who walk, turn or run.

    >>> import motionenv
    >>> from motionenv.lifting import lift, project_markers
    >>> from motionenv.types import MARKERS, Markers
    >>> walk = motionenv.synthesize("walk/fpca", seconds=3, fps=30, seed=7)
    >>> seen = project_markers(Markers(MARKERS, motionenv.markers(walk.poses, walk.skeleton), 30), alpha=0.5)
    >>> lifted = lift(seen)                           # or lift(motionenv.read_points("keypoints.json", fps=30))
    >>> lifted.positions.shape, lifted.band.shape, lifted.heading.shape, lifted.motion().poses.shape
    ((90, 15, 3), (90, 15, 3), (90,), (90, 25))

`lift` runs the whole pipeline, and `free` fits all frames. `camera_motion` finds how a film's camera turns. The
estimators of Zhang & Troje 2007 ("paper B"), for straight, steady walks seen from afar, are in `views.known_view` and
`views.unknown_view`; they work on a 2D Fourier series, which `fourier_fit` fits to the points.
"""

from motionenv.lifting.fourier_fit import Series, fourier_points
from motionenv.lifting.free.lifter import FreeFit, OtherMotion, fit_freely
from motionenv.lifting.gait import Cut, GaitEvent, LiftedGait, gait_of
from motionenv.lifting.pipeline import BAND, Lifted, lift
from motionenv.lifting.report import gait_figures, gait_page, write_angles, write_gait
from motionenv.lifting.turning_camera import CameraMotion, camera_motion
from motionenv.lifting.view_geometry import project_markers
from motionenv.lifting.views.known_view import Reconstruction, least_squares, maximum_a_posteriori
from motionenv.lifting.views.unknown_view import Views, find_view

__all__ = [
    "BAND", "CameraMotion", "Cut", "FreeFit", "GaitEvent", "Lifted", "LiftedGait", "OtherMotion", "Reconstruction",
    "Series", "Views", "camera_motion", "find_view", "fit_freely", "fourier_points", "gait_figures", "gait_of",
    "gait_page", "least_squares", "lift", "maximum_a_posteriori", "project_markers", "write_angles", "write_gait",
]  # fmt: skip
