"""motionenv/MarkerTracking-v0: 15 markers in 2D, noisy and with gaps, from an unknown view; the estimate is 3D."""

from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from motionenv.envs.base import TrackingEnv
from motionenv.envs.marker_world import MarkerWorld
from motionenv.envs.sources import Source, episode_frames
from motionenv.envs.vector import TrackingVectorEnv
from motionenv.errors import MotionError
from motionenv.estimation import MarkerModel
from motionenv.render.marker_sensor import MarkerSensor


class MarkerTracking(TrackingEnv):
    """Tracking a walker in 3D from its markers in 2D, the view unknown.

    ## Description
    The setting of Zhang & Troje (2006, section 4.3) as a filter: 15 markers of somebody who walks in place, as on a
    treadmill, are seen by a camera that stands still, while the direction of walking is unknown. Each frame gives what
    a tracker of points gives: 2D positions with noise, some missing. The agent says where the markers are in 3D.

    The world is fixed to the camera: x to the right in the picture, y away from the camera, z up, the origin on the
    ground where the walker is on average. Walking along direction (cos α, -sin α), the walker shows the paper's view
    angle α: 0 from the side, walking to the right; 90° from the front. So x and z are seen, and what has to be inferred
    is y: depth about the walker's own place, which left and right, the bends of the joints and their motion tell.

    ## Action Space
    `Box(-100, 100, (15, 3), float32)`: the estimated positions [m] of the markers in the order of
    `motionenv.types.MARKERS`.

    ## Observation Space
    `Dict`: "points", `Box(-100, 100, (15, 2), float32)`, how far to the right and how high [m] each marker is seen,
    0 if it isn't; "seen", `MultiBinary(15)`, whether it is. With `distance`, points are where the ray from the camera
    meets the plane y = 0, so that nearer markers are farther apart.

    ## Rewards
    Minus the mean distance [m] between estimated and true markers.

    ## Starting State
    Walker, phase, view angle, and what is missing are drawn at random.

    ## Episode End
    Truncated after `horizon` estimates; terminated, if `lost_after` is given, when that many metres of error are
    exceeded ten times on end.

    ## Arguments
    - `motion="walk/eigenwalkers"`: whose Fourier walkers are evaluated as they are, 4,096 of them per split; or any
      other that `motionenv/WalkerTracking-v0` takes, less its way along a straight line. `file_fps` and `unit` are for
      files that don't say.
    - `split="train"`: or "eval": other walkers; of a folder other people.
    - `view=None`: view angle α [degrees], or (low, high); None is the full circle.
    - `distance=None`: of the camera [m], from 2 on; None is orthographic, as in the paper.
    - `noise=0.01`: standard deviation [m] of each coordinate.
    - `dropout=0.05`: share of markers that are missing, by chance in each frame.
    - `gaps=0.1`: share of the time for which a marker is missing in one piece, of `gap_seconds=0.3` on average.
    - `fps=30`, `horizon=200`: frames per second, and estimates in an episode.
    - `speed=None`, `height=None`: (low, high) of walking speed [m/s] and body height [m]; None leaves them to the
      motion.
    - `lost_after=None`: see Episode End.
    - `render_mode=None`: "rgb_array", the points that were estimated last with the estimate over them; or "human", the
      same in a window.

    `truth()` gives "joints" (15, 3) [m], "alpha" [rad], and "camera", that of `render`'s pictures, for the frame
    observed last. Fourier walkers have no pose and no skeleton. `observation_model` scores hypotheses, poses in this
    world, against that frame without knowing the truth.

    ## Vectorized environment
    `gymnasium.make_vec("motionenv/MarkerTracking-v0", num_envs=1024)` steps all in compiled loops; it takes
    `autoreset_mode` ("NextStep", "SameStep", "Disabled") too.

    ## Version History
    - v0: initial version.

    Args:
        render_mode: None, "rgb_array" or "human".
        lost_after: error [m] beyond which the track counts as lost; None for never.
        arguments: see Arguments.
    """

    world: MarkerWorld

    def __init__(self, *, render_mode: str | None = None, lost_after: float | None = None, **arguments: Any):
        super().__init__(marker_world(1, **arguments), render_mode=render_mode, lost_after=lost_after)

    @property
    def observation_model(self) -> MarkerModel:
        """Scores thousands of poses against the frame observed last, without the truth."""
        self.check_begun("observation")
        return self.world.observation_model(0)


class MarkerTrackingVector(TrackingVectorEnv):
    """`num_envs` times `MarkerTracking`, stepped together.

    Args:
        num_envs: how many.
        autoreset_mode: NEXT_STEP, SAME_STEP or DISABLED, as `gymnasium.vector.AutoresetMode` or its value.
        render_mode: None or "rgb_array".
        lost_after: as in `MarkerTracking`.
        arguments: as in `MarkerTracking`.
    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        render_mode: str | None = None,
        lost_after: float | None = None,
        **arguments: Any,
    ):
        if isinstance(num_envs, bool) or not isinstance(num_envs, int) or num_envs < 1:
            raise MotionError(f"num_envs must be a whole number from 1, got {num_envs!r}")
        super().__init__(
            marker_world(num_envs, **arguments),
            render_mode=render_mode,
            lost_after=lost_after,
            autoreset_mode=autoreset_mode,
        )


def marker_world(
    n: int,
    *,
    motion: str = "walk/eigenwalkers",
    split: str = "train",
    view: float | tuple[float, float] | None = None,
    distance: float | None = None,
    noise: float = 0.01,
    dropout: float = 0.05,
    gaps: float = 0.1,
    gap_seconds: float = 0.3,
    fps: float = 30.0,
    horizon: int = 200,
    speed: tuple[float, float] | None = None,
    height: tuple[float, float] | None = None,
    file_fps: float | None = None,
    unit: str | None = None,
) -> MarkerWorld:
    """Walkers in place, before a camera each.

    Args:
        n: how many.
        motion, split, view, distance, noise, dropout, gaps, gap_seconds, fps, horizon: see `MarkerTracking`.
        speed, height, file_fps, unit: see `MarkerTracking`.

    Raises:
        MotionError: an impossible argument; names it.
    """
    source = Source(motion, split, episode_frames(horizon), fps, speed, height, file_fps, unit)
    return MarkerWorld(n, source, MarkerSensor(noise, dropout, gaps, gap_seconds, distance, source.fps), _radians(view))


def _radians(view) -> tuple[float, float]:
    """Least and greatest view angle [rad].

    Raises:
        MotionError: not an angle or two in order, within ±360 degrees.
    """
    if view is None:
        return -np.pi, np.pi
    try:
        low, high = map(float, (view, view) if np.ndim(view) == 0 and not isinstance(view, bool) else view)
    except (TypeError, ValueError):
        low = high = np.nan
    if not -360 <= low <= high <= 360:
        raise MotionError(f"view must be an angle in degrees, or the least and the greatest, got {view!r}")
    return float(np.radians(low)), float(np.radians(high))
