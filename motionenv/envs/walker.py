"""motionenv/WalkerTracking-v1: the pose of a walking person in images."""

from dataclasses import dataclass

from motionenv._core.precompilation import precompile
from motionenv.envs.base import SimulatedTracking, taking
from motionenv.envs.simulation.motion_sources import Source
from motionenv.envs.simulation.picture_world import PictureArguments, PictureWorld
from motionenv.envs.simulation.views import WalkingView
from motionenv.envs.vector import SimulatedTrackingVector, VectorArguments


@dataclass(frozen=True, kw_only=True)
class WalkerArguments(PictureArguments):
    """Arguments of `WalkerTracking`."""

    motion: str = "walk/fpca"
    start: str = "near"
    path: str = "straight"

    def world(self, n: int) -> PictureWorld:
        precompile("env")
        return super().world(n)

    def view(self, source: Source) -> WalkingView:
        seconds = (source.frames - 1) / source.fps
        return WalkingView(self.camera, source.fps, seconds, self.start, self.path)


@dataclass(frozen=True, kw_only=True)
class WalkerVectorArguments(WalkerArguments, VectorArguments):
    """Arguments of `WalkerTrackingVector`."""

    threads: int | None = None


class WalkerTracking(SimulatedTracking):
    """Tracking the pose of a walking person in images.

    ## Description
    A person walks. Each step shows the next image, and the agent estimates the person's pose. Body, clothes, gait and
    path differ between episodes; so do view, scenery, noise and light, if these are enabled.

    Positions are in metres, z up, the ground at z = 0. Seen from the side, x points to the right of the image and y
    away from the camera. A static camera is level, 1.1 m high, and aimed at the origin from a distance of 3.5 m plus
    1.5 m per second of an episode (with `start="line"`, as near as the path allows); it shows the walker's whole path.
    A following camera moves beside the walker, and the origin, the ground point at which it is aimed, moves with it.
    The walker's absolute position, which no image shows, is then not part of the task.

    Actions don't change what is seen. This is an estimation problem, for which a discount of γ = 0 is right.

    ## Action Space
    An estimate for the last observed frame, in the form given by `estimate`:

    - "pose": `Box(-1, 1, (25,), float32)`, the pose vector of `motionenv.types.POSE`. It is applied to the true body,
      so body size is not part of the task.
    - "joints": `Box(-1, 1, (15, 3), float32)`, positions in the order of `motionenv.types.MARKERS`.
    - "belief": `Box(-1, 1, (n_belief, 26), float32)`, poses, each followed by its log weight up to a constant.

    An entry a stands for x or y = reach · a, z = 1 m + 2 m · a, an angle of π · a, or a log weight of 10 · a. The reach
    is 2 m; a static camera adds 1.5 m per second of an episode and the range of distances that `start` allows, which
    makes 8.5 m by default. `action` converts an estimate [m, rad] to an action, and `estimate` converts back. With
    `actions="metric"` the action is the estimate itself: positions within ±100 m, angles within ±4π, log weights within
    ±100.

    ## Observation Space
    In the form given by `observation`:

    - "rgb": `Box(0, 255, (size, size, 3), uint8)`.
    - "mask": `Box(0, 255, (size, size, 1), uint8)`, 255 where the body is visible.
    - "depth": `Box(0, 20, (size, size, 1), float32)` [m] along the camera's axis, 20 where nothing is nearer.
    - "joints": `Box(-100, 100, (15, 3), float32)`, the true joints [m], which make the task fully observable.

    A sequence of these gives a `Dict` of them. In gaps of the camera, "rgb" and "mask" are 0 and "depth" is 20.

    ## Rewards
    Minus the mean distance [m] between the estimated and true positions of the 15 joints. For a belief, minus its
    energy score over all joints (`motionenv.metrics.energy_score`), a proper score, divided by √15, which makes it
    comparable with a distance per joint. `info["error"]` is the mean distance; for a belief, that of its mean.

    ## Starting State
    Walker, phase, body height, place, direction, colours, view and scenery are random.

    ## Episode End
    Truncated after `horizon` estimates. Never terminated, so an agent that loses the track pays for every frame.

    ## Arguments
    - `motion="walk/fpca"`: source of motion: a model ("walk/fpca", "walk/eigenwalkers", "mixed/tree", or a model file),
      a motion file, or a folder of capture files (.amc, .bvh, .c3d, .trc, .npz). `file_fps` and `unit` are for files
      that don't state them.
    - `motion_seed=None`: with a number, every episode of either split shows the motion of `motionenv.synthesize(motion,
      (horizon + 1) / fps, fps, seed=motion_seed)` from its first frame, turned and placed by `start`. The service, the
      web page and `motionenv synth` make the same walk from that seed. `speed` and `height`, if given, must then be
      ranges of one value, such as (1.3, 1.3).
    - `split="train"`: or "eval", which has other walkers; with a folder, other people, about one in four, selected by a
      hash of their label. A single file is one person, who is in both splits.
    - `size=64`: side of the image, 36 to 256 pixels.
    - `observation="rgb"`: "rgb", "mask", "depth", "joints", or a sequence of several.
    - `start="near"`: people walk within 30° of the x axis, either way, up to 2 m farther from the camera than needed to
      show their whole path, and anywhere across the image. "anywhere": in all directions, up to 4 m farther. "line":
      along x through the origin, in the middle of the image, with the camera as near as the whole path allows. With
      `camera="follow"` only the directions differ.
    - `path="straight"`: or "turning", a random path from `motionenv.models.paths` with curves of at least 1.5 m radius.
    - `camera="side"`: "side", "front", a view angle in degrees, "random" (any view angle, which only the camera of
      `observation_model` reveals), or "follow" (moves along). A static camera shows the whole path, so in long episodes
      the walker is small, and "depth" misses a body beyond 20 m; use "follow" for these.
    - `background="plain"`: or "clutter", or a folder of photographs.
    - `distractors=0`, `occluders=0`: numbers of passing people and objects, and of occluding objects.
    - `alone=0`: seconds after which distractors come into a static camera's view, before twice as many; 0 for any time.
    - `noise=0`, `brightness=0`: standard deviation of the noise in grey levels of 255, and relative variation of the
      light. Both affect "rgb" only; "mask" and "depth" are exact.
    - `gaps=0`, `gap_seconds=0.3`: fraction of the time that the camera shows nothing, and the mean duration of such a
      gap [s].
    - `fps=30`, `horizon=90`: frame rate [Hz], and number of estimates in an episode.
    - `speed=None`, `height=None`: ranges (low, high) of walking speed [m/s] and body height [m]. None is people's own.
    - `person="adult"`: whom a model draws: "adult", "woman", "man", "child" (6 to 17 years), "girl" or "boy".
    - `clothes=True`: whether colours differ between episodes.
    - `estimate="pose"`, `n_belief=64`, `actions="normalised"`: see Action Space.
    - `lost_after=None`: with a number, `info["lost"]` is true from the tenth consecutive estimate that is off by more
      than that many metres, until one is not. Rewards and episode length don't change.
    - `render_mode=None`: "rgb_array", the last estimated frame with the estimate overlaid, at least 256 pixels wide.

    `truth()` returns "pose" (25,), "joints" (15, 3), "camera" and "skeleton" for the last observed frame.
    `observation_model` evaluates hypotheses against that frame without access to the ground truth. If only "rgb" is
    observed, it learns the background from the frames in which it is accessed, so access it in every frame.

    ## Vectorized environment
    `gymnasium.make_vec("motionenv/WalkerTracking-v1", num_envs=64)` renders all images of a step in one batch. It also
    accepts `autoreset_mode` ("NextStep", "SameStep", "Disabled") and `threads`, None for one per core.

    ## Version History
    - v1: people walk anywhere, actions are normalised, and losing the track doesn't end the episode.
    - v0: initial version.
    """

    @taking(WalkerArguments)
    def __init__(self, arguments: WalkerArguments) -> None:
        super().__init__(arguments)


class WalkerTrackingVector(SimulatedTrackingVector):
    """`num_envs` copies of `WalkerTracking` in an `autoreset_mode`, rendered in batches by `threads` threads."""

    @taking(WalkerVectorArguments)
    def __init__(self, arguments: WalkerVectorArguments) -> None:
        super().__init__(arguments)
