"""Write a gait report: the page, and its figures as JSON and CSV beside it."""

from collections.abc import Callable, Sequence
from pathlib import Path

from motionenv._core.files import atomic_write
from motionenv.errors import MotionError
from motionenv.gait.bands import Band, shipped_band
from motionenv.gait.report.page import page
from motionenv.gait.report.tables import to_csv, to_json
from motionenv.gait.session import Session, read_session
from motionenv.mocap import MarkerMap


def write_report(
    paths: Sequence[Path],
    out: Path,
    *,
    static: Path | None = None,
    marker_map: MarkerMap | str | None = None,
    fps: float | None = None,
    unit: str | float | None = None,
    band: Band | None = None,
    on_step: Callable[[str], None] = lambda name: None,
) -> Session:
    """Write the gait report of one person to the page `out`, .html, and beside it the same figures as .json and .csv.

    Args:
        paths, static, marker_map, fps, unit, on_step: as in `motionenv.gait.session.read_session`.
        out: the page.
        band: the reference to show angles against; None takes that of the people of the shipped models.

    Returns:
        What the report shows.

    Raises:
        MotionError: no file can be analysed, or `out` isn't .html or can't be written.
    """
    out = Path(out)
    if out.suffix.lower() not in (".html", ".htm"):
        raise MotionError(f"a report is a page: out must end in .html, got {out.name}")
    reference = shipped_band() if band is None else band
    session = read_session(
        paths, static=static, marker_map=marker_map, fps=fps, unit=unit, band=reference, on_step=on_step
    )
    contents = {
        out: page(session),
        out.with_suffix(".json"): to_json(session),
        out.with_suffix(".csv"): to_csv(session),
    }
    for path, text in contents.items():
        with atomic_write(path) as temporary:
            Path(temporary).write_text(text, encoding="utf-8")
    return session
