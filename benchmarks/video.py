"""Speed of rendering and encoding relative to real time, and of encoding compared with imageio-ffmpeg and Pillow.

    motionenv bench video

640×480, ten seconds of a synthesised walk at 30 frames per second. CPU is user and system time of all threads and of
the ffmpeg process that imageio starts. Peers encode the same frames in the same run.
"""

import resource
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from PIL import Image

from benchmarks import Arguments, has
from motionenv.models.synthesis import synthesize
from motionenv.render import Scene, film
from motionenv.render.video.encode import write_video

FPS, SECONDS = 30, 10
SIZE = {"width": 640, "height": 480}


def cpu() -> float:
    """CPU time [s] of this process and of its ended children."""
    return sum(
        u.ru_utime + u.ru_stime for u in map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    )


def timed(work: Callable[[], object], n: int, repeats: int = 2) -> tuple[float, float]:
    """Frames per second and CPU milliseconds per frame of `work`, which handles n frames; the best of a few runs."""
    runs = []
    for _ in range(repeats):
        start, before = time.perf_counter(), cpu()
        work()
        runs.append((n / (time.perf_counter() - start), 1e3 * (cpu() - before) / n))
    return max(r[0] for r in runs), min(r[1] for r in runs)


def real_time(motion, folder: Path) -> None:
    """Print the speed of rendering, and of rendering and encoding, relative to real time."""
    n = len(motion.poses)
    print("| | frames/s | × real time | CPU per frame |\n|-|-|-|-|")
    for name, options in (
        ("travelling camera", {"scene": Scene()}),
        ("standing camera", {"scene": Scene(), "follow": False}),
        ("travelling camera, 2×2 rays per pixel (default of `film`)", {}),
        ("standing camera, 2×2 rays per pixel", {"follow": False}),
        ("point lights", {"points": True}),
    ):
        for row, work in (
            (f"render: {name}", lambda o=options: [None for _ in film(motion, 0.5, **SIZE, **o)]),
            ("render and encode", lambda o=options: write_video(folder / "a.mp4", film(motion, 0.5, **SIZE, **o), FPS)),
        ):
            rate, ms = timed(work, n)
            print(f"| {row} | {rate:,.0f} | **{rate / FPS:.1f}×** | {ms:.1f} ms |", flush=True)


def imageio_mp4(frames, path: Path) -> None:
    """The peer: an ffmpeg process fed through a pipe, with the same preset."""
    import imageio.v2 as imageio

    options = ["-preset", "superfast", "-tune", "animation", "-crf", "20"]
    with imageio.get_writer(
        path, fps=FPS, codec="libx264", quality=None, macro_block_size=2, output_params=options
    ) as writer:
        for frame in frames:
            writer.append_data(frame)


def pillow(frames, path: Path) -> None:
    """The peer: Pillow's own writers."""
    first, *rest = (Image.fromarray(f) for f in frames)
    first.save(path, save_all=True, append_images=rest, duration=1000 // FPS, loop=0, quality=80)


def pillow_folder(frames, path: Path) -> None:
    """The peer: a PNG file per frame."""
    path.mkdir(exist_ok=True)
    for i, frame in enumerate(frames):
        Image.fromarray(frame).save(path / f"{i:06d}.png")


def ours_folder(frames, path: Path) -> None:
    """`write_video` to a new folder."""
    write_video(path / str(time.perf_counter_ns()), frames, FPS)


def encoding(frames: np.ndarray, folder: Path) -> None:
    """Print the speed and file sizes of encoding, ours and the peers'."""
    print("\n| encode | ours | CPU | size | peer | CPU | size | ratio |\n|-|-|-|-|-|-|-|-|")
    for suffix, name, peer in (
        *([(".mp4", "imageio-ffmpeg", imageio_mp4)] if has("imageio", "imageio_ffmpeg") else []),
        (".gif", "Pillow", pillow),
        (".webp", "Pillow", pillow),
        ("", "Pillow PNG", pillow_folder),
    ):
        some = frames if suffix == ".mp4" else frames[:60]
        mine, theirs = folder / f"ours{suffix}", folder / f"theirs{suffix}"
        if not suffix:
            mine.mkdir()
        write = (
            (lambda m=mine, s=some: write_video(m, s, FPS)) if suffix else (lambda m=mine, s=some: ours_folder(s, m))
        )
        a, a_cpu = timed(write, len(some))
        b, b_cpu = timed(lambda t=theirs, s=some, p=peer: p(s, t), len(some))
        sizes = [f"{size(p) / len(some) / 1e3:.1f} kB/frame" for p in (mine, theirs)]
        print(
            f"| {suffix or 'PNG folder'} | {a:,.0f} fps | {a_cpu:.1f} ms | {sizes[0]} | {name} {b:,.0f} fps | "
            f"{b_cpu:.1f} ms | {sizes[1]} | **{a / b:.2f}×** |",
            flush=True,
        )


def size(path: Path) -> int:
    """Size [bytes] of a file, or of all files of one film in a folder."""
    if path.is_file():
        return path.stat().st_size
    inner = [p for p in path.iterdir() if p.is_dir()]
    return sum(p.stat().st_size for p in (inner[0] if inner else path).iterdir())


def main() -> None:
    """Print the tables."""
    quick = Arguments(__doc__).parse_args().quick
    motion = synthesize("walk/fpca", 0.2 if quick else SECONDS, FPS, seed=1)
    with tempfile.TemporaryDirectory() as where:
        write_video(Path(where) / "warm.mp4", film(motion, 0.5, width=64, height=48), FPS)
        real_time(motion, Path(where))
        encoding(np.stack(list(film(motion, 0.5, **SIZE))), Path(where))


if __name__ == "__main__":
    main()
