"""motionenv/ActiveTracking-v0: where everybody is, seen by a camera that the agent turns."""

from typing import Any

from gymnasium.vector import AutoresetMode

from motionenv._core.validation import checked_whole
from motionenv.envs.active.world import ActiveWorld, Scene
from motionenv.envs.base import TrackingEnv, with_horizon
from motionenv.envs.vector import TrackingVectorEnv


class ActiveTracking(TrackingEnv):
    """Keeping track of several people with one camera, which the agent turns.

    ## Description
    People walk about on a round square, 13 m in radius, among pillars; they start anywhere, turn at random, and before
    what is in their way. A camera on a mast of 4.5 m in the middle pans, tilts and zooms, with inertia. It sees a sixth
    of the square at most, nobody behind a pillar, and the more precisely the more it zooms in. The agent says where
    everybody is, and moves the camera: looking at one person is not looking at another, turning takes time, and whoever
    isn't seen walks on. Unlike in the other environments actions change what is seen, so use a discount above 0: what a
    command is worth shows some seconds later (γ = 0.97 or more at 10 frames per second).

    Positions are in metres, x and y on the ground, z up, the mast at x = y = 0.

    ## Action Space
    `Box(-1, 1, (3 + 3 people,), float32)`: commands to the motors of pan (from x to y), tilt (up) and zoom, as shares
    of their highest rates; then for each person on the roster the believed x and y, in units of 15 m, and the scale s
    of the belief, which stands for a standard deviation of 0.05 m · 200^((s + 1) / 2) per coordinate. `action` turns
    commands, and x, y and standard deviation [m] of each person, into an action, `estimate` back. The belief is about
    the last observed frame; the commands act until the next one.

    ## Observation Space
    `Dict`: "points", `Box(-2, 2, (people, 15, 2), float32)`, "seen", `MultiBinary((people, 15))`, and "colours",
    `Box(-1, 1, (people, 2), float32)`: the detections from left to right, without names: joints in the order of
    `motionenv.types.MARKERS`, right and down from the image's centre in units of half its width, which of them are
    seen (others are 0), and cosine and sine of the hue of the clothes; rows of 0 follow. "camera", `Box((6,))`: pan,
    tilt [rad], zoom from 0 (60° wide) to 1 (13°), and their rates per second. "roster", `Box((people, 3))`: body height
    [m], cosine and sine of everybody's true hue. "pillars", `Box((pillars, 3))`: x, y and radius [m]. "time_left": from
    1 to 0. At least 8 of a person's 15 joints must be in view.

    ## Rewards
    Minus the energy score [m] of the beliefs, a proper score, averaged over people, minus `effort` times the mean
    square of the commands. The score is between 0 and 35 m, so that no single error decides.

    ## Starting State
    People, paths, pillars and pan are random; nothing is known about where anybody is.

    ## Episode End
    Truncated after `horizon` estimates; never terminated, so that giving up can't pay.

    ## Arguments
    - `people=4`, `pillars=8`: how many, at most 8 and 24.
    - `noise=0.05`: standard deviation of the coordinates of points, in units of half the image's width.
    - `colour_noise=0.2`: standard deviation of hues [rad] in the widest view; zoomed in, it is down to a fifth.
    - `dropout=0.1`: chance that a visible person isn't detected in a frame.
    - `turn_seconds=6`: mean time between a person's turns.
    - `effort=0.05`: cost of the motors at full rates.
    - `fps=10`, `horizon=200`: frame rate, and number of estimates in an episode.
    - `split="train"`: or "eval", which has other walkers.
    - `render_mode=None`: "rgb_array": the square from above, with beliefs as rings of two standard deviations, beside
      what the camera sees; or "human", the same in a window.

    `truth()` returns "positions" (people, 2), "joints" (people, 15, 3) and "camera" of the last observed frame;
    `info["error"]` is the mean distance [m] of believed positions.

    ## Vectorized environment
    `gymnasium.make_vec("motionenv/ActiveTracking-v0", num_envs=64)` steps all squares in compiled loops; it also
    accepts `autoreset_mode` ("NextStep", "SameStep", "Disabled").

    ## Version History
    - v0: initial version.

    Args:
        render_mode: None, "rgb_array" or "human".
        arguments: see Arguments.
    """

    world: ActiveWorld

    def __init__(self, *, render_mode: str | None = None, **arguments: Any) -> None:
        super().__init__(ActiveWorld(1, Scene(**arguments)), render_mode=render_mode)


class ActiveTrackingVector(TrackingVectorEnv):
    """`num_envs` copies of `ActiveTracking` with its `arguments`, stepped together.

    `autoreset_mode`, `batch_size` and `render_mode` are as in `SimulatedTrackingVector`.
    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        batch_size: int | None = None,
        render_mode: str | None = None,
        **arguments: Any,
    ) -> None:
        world = ActiveWorld(checked_whole(num_envs, "num_envs", 1), Scene(**with_horizon(arguments)))
        super().__init__(world, render_mode=render_mode, autoreset_mode=autoreset_mode, batch_size=batch_size)
