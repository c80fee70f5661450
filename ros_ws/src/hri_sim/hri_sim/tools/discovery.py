"""Where a ROS node of this process looks for others, in words."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from hri_prediction.ros.this_machine import PROFILE

_RANGES = {
    "OFF": "no other node at all (ROS_AUTOMATIC_DISCOVERY_RANGE=OFF)",
    "LOCALHOST": "nodes of this machine alone (ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST)",
    "SUBNET": "nodes of the local network (ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET)",
}


def domain(environment: Mapping[str, str]) -> str:
    """The ROS domain."""
    return environment.get("ROS_DOMAIN_ID") or "0"


def discovery(environment: Mapping[str, str]) -> str:
    """Who is discovered, as far as the environment says."""
    server = environment.get("ROS_DISCOVERY_SERVER")
    if server:
        return f"nodes that the discovery server {server} knows (ROS_DISCOVERY_SERVER)"
    if environment.get("ROS_LOCALHOST_ONLY") == "1":
        return "nodes of this machine alone (ROS_LOCALHOST_ONLY=1)"
    profile = environment.get("FASTRTPS_DEFAULT_PROFILES_FILE")
    chosen = environment.get("ROS_AUTOMATIC_DISCOVERY_RANGE") or "SUBNET"
    if chosen in _RANGES:
        said = _RANGES[chosen]
    elif profile and Path(profile).name == PROFILE.name:  # of the sources, or as installed
        said = "nodes of this machine alone (set ROS_AUTOMATIC_DISCOVERY_RANGE for more)"
    else:
        said = f"nodes that {profile or 'the middleware'} allows (ROS_AUTOMATIC_DISCOVERY_RANGE={chosen})"
    peers = environment.get("ROS_STATIC_PEERS")
    return f"{said}, and {peers} (ROS_STATIC_PEERS)" if peers else said
