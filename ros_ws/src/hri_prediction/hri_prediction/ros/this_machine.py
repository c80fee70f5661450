"""Discovery on this machine alone, over UDP, unless the user has chosen something else.

Standard library only, and old syntax on purpose: scripts/_project.py runs this file in whatever
``python3`` is at hand.
"""

from pathlib import Path
from typing import Dict, Mapping  # noqa: UP035

PROFILE = Path(__file__).resolve().with_name("this_machine.xml")
"""Does what LOCALHOST does, without the shared-memory transport."""

CHOICES = (
    "ROS_AUTOMATIC_DISCOVERY_RANGE",
    "ROS_LOCALHOST_ONLY",
    "ROS_STATIC_PEERS",
    "ROS_DISCOVERY_SERVER",
    "FASTRTPS_DEFAULT_PROFILES_FILE",
    "FASTDDS_BUILTIN_TRANSPORTS",
)
"""Variables by which a user chooses who is discovered, or over what."""


def stay_on_this_machine(environment: Mapping[str, str]) -> Dict[str, str]:  # noqa: UP006
    """Variables to be set on top of an environment.

    Not the shared-memory transport: a process that is killed may leave it locked for all others. For
    LOCALHOST, rmw_fastrtps sets it up in any case; so the range is left to the profile.
    """
    middleware = environment.get("RMW_IMPLEMENTATION") or "rmw_fastrtps_cpp"
    chosen = any(environment.get(name) for name in CHOICES)
    if middleware.startswith("rmw_fastrtps") and not chosen:
        return {
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "SYSTEM_DEFAULT",
            "FASTRTPS_DEFAULT_PROFILES_FILE": str(PROFILE),
        }
    defaults = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4"}
    return {name: value for name, value in defaults.items() if not environment.get(name)}
