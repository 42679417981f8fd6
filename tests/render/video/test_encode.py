"""Videos out and in: formats, sizes, rates, and the same bytes again."""

import hashlib
import io
import resource
import subprocess
import sys
import textwrap
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest
from PIL import Image, ImageSequence

from motionenv.errors import FormatError, MotionError
from motionenv.render.video.decode import read_frames, video_info
from motionenv.render.video.encode import png, stream_video, write_image, write_video

SUFFIXES = [".mp4", ".gif", ".webp", ""]


def walk(n=12, height=48, width=64):
    """A red box that moves over a smooth background, as a generator that uses one array again and again."""
    y, x = np.mgrid[:height, :width]
    background = np.stack([x * 255 // width, y * 255 // height, 128 + 0 * x], -1).astype(np.uint8)
    frame = np.empty_like(background)
    for i in range(n):
        frame[...] = background
        frame[height // 3 : 2 * height // 3, 2 * i : 2 * i + 10] = (220, 30, 30)
        yield frame


def truth(**kind) -> np.ndarray:
    return np.stack([f.copy() for f in walk(**kind)])


def read(path: Path) -> np.ndarray:
    """All frames (T, H, W, 3) by a reader that isn't ours."""
    if path.suffix == ".mp4":
        with av.open(str(path)) as container:
            return np.stack([f.to_ndarray(format="rgb24") for f in container.decode(video=0)])
    if path.suffix:
        with Image.open(path) as image:
            return np.stack([np.asarray(f.convert("RGB")) for f in ImageSequence.Iterator(image)])
    return np.stack([np.asarray(Image.open(p)) for p in sorted(path.iterdir())])


def digest(path: Path) -> list[str]:
    files = sorted(path.iterdir()) if path.is_dir() else [path]
    return [hashlib.sha256(f.read_bytes()).hexdigest() for f in files]


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_frames_come_back_in_order_and_look_the_same(tmp_path, suffix):
    path = tmp_path / f"walk{suffix}"
    write_video(path, walk(), 25, crf=10)
    back, given = read(path).astype(int), truth()
    assert back.shape == given.shape
    error = np.abs(back - given)
    assert error.mean() < {".mp4": 6, ".gif": 6, ".webp": 5, "": 1e-9}[suffix]
    for i, frame in enumerate(back):  # the box's middle, away from its edges: each frame is the right one
        np.testing.assert_allclose(frame[20:28, 2 * i + 3 : 2 * i + 7].mean((0, 1)), (220, 30, 30), atol=25)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("size", [(64, 64), (80, 80), (208, 176)])
def test_same_frames_same_bytes(tmp_path, suffix, size):
    """At sizes where x264's macroblock tree made every second or third file differ."""
    path = tmp_path / f"a{suffix}"
    seen = set()
    for _ in range(12 if suffix == ".mp4" else 2):
        write_video(path, walk(height=size[0], width=size[1]), 29.97)
        seen.add(tuple(digest(path)))
        for frame in path.iterdir() if path.is_dir() else ():
            frame.unlink()
    assert len(seen) == 1


def test_colours_of_mp4_are_tagged_and_right(tmp_path):
    """Flat primaries survive BT.709 and back within 4 of 255."""
    for name, colour in (("r", (200, 40, 40)), ("g", (40, 200, 40)), ("b", (40, 40, 200)), ("w", (255, 255, 255))):
        write_video(tmp_path / f"{name}.mp4", [np.full((32, 32, 3), colour, dtype=np.uint8)], 30)
        with av.open(str(tmp_path / f"{name}.mp4")) as container:
            (frame,) = container.decode(video=0)
            assert (frame.colorspace, frame.color_primaries, frame.color_range) == (1, 1, 1)
            rgb = frame.to_ndarray(format="rgb24").astype(int)
        assert np.abs(rgb - colour).max() <= 4


@pytest.mark.parametrize("fps", [0.5, 24, 29.97, 30, 119.88])
def test_mp4_has_the_frame_rate(tmp_path, fps):
    write_video(tmp_path / "a.mp4", walk(), fps)
    with av.open(str(tmp_path / "a.mp4")) as container:
        stream = container.streams.video[0]
        assert float(stream.average_rate) == pytest.approx(fps, rel=1e-4)
        assert float(stream.duration * stream.time_base) == pytest.approx(12 / fps, abs=1e-3)  # edit lists count ms
        assert not {"creation_time", "encoder"} & set(container.metadata)


@pytest.mark.parametrize("suffix", [".gif", ".webp"])
def test_animations_last_as_long_as_the_walk_and_loop(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    write_video(path, walk(n=25), 30)
    with Image.open(path) as image:
        assert image.info["loop"] == 0
        total = 0
        for frame in ImageSequence.Iterator(image):
            frame.load()
            total += frame.info["duration"]
    assert total == pytest.approx(25 / 30 * 1000, abs=11)  # GIF counts hundredths of a second


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("size", [(31, 47), (2, 2), (1, 1)])
def test_odd_and_tiny_sizes(tmp_path, suffix, size):
    frames = np.random.default_rng(0).integers(0, 255, (3, *size, 3), dtype=np.uint8)
    write_video(tmp_path / f"a{suffix}", frames, 10)
    even = tuple(s + s % 2 for s in size) if suffix == ".mp4" else size
    assert read(tmp_path / f"a{suffix}").shape == (3, *even, 3)


def test_gif_palette_is_made_from_all_frames(tmp_path):
    """Each frame has a colour of its own: a palette of the first would lose the others."""
    colours = np.random.default_rng(0).integers(0, 255, (40, 3), dtype=np.uint8)
    write_video(tmp_path / "a.gif", np.broadcast_to(colours[:, None, None], (40, 8, 8, 3)), 10)
    assert np.abs(read(tmp_path / "a.gif")[:, 4, 4].astype(int) - colours).max() <= 8


@pytest.mark.parametrize("suffix", [".mp4", ".gif"])
def test_frames_are_taken_one_at_a_time_and_progress_is_told(tmp_path, suffix):
    """200 frames would take 184 MB if they were kept."""
    told = []
    resident = [0]

    def progress(n):
        told.append(n)
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        resident.append(pages * resource.getpagesize())

    frame = np.zeros((480, 640, 3), dtype=np.uint8)
    write_video(tmp_path / f"a{suffix}", (frame for _ in range(200)), 30, progress=progress)
    assert told == list(range(1, 201))
    assert max(resident) - resident[1] < 90e6


def test_older_files_are_replaced_and_empty_folders_filled(tmp_path):
    (tmp_path / "a.gif").write_bytes(b"old")
    (tmp_path / "frames").mkdir()
    write_video(tmp_path / "a.gif", walk(), 10)
    write_video(tmp_path / "frames", walk(), 10)
    assert len(read(tmp_path / "a.gif")) == len(read(tmp_path / "frames")) == 12
    assert (tmp_path / "frames" / "frame_000011.png").exists()


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_renderer_that_fails_leaves_nothing(tmp_path, suffix):
    def broken():
        yield from walk(n=5)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_video(tmp_path / f"a{suffix}", broken(), 10)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize(
    ("frames", "match"),
    [
        ([], "at least one frame"),
        ([np.zeros((4, 4, 3))], r"frame 0 must be uint8 .*float64"),
        ([np.zeros((4, 4), dtype=np.uint8)], r"frame 0 must be"),
        ([np.zeros((0, 4, 3), dtype=np.uint8)], r"frame 0 must be"),
        ([np.zeros((4, 4, 3), np.uint8), np.zeros((4, 6, 3), np.uint8)], "frame 1 has shape"),
    ],
)
def test_bad_frames_say_which_and_leave_nothing(tmp_path, suffix, frames, match):
    with pytest.raises(MotionError, match=match):
        write_video(tmp_path / f"a{suffix}", frames, 10)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("name", "fps", "crf", "match"),
    [
        ("a.avi", 30, 20, r"\.mp4, \.gif or \.webp"),
        ("a.png", 30, 20, "or none for a folder"),
        ("a.mp4", 0, 20, "fps"),
        ("a.mp4", float("nan"), 20, "fps"),
        ("a.mp4", "30", 20, "fps"),
        ("a.mp4", 1001, 20, "0.01 to 1000"),
        ("a.gif", 60, 20, "fps of .gif must be a number from 0.01 to 50"),
        ("a.mp4", 30, 52, "crf"),
        ("missing/a.mp4", 30, 20, "can(no|')t write"),
        ("missing/a", 30, 20, "can(no|')t write"),
        ("taken", 30, 20, "isn't an empty folder"),
        ("taken.gif", 30, 20, "a folder has that name"),
    ],
)
def test_bad_requests_fail_before_the_first_frame(tmp_path, name, fps, crf, match):
    (tmp_path / "taken").mkdir()
    (tmp_path / "taken" / "something").touch()
    (tmp_path / "taken.gif").mkdir()

    def never():
        pytest.fail("a frame was rendered")
        yield

    with pytest.raises(MotionError, match=match):
        write_video(tmp_path / name, never(), fps, crf=crf)


def test_too_large_for_the_format_is_an_error(tmp_path):
    with pytest.raises(MotionError, match="can't encode"):
        write_video(tmp_path / "a.webp", np.zeros((1, 2, 17000, 3), dtype=np.uint8), 10)
    assert not list(tmp_path.iterdir())


FULL_DISK = """
    import resource, signal, sys
    import numpy as np
    from motionenv.errors import MotionError
    from motionenv.render.video.encode import png, stream_video, write_image, write_video

    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    noise = np.random.default_rng(0).integers(0, 255, (20, 64, 64, 3), dtype=np.uint8)
    for limit in (0, 1, 1000, 3000, 30_000):
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))
        for suffix in (".mp4", ".gif", ".webp", ""):
            try:
                write_video(f"{sys.argv[1]}/a{suffix}", noise, 10)
            except MotionError as error:
                assert "can't write" in str(error), error
            else:
                assert (limit, suffix) == (30_000, ""), (limit, suffix)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (1000, resource.RLIM_INFINITY))
        write_image(f"{sys.argv[1]}/a.png", noise[0])
    except MotionError:
        print("done")
"""


def test_full_disk_is_an_error_and_leaves_nothing(tmp_path):
    """Files may not grow beyond a limit, as on a full disk; only the small PNGs fit the largest one."""
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(FULL_DISK), tmp_path], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, "done\n"), done.stderr
    assert [p.name for p in tmp_path.iterdir()] == ["a"]


def test_write_image(tmp_path):
    picture = truth(n=1)[0]
    write_image(tmp_path / "a.png", picture)
    np.testing.assert_array_equal(np.asarray(Image.open(tmp_path / "a.png")), picture)
    with pytest.raises(MotionError, match=r"\.png"):
        write_image(tmp_path / "a.jpg", picture)
    with pytest.raises(MotionError, match="must be uint8"):
        write_image(tmp_path / "b.png", picture[..., 0])
    assert [p.name for p in tmp_path.iterdir()] == ["a.png"]


def test_a_stream_is_the_film_in_parts_that_can_be_watched_as_they_come():
    parts = list(stream_video(walk(n=40), 30))
    assert len(parts) == 41
    assert parts[0][4:8] == b"ftyp"  # the beginning comes with the first frame
    assert sum(map(bool, parts)) >= 3
    with av.open(io.BytesIO(b"".join(parts))) as container:
        shown = np.stack([f.to_ndarray(format="rgb24") for f in container.decode(video=0)])
        assert container.streams.video[0].average_rate == 30
    assert np.abs(shown.astype(int) - truth(n=40)).mean() < 4
    with av.open(io.BytesIO(b"".join(parts[:20]))) as begun:  # one fragment has come whole
        assert sum(1 for _ in begun.decode(video=0)) == 15


def test_a_stream_is_the_same_each_time():
    sizes = {"height": 51, "width": 67}
    assert len({b"".join(stream_video(walk(n=20, **sizes), 25)) for _ in range(3)}) == 1


def test_a_stream_that_is_closed_draws_no_more():
    taken = []

    def drawn():
        for frame in walk(n=50):
            taken.append(1)
            yield frame

    stream = stream_video(drawn(), 30)
    for _ in range(5):
        next(stream)
    stream.close()
    assert len(taken) == 5


def test_a_stream_that_can_not_be_is_refused():
    for fps, crf in ((0, 20), (30, 99)):
        with pytest.raises(MotionError, match="fps|crf"):
            stream_video(walk(), fps, crf=crf)
    with pytest.raises(MotionError, match="at least one frame"):
        list(stream_video([], 30))
    with pytest.raises(MotionError, match="one size"):
        list(stream_video([truth()[0], truth()[0, 1:]], 30))


def test_a_picture_is_bytes_too():
    np.testing.assert_array_equal(np.asarray(Image.open(io.BytesIO(png(truth()[3])))), truth()[3])


@pytest.fixture(scope="module")
def steps(tmp_path_factory):
    """A film of 30 grey pictures at 60 fps, each 8 levels lighter than the one before."""
    path = tmp_path_factory.mktemp("films") / "steps.mp4"
    write_video(path, np.broadcast_to(np.arange(30, dtype=np.uint8)[:, None, None, None] * 8, (30, 48, 64, 3)), 60)
    return path


def levels(frames) -> np.ndarray:
    return np.array([round(float(f.mean()) / 8) for f in frames])


def test_all_frames_as_they_were_written(steps):
    assert video_info(steps).fps == 60
    assert (video_info(steps).width, video_info(steps).height) == (64, 48)
    np.testing.assert_array_equal(levels(read_frames(steps)), np.arange(30))


@pytest.mark.parametrize(
    ("fps", "expected"), [(30, np.arange(0, 30, 2)), (20, np.arange(0, 30, 3)), (60, np.arange(30))]
)
def test_other_rates_take_the_nearest_frames(steps, fps, expected):
    np.testing.assert_array_equal(levels(read_frames(steps, fps=fps)), expected)


def test_faster_rates_repeat_frames(steps):
    np.testing.assert_array_equal(levels(read_frames(steps, fps=120))[:6], [0, 0, 1, 1, 2, 2])
    assert len(list(read_frames(steps, fps=120))) == 60


def test_size_and_duration(steps):
    frames = list(read_frames(steps, width=32, seconds=0.25))
    assert len(frames) == 15
    assert frames[0].shape == (24, 32, 3)
    assert frames[0].dtype == np.uint8


def test_films_that_are_none(steps, tmp_path):
    for name, content in {"empty": b"", "text": b"no film " * 99, "cut": steps.read_bytes()[:1500]}.items():
        (tmp_path / f"{name}.mp4").write_bytes(content)
        with pytest.raises(FormatError, match=name):
            list(read_frames(tmp_path / f"{name}.mp4"))
    with pytest.raises(FormatError, match="no such file"):
        video_info(tmp_path / "none.mp4")
    for wrong in ({"fps": 0}, {"width": 3}, {"seconds": 0}):
        with pytest.raises(MotionError, match=next(iter(wrong))):
            read_frames(steps, **wrong)


def test_pixels_that_are_not_square_are_made_so(tmp_path):
    """PAL's 720 × 576 for a television of 4:3 has pixels of 16:15, and 768 × 576 square ones."""
    with av.open(str(tmp_path / "pal.mp4"), "w") as output:
        stream = output.add_stream("mpeg4", rate=25)
        stream.width, stream.height, stream.pix_fmt = 720, 576, "yuv420p"
        stream.codec_context.sample_aspect_ratio = Fraction(16, 15)
        picture = av.VideoFrame.from_ndarray(np.full((576, 720, 3), 90, dtype=np.uint8), format="rgb24")
        output.mux(stream.encode(picture))
        output.mux(stream.encode(None))
    info = video_info(tmp_path / "pal.mp4")
    assert (info.width, info.height) == (768, 576)
    assert next(iter(read_frames(tmp_path / "pal.mp4"))).shape == (576, 768, 3)
    assert next(iter(read_frames(tmp_path / "pal.mp4", width=384))).shape == (288, 384, 3)
