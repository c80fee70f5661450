"""Pictures and videos of recorded runs."""

from hri_sim.media.frames import BaselineTrack, PredictionMark, ReachMark, RunRecord
from hri_sim.media.picture import draw_picture
from hri_sim.media.video import render_video

__all__ = [
    "BaselineTrack",
    "PredictionMark",
    "ReachMark",
    "RunRecord",
    "draw_picture",
    "render_video",
]
