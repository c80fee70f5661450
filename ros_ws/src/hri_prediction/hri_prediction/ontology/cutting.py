"""Segments of a whole recording of two arms, as they are found live."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hri_prediction.ontology.config import WatchConfig
from hri_prediction.ontology.segment import Segment
from hri_prediction.ontology.watch import AGENTS, DyadWatch
from hri_prediction.tracks.segmentation import SegmentationConfig
from hri_prediction.tracks.track import ArmSample, ArmTrack

_NANO = 1e-9


def merged(tracks: tuple[ArmTrack, ArmTrack]) -> Iterator[tuple[int, ArmSample]]:
    """The samples of two tracks on the same clock, in the order of time: whose, and what."""
    stamps = np.concatenate([np.rint(track.time_s / _NANO) for track in tracks]).astype(np.int64)
    owner = np.repeat(AGENTS, [len(track) for track in tracks])
    row = np.concatenate([np.arange(len(track)) for track in tracks])
    valid = [track.valid for track in tracks]
    for index in np.argsort(stamps, kind="stable"):
        agent, at = int(owner[index]), int(row[index])
        track = tracks[agent]
        yield (
            agent,
            ArmSample(int(stamps[index]), track.keypoints[at], valid[agent][at], track.side),
        )


def segments_of(
    tracks: tuple[ArmTrack, ArmTrack],
    config: WatchConfig | None = None,
    segmentation: SegmentationConfig | None = None,
) -> list[Segment]:
    """All segments of a recording of two arms, as they are found live.

    Args:
        tracks: Of both, on the same clock and in the same frame.
        config: Of the features.
        segmentation: Thresholds of the segments.
    """
    watch = DyadWatch(config, segmentation)
    found: list[Segment] = []
    for agent, sample in merged(tracks):
        found += watch.push(agent, sample)
    return found + watch.finish()
