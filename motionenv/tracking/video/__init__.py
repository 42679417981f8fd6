"""Track a person in a video without ground truth."""

from motionenv.tracking.video.candidates import Candidate
from motionenv.tracking.video.survey import Film
from motionenv.tracking.video.track import VideoTrack, find_people, track_video
from motionenv.tracking.video.verdict import Lost

__all__ = ["Candidate", "Film", "Lost", "VideoTrack", "find_people", "track_video"]
