"""A folder of a few captures, laid out as that of all: what benchmarks read with --quick."""

import functools
import re
from pathlib import Path

import numpy as np

from benchmarks import scratch

TRIALS = ("02_01", "02_02", "06_01", "07_01", "07_03", "12_01", "12_02", "26_01", "35_01", "35_02")
FILES = (
    *(f"cmu_asfamc/{trial[:2]}/{name}" for trial in TRIALS for name in (f"{trial}.amc", f"{trial[:2]}.asf")),
    "cmu_bvh_dance/indian/06.bvh",
    "cmu_bvh_dance/salsa/01.bvh",
    "cmu_c3d/02_01.c3d",
    "bandai_namco/*-1/data/*_walk*_normal_001.bvh",
    "bandai_namco/*-2/data/*_walk-turn-*_active_001.bvh",
    *(f"bandai_namco/*-1/data/*_{kind}*_normal_001.bvh" for kind in ("run", "dash", "bow", "kick", "punch", "dance")),
    "bandai_namco/*-2/data/*_wave-both-hands_active_001.bvh",
    "btkdata/C3DSamples/PiG/PiG_Motion*.c3d",
    "btkdata/TRCSamples/Truncated.trc",
    "nimble/c3d/cmu_02_05.c3d",
    "nimble/c3d/cmu_dribble_shoot_basketball.c3d",
    "nimble/grf/Subject4/MarkerData/walking[1-4].trc",
    "nimble/osim/LaiArnoldSubject6/walking1.trc",
    "pose2sim/Demo_SinglePerson/*/*",
    "pose2sim/from_history/*",
    "santos25/user0[1-3]/*_000[1-2]_*",
)
PEOPLE = 12  # of kinectgait


@functools.cache
def few(mocap: Path) -> Path:
    """A temporary folder with links to a few files of `mocap`."""
    folder = scratch()
    for pattern in FILES:
        for path in mocap.glob(pattern):
            link = folder / path.relative_to(mocap)
            link.parent.mkdir(parents=True, exist_ok=True)
            if not link.exists():
                link.symlink_to(path.resolve())
    if (table := mocap / "CMU_TRIALS.md").exists():
        lines = table.read_text(encoding="utf-8").splitlines()
        kept = [line for line in lines if not re.match(r"\|\d\d_", line) or line[1:6] in TRIALS]
        (folder / table.name).write_text("\n".join(kept), encoding="utf-8")
    if (walks := mocap / "kinectgait/kinectgait_001_100.npz").exists():
        (folder / "kinectgait").mkdir()
        (folder / "kinectgait/person-data.csv").symlink_to((walks.parent / "person-data.csv").resolve())
        with np.load(walks) as file:
            kept = {name: file[name] for name in file.files if "/" not in name or int(name[6:9]) <= PEOPLE}
        np.savez(folder / "kinectgait" / walks.name, **kept)
    return folder
