"""Bags of rosbag2 (MCAP storage): written crash-safe, read, inspected and salvaged without ROS."""

from hri_prediction.bags.inspect import BagReport, TopicReport, inspect_bag
from hri_prediction.bags.metadata import BagMetadata, OfferedQos, TopicInfo
from hri_prediction.bags.reader import BagMessage, BagReader
from hri_prediction.bags.salvage import SalvageReport, salvage
from hri_prediction.bags.writer import BagWriter

__all__ = [
    "BagMessage",
    "BagMetadata",
    "BagReader",
    "BagReport",
    "BagWriter",
    "OfferedQos",
    "SalvageReport",
    "TopicInfo",
    "TopicReport",
    "inspect_bag",
    "salvage",
]
