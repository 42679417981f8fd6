"""Films of motion; reading and writing of video files."""

from motionenv.render.video.decode import VideoInfo, read_frames, video_info
from motionenv.render.video.encode import stream_video, write_image, write_video
from motionenv.render.video.film import cameras_for
from motionenv.render.video.tracking_film import track_film

__all__ = [
    "VideoInfo", "cameras_for", "read_frames", "stream_video", "track_film", "video_info", "write_image",
    "write_video",
]  # fmt: skip
