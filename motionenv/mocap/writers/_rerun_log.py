"""A Rerun recording in memory: each kind of content on the timeline, with nothing where values are unknown."""

import importlib.util
from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from motionenv.errors import MotionError
from motionenv.types import Camera

_TIMELINE = "time"
_APPLICATION = "motionenv"


class Log:
    """A recording in memory, whose id is equal for equal content; the viewer shows its name."""

    def __init__(self, recording_id: str, name: str, fps: float) -> None:
        check_installed()
        self._fps = fps
        self._rerun = rerun = importlib.import_module("rerun")
        self._recording = rerun.RecordingStream(_APPLICATION, recording_id=recording_id, send_properties=False)
        if not self._recording.is_enabled():
            raise MotionError("rerun is switched off by the environment variable RERUN: unset it to write an RRD file")
        self._recording.set_log_time_enabled(False)  # content depends on the motion, not on when it was written
        self._recording.set_log_tick_enabled(False)
        self._stream: Any = self._recording.binary_stream()
        if name:
            self._recording.send_recording_name(name)
        self._log("world", rerun.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)

    def points(self, path: str, positions: np.ndarray, names: Sequence[str]) -> None:
        """Named points (frames, points, 3) [m], those with NaN left out."""
        rr = self._rerun
        known = np.isfinite(positions).all(-1)
        labels = [rr.AnnotationInfo(id=i, label=name) for i, name in enumerate(names)]
        self._log(path, rr.AnnotationContext(rr.ClassDescription(info=0, keypoint_annotations=labels)), static=True)
        self._log(path, rr.Points3D.from_fields(class_ids=[0], radii=[0.015], show_labels=False), static=True)
        ids = np.broadcast_to(np.arange(len(names)), known.shape)[known]
        columns = rr.Points3D.columns(positions=positions[known], keypoint_ids=ids)
        self._send(path, np.arange(len(known)), columns.partition(known.sum(1)))

    def lines(self, path: str, ends: np.ndarray, colour: tuple[int, int, int]) -> None:
        """Lines (frames, lines, 2, 3) [m], those with NaN left out."""
        rr = self._rerun
        known = np.isfinite(ends).all((-2, -1))
        self._log(path, rr.LineStrips3D.from_fields(colors=[colour], radii=[0.006]), static=True)
        self._send(path, np.arange(len(known)), rr.LineStrips3D.columns(strips=ends[known]).partition(known.sum(1)))

    def moving_mesh(self, path: str, positions: np.ndarray, rotations: np.ndarray, **mesh: np.ndarray) -> None:
        """A mesh at positions (frames, 3) [m] with rotations (frames, 3, 3); gone while they are NaN."""
        rr = self._rerun
        known = np.isfinite(positions).all(-1) & np.isfinite(rotations).all((-2, -1))
        if not known.any():
            return
        quaternions = Rotation.from_matrix(rotations[known]).as_quat()
        columns = rr.Transform3D.columns(translation=positions[known], quaternion=quaternions)
        if known.all():
            self._log(path, rr.Mesh3D(**mesh), static=True)
        else:  # what is static can't be cleared
            for frame in self._runs(path, known):
                self._at(frame)
                self._log(path, rr.Mesh3D(**mesh))
        self._send(path, np.flatnonzero(known), columns)

    def scalars(self, path: str, values: np.ndarray) -> None:
        """A curve (frames,), interrupted where NaN."""
        known = np.isfinite(values)
        if known.any():
            self._send(path, np.flatnonzero(known), self._rerun.Scalars.columns(scalars=values[known]))
            self._runs(path, known)

    def texts(self, path: str, rows: Sequence[tuple[float, str]]) -> None:
        """Texts by time [s]."""
        if rows:
            times, texts = zip(*sorted(rows), strict=True)
            self._send_at(path, np.array(times), self._rerun.TextLog.columns(text=list(texts)))

    def camera(self, path: str, camera: Camera) -> None:
        """A camera that stands still; Rerun counts pixels from the corner of the first, not from its centre."""
        rr = self._rerun
        intrinsics = camera.K + np.array([[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]])
        size = [camera.width, camera.height]
        pinhole = rr.Pinhole(image_from_camera=intrinsics, resolution=size, camera_xyz=rr.ViewCoordinates.RDF)
        self._log(path, rr.Transform3D(translation=camera.centre, mat3x3=camera.R.T), static=True)
        self._log(path, pinhole, static=True)

    def picture(self, path: str, picture: np.ndarray, frame: int, quality: int) -> None:
        """A picture (height, width, 3) uint8 at a frame, as JPEG."""
        self._at(frame)
        self._log(path, self._rerun.Image(picture).compress(jpeg_quality=quality))

    def views(self, camera: bool) -> None:
        """How the viewer shows the recording at first."""
        from rerun import blueprint as views

        beside: list[Any] = [views.Spatial2DView(origin="world/camera", name="Camera")] if camera else []
        beside += [views.TimeSeriesView(origin="joint_angles", name="Joint angles [°]")]
        beside += [views.TextLogView(origin="events", name="Events")]
        world = views.Spatial3DView(origin="world", name="World")
        self._recording.send_blueprint(views.Blueprint(views.Horizontal(world, views.Vertical(*beside))))

    def encoded(self) -> bytes:
        """End the recording; its bytes."""
        data = self._stream.read()
        self._recording.disconnect()
        return data

    def _runs(self, path: str, known: np.ndarray) -> np.ndarray:
        """First frames of the runs in which `known` (frames,) holds; the gaps behind them are cleared."""
        change = np.diff(np.concatenate([[0], known.astype(np.int8)]))
        gaps = np.flatnonzero(change < 0)
        if len(gaps):
            self._send(path, gaps, self._rerun.Clear.columns(is_recursive=[False] * len(gaps)))
        return np.flatnonzero(change > 0)

    def _at(self, frame: int) -> None:
        """The time of what is logged next."""
        self._recording.set_time(_TIMELINE, duration=frame / self._fps)

    def _log(self, path: str, what: Any, *, static: bool = False) -> None:
        self._recording.log(path, what, static=static, strict=True)

    def _send(self, path: str, frames: np.ndarray, columns: Any) -> None:
        self._send_at(path, frames / self._fps, columns)

    def _send_at(self, path: str, seconds: np.ndarray, columns: Any) -> None:
        index = self._rerun.TimeColumn(_TIMELINE, duration=seconds)
        self._recording.send_columns(path, [index], columns, strict=True)


def check_installed() -> None:
    """Raise if rerun-sdk isn't installed, without importing it."""
    if importlib.util.find_spec("rerun") is None:
        raise MotionError("an RRD file needs rerun-sdk, which isn't installed: pip install motionenv[rerun]")
