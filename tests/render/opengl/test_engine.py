"""The pyrender engine in threads, forks, and where OpenGL is missing."""

import gc
import os
import pickle
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from motionenv.body import LIMBS, from_height
from motionenv.errors import MotionError
from motionenv.render import Scene
from motionenv.render.cameras import view
from motionenv.render.opengl.engine import PyrenderRenderer

SKELETON = from_height()
CAMERA = view(0.3, width=48, height=48)


@pytest.fixture
def renderer():
    renderer = PyrenderRenderer(Scene(shadows=False))
    yield renderer
    renderer.close()


@pytest.mark.usefixtures("opengl")
def test_calls_from_many_threads(renderer, walking):
    poses = walking(24)
    with ThreadPoolExecutor(6) as pool:
        frames = list(pool.map(lambda pose: renderer.render(pose, SKELETON, CAMERA), poses))
    together = renderer.render(poses, SKELETON, CAMERA)
    np.testing.assert_array_equal(np.stack([f.rgb for f in frames]), together.rgb)
    np.testing.assert_array_equal(np.stack([f.limbs for f in frames]), together.limbs)


@pytest.mark.usefixtures("opengl")
def test_renderers_go_without_taking_the_others_along(renderer, walking):
    pose = walking(1)[0]
    before = renderer.render(pose, SKELETON, CAMERA)
    other = PyrenderRenderer()
    other.render(pose, SKELETON, CAMERA)
    other.close()
    dropped = PyrenderRenderer()
    dropped.render(pose, SKELETON, CAMERA)
    del dropped
    gc.collect()
    np.testing.assert_array_equal(renderer.render(pose, SKELETON, CAMERA).rgb, before.rgb)
    assert other.render(pose, SKELETON, CAMERA).rgb.any()  # makes a new context
    other.close()


@pytest.mark.usefixtures("opengl")
def test_sizes_and_skeletons_may_change(renderer, walking):
    pose = walking(1)[0]
    first = renderer.render(pose, SKELETON, CAMERA)
    wide = renderer.render(pose, from_height(1.4), view(0.3, width=80, height=50))
    assert wide.rgb.shape == (50, 80, 3)
    np.testing.assert_array_equal(renderer.render(pose, SKELETON, CAMERA).rgb, first.rgb)


@pytest.mark.usefixtures("opengl")
def test_without_colour_and_empty(renderer, walking):
    pose = walking(1)
    assert renderer.render(pose, SKELETON, CAMERA, rgb=False).rgb is None
    assert renderer.render(pose[:0], SKELETON, CAMERA).rgb.shape == (0, 48, 48, 3)


@pytest.mark.usefixtures("opengl")
def test_pickle_carries_the_scene(renderer, walking):
    renderer.render(walking(1), SKELETON, CAMERA)
    assert pickle.loads(pickle.dumps(renderer)).scene == renderer.scene


@pytest.mark.usefixtures("opengl")
def test_bad_poses_are_refused_before_opengl(renderer):
    with pytest.raises(MotionError, match="finite"):
        renderer.render(np.full(25, np.inf), SKELETON, CAMERA)


FORK = """
import os, sys
from motionenv.body import from_height
from motionenv.errors import EngineError
from motionenv.render.cameras import view
from motionenv.render.opengl.engine import PyrenderRenderer
import numpy as np
renderer = PyrenderRenderer()
draw = lambda: renderer.render(np.zeros(25), from_height(), view(0.0, width=32, height=32))
if sys.argv[1] == "after":
    draw()
child = os.fork()
if child == 0:
    try:
        draw()
    except EngineError as error:
        os._exit(3 if "spawn" in str(error) else 4)
    os._exit(5)
os._exit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""


@pytest.mark.usefixtures("opengl")
@pytest.mark.parametrize(("when", "code"), [("before", 5), ("after", 3)])
def test_fork(when, code):
    """Made before the fork and first used in the child: works. Used before: an error instead of a hang."""
    run = subprocess.run([sys.executable, "-c", FORK, when], timeout=120, capture_output=True, text=True)
    assert run.returncode == code, run.stderr


MISSING = """
import ctypes, os, sys
real = ctypes.CDLL.__init__
def hidden(self, name, *rest, **more):
    if name and any(lib in str(name) for lib in ("EGL", "libGL")):
        raise OSError(f"{name}: cannot open shared object file: No such file or directory")
    real(self, name, *rest, **more)
ctypes.CDLL.__init__ = hidden
import numpy as np
from motionenv.body import from_height
from motionenv.render import render
from motionenv.render.cameras import view
call = lambda engine: render(np.zeros(25), from_height(), view(0.0, width=16, height=16), engine=engine)
assert call("raycast").rgb.any()
try:
    call("pyrender")
except Exception as error:
    print(type(error).__name__, error)
"""


@pytest.mark.parametrize("platform", ["", "egl"])
def test_without_graphics_libraries_the_error_says_what_to_install(platform):
    environment = {k: v for k, v in os.environ.items() if k != "PYOPENGL_PLATFORM"}
    environment |= {"PYOPENGL_PLATFORM": platform} if platform else {}
    run = subprocess.run([sys.executable, "-c", MISSING], timeout=120, capture_output=True, text=True, env=environment)
    assert run.returncode == 0, run.stderr
    assert run.stdout.startswith("EngineError")
    assert "apt-get install --no-install-recommends libegl1 libgl1" in run.stdout
    assert "raycast" in run.stdout


@pytest.mark.usefixtures("opengl")
def test_unknown_limbs_are_not_drawn_and_come_back(walking):
    """In neither ids nor colours nor shadows: a body of which nothing is known leaves an empty scene."""
    renderer = PyrenderRenderer(Scene())
    poses = walking(3).copy()
    poses[:, :2] = 0
    whole = renderer.render(poses[2], SKELETON, CAMERA)
    poses[0, 6:17], poses[1] = np.nan, np.nan
    lower, nothing, again = (renderer.render(pose, SKELETON, CAMERA) for pose in poses)
    shown = {LIMBS[i - 1] for i in np.unique(lower.limbs) if i}
    assert "left_thigh" in shown
    assert not shown & {"head", "neck", "left_trunk", "left_shoulder", "left_hand", "right_forearm"}
    assert not nothing.limbs.any()
    np.testing.assert_array_equal(again.limbs, whole.limbs)
    np.testing.assert_array_equal(again.rgb, whole.rgb)
    away = np.zeros(25)
    away[0] = 200.0
    np.testing.assert_array_equal(nothing.rgb, renderer.render(away, SKELETON, CAMERA).rgb)
    blue = lambda frame: (frame.rgb[..., 2] > 1.5 * frame.rgb[..., 0]).sum()
    assert blue(whole) > 20
    assert blue(lower) == 0
    renderer.close()
