"""The front door: the suffix picks the writer, bad input is refused before anything is written."""

import hashlib
import os
import subprocess
import sys

import numpy as np
import pytest

from motionenv.errors import GapError, MotionError
from motionenv.mocap import encode, read, write, write_markers
from motionenv.models.synthesis import synthesize
from motionenv.types import MARKERS, Event, Markers, Motion

SUFFIXES = (".bvh", ".c3d", ".csv", ".glb", ".mot", ".npz", ".trc")
HASHES = """
import hashlib, sys
import numpy as np
from pathlib import Path
from motionenv.body import from_height
from motionenv.mocap import encode, write
from motionenv.types import Motion
motion = Motion(np.random.default_rng(1).normal(size=(50, 25)), from_height(), 100.0, "a")
for suffix in sys.argv[2:]:
    path = Path(sys.argv[1], "a" + suffix)
    write(motion, path)
    print(hashlib.sha256(path.read_bytes()).hexdigest())
"""
FULL_DISK = """
import resource, sys
import numpy as np
from pathlib import Path
from motionenv.body import from_height, markers
from motionenv.errors import MotionError
from motionenv.mocap import encode, write
from motionenv.types import Motion
motion = Motion(np.random.default_rng(1).normal(size=(500, 25)), from_height(), 100.0)
markers(motion.poses, motion.skeleton)  # compiled, so that nothing but our file is written from here on
resource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000))
for suffix in sys.argv[2:]:
    for name in ("old", "new"):
        try:
            write(motion, Path(sys.argv[1], name + suffix))
        except MotionError as error:
            print(error)
"""


def run(script, *arguments, **environment) -> list[str]:
    command = [sys.executable, "-W", "error", "-c", script, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, **environment})
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout.splitlines()


@pytest.mark.parametrize("suffix", [*SUFFIXES, ".GLB"])
def test_writes_by_suffix_and_leaves_nothing_else(suffix, any_motion, tmp_path):
    write(any_motion(1), tmp_path / f"a{suffix}")
    assert [p.name for p in tmp_path.iterdir()] == [f"a{suffix}"]
    assert (tmp_path / f"a{suffix}").stat().st_size > 1000


def test_same_motion_same_bytes_in_every_process(tmp_path):
    seeds = "0", "77"
    first, second = (run(HASHES, tmp_path, *SUFFIXES, PYTHONHASHSEED=seed) for seed in seeds)
    assert len(set(first)) == len(SUFFIXES)
    assert first == second


def test_a_full_disk_leaves_no_half_written_file_and_the_old_one_as_it_was(tmp_path):
    for suffix in SUFFIXES:
        (tmp_path / f"old{suffix}").write_text("as it was")
    said = run(FULL_DISK, tmp_path, *SUFFIXES)
    assert len(said) == 2 * len(SUFFIXES)
    assert all(line.startswith("can't write") and line.endswith("nothing was left half-written") for line in said)
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted(f"old{suffix}" for suffix in SUFFIXES)
    assert {p.read_text() for p in tmp_path.iterdir()} == {"as it was"}


def test_unknown_suffix_lists_what_can_be_written(any_motion, tmp_path):
    for name in ("a.fbx", "a", "glb"):
        with pytest.raises(MotionError, match=r"supported are \.bvh, \.c3d, \.csv, \.glb, \.mot, \.npz, \.trc$"):
            write(any_motion(1), tmp_path / name)


def test_markers_are_no_motion(tmp_path):
    with pytest.raises(MotionError, match="got Markers; retarget"):
        write(Markers(MARKERS, np.zeros((2, 15, 3)), 100.0), tmp_path / "a.bvh")


@pytest.mark.parametrize("suffix", [suffix for suffix in SUFFIXES if suffix != ".npz"])
class TestRefuses:
    """What a file of one sequence can't hold."""

    def refused(self, poses, skeleton, suffix, folder) -> str:
        with pytest.raises(MotionError) as error:
            write(Motion(poses, skeleton, 100.0), folder / f"a{suffix}")
        assert not list(folder.iterdir())
        return str(error.value)

    @pytest.mark.parametrize("shape", [(0, 25), (2, 5, 25)])
    def test_batches_and_no_frames(self, shape, suffix, any_motion, tmp_path):
        said = self.refused(np.zeros(shape), any_motion(1).skeleton, suffix, tmp_path)
        assert str(shape) in said

    def test_infinite_values(self, suffix, any_motion, tmp_path):
        motion = any_motion(1)
        poses = motion.poses.copy()
        poses[2, 7] = -np.inf
        assert "neck_bend of frame 2 is -inf" in self.refused(poses, motion.skeleton, suffix, tmp_path)

    def test_a_folder_that_is_not_there(self, suffix, any_motion, tmp_path):
        with pytest.raises(MotionError, match="choose a folder that exists"):
            write(any_motion(1), tmp_path / "nowhere" / f"a{suffix}")


@pytest.mark.parametrize("suffix", [".bvh", ".glb", ".mot"])
def test_gaps_are_refused_where_the_format_has_none(suffix, any_motion, tmp_path):
    motion = any_motion(1)
    poses = motion.poses.copy()
    poses[1:3, 20] = np.nan
    with pytest.raises(
        GapError, match=r"left_knee_flexion of frame 1 is nan, and so are values of 2 frames: .* fill or cut"
    ):
        write(Motion(poses, motion.skeleton, motion.fps), tmp_path / f"a{suffix}")


def test_overwriting_gives_the_new_file(any_motion, tmp_path):
    seen = set()
    for seed in (1, 2, 1):
        write(any_motion(seed), tmp_path / "a.glb")
        seen.add(hashlib.sha256((tmp_path / "a.glb").read_bytes()).hexdigest())
    assert len(seen) == 2


@pytest.mark.parametrize("suffix", [".bvh", ".c3d", ".csv", ".glb", ".mot", ".trc"])
def test_in_memory_every_other_format_is_the_file_to_the_byte(suffix, tmp_path):
    walk = synthesize("walk/fpca", 11, 60, seed=1)
    parts = list(encode(walk, suffix))
    write(walk, tmp_path / f"a{suffix}")
    assert b"".join(parts) == (tmp_path / f"a{suffix}").read_bytes()
    assert (len(parts) > 2) == (suffix in {".bvh", ".csv", ".mot", ".trc"})


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_every_format_takes_a_lower_body(suffix, any_motion, without, tmp_path):
    write(without(any_motion(1), slice(6, 17)), tmp_path / f"a{suffix}")
    assert (tmp_path / f"a{suffix}").stat().st_size > 1000


class Angles:
    names = ("left_foot_progression",)
    values = np.linspace(-5, 5, 5)[:, None]


def test_a_c3d_file_holds_events_and_angles(any_motion, tmp_path):
    path, beside = tmp_path / "a.c3d", {"events": [Event(0.01, "toe_off", "left")], "angles": Angles()}
    write(any_motion(1), path, **beside)
    (event,) = read(path).recording.events
    assert (event.time, event.kind, event.side) == (pytest.approx(0.01), "toe_off", "left")


@pytest.mark.parametrize("suffix", [suffix for suffix in SUFFIXES if suffix != ".c3d"])
def test_other_formats_refuse_events_and_angles(suffix, any_motion, tmp_path):
    path, beside = tmp_path / f"a{suffix}", {"events": [Event(0.01, "toe_off", "left")], "angles": Angles()}
    for given in (("events",), ("angles",), ("events", "angles")):
        with pytest.raises(MotionError, match=rf"{suffix} file holds no {' and '.join(given)}, but \.c3d does"):
            write(any_motion(1), path, **{name: beside[name] for name in given})
    assert not path.exists()


class TestCapturedPoints:
    held = Markers(("LASI", "RASI"), np.random.default_rng(3).normal(size=(5, 2, 3)), 100.0)

    @pytest.mark.parametrize("suffix", [".c3d", ".trc", ".C3D"])
    def test_come_back_under_their_names(self, suffix, tmp_path):
        write_markers(self.held, tmp_path / f"a{suffix}")
        found = read(tmp_path / f"a{suffix}")
        assert (found.names, found.fps) == (self.held.names, 100.0)
        np.testing.assert_allclose(found.positions[..., 2], self.held.positions[..., 2], atol=1e-6)

    def test_what_no_file_can_hold_is_named(self, any_motion, tmp_path):
        infinite = self.held.positions.copy()
        infinite[3, 1, 0] = np.inf
        for held, name, given, problem in (
            (self.held, "a.bvh", {}, r"supported are \.c3d, \.trc\. Other formats hold a body: retarget"),
            (self.held, "a.trc", {"angles": Angles()}, r"\.trc file holds no angles, but \.c3d does"),
            (any_motion(1), "a.c3d", {}, "must be Markers, got Motion"),
            (Markers(("a",), np.zeros((2, 5, 1, 3)), 100.0), "a.c3d", {}, r"got \(2, 5, 1, 3\)"),
            (Markers(("a",), np.zeros((0, 1, 3)), 100.0), "a.trc", {}, "at least one frame and point"),
            (Markers(("a", "b"), infinite, 100.0), "a.trc", {}, "b of frame 3 is infinite"),
        ):
            with pytest.raises(MotionError, match=problem):
                write_markers(held, tmp_path / name, **given)
        assert not list(tmp_path.iterdir())
