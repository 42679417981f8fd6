"""Track a person in a video without ground truth."""

from motionenv.tracking.video.track import VideoTrack, track_video

__all__ = ["VideoTrack", "track_video"]
