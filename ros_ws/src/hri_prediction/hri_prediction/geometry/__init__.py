"""Distances between segments and capsules."""

from hri_prediction.geometry.segments import (
    capsule_distances,
    closest_parameters,
    segment_distance,
)

__all__ = ["capsule_distances", "closest_parameters", "segment_distance"]
