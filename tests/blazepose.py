"""BlazePose's models for the tests, from inside a wheel of MediaPipe, which is downloaded once.

    python -m tests.blazepose

puts them where motionenv looks for them, without another download; .ci/run calls it for the examples of the site.
"""

import os
import subprocess
import sys
from pathlib import Path
from zipfile import ZipFile

import platformdirs

VERSION = "0.10.14"  # the last one whose wheel has the models
ANY = ("--only-binary", ":all:", "--python-version", "3.11", "--platform", "manylinux2014_x86_64")  # only files matter


def wheel() -> Path:
    """The wheel, in the user's cache or the folder MOTIONENV_BLAZEPOSE.

    Raises:
        CalledProcessError: pip can't have it.
    """
    folder = Path(os.environ.get("MOTIONENV_BLAZEPOSE") or platformdirs.user_cache_path("motionenv-tests"))
    if not (found := list(folder.glob(f"mediapipe-{VERSION}-*.whl"))):
        get = (sys.executable, "-m", "pip", "download", "-q", "--no-deps", *ANY, "-d", str(folder))
        subprocess.run([*get, f"mediapipe=={VERSION}"], check=True, capture_output=True)
        found = list(folder.glob(f"mediapipe-{VERSION}-*.whl"))
    return found[0]


def placed(folder: Path) -> None:
    """Put the models into the folder where they would be downloaded to."""
    folder.mkdir(parents=True, exist_ok=True)
    with ZipFile(wheel()) as archive:
        for name in archive.namelist():
            if name.endswith(("/pose_detection.tflite", "/pose_landmark_full.tflite")):
                part = folder / f"{name.rpartition('/')[2]}.{os.getpid()}"
                part.write_bytes(archive.read(name))
                part.replace(part.with_suffix(""))


if __name__ == "__main__":
    placed(platformdirs.user_cache_path("motionenv") / "blazepose")
