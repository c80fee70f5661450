"""Who is discovered, and over what, when nothing is said, and when the user says something."""

from __future__ import annotations

import pytest

from hri_prediction.ros.this_machine import PROFILE, stay_on_this_machine

DEFAULT = {
    "ROS_AUTOMATIC_DISCOVERY_RANGE": "SYSTEM_DEFAULT",
    "FASTRTPS_DEFAULT_PROFILES_FILE": str(PROFILE),
}


@pytest.mark.parametrize(
    "environment",
    [{}, {"RMW_IMPLEMENTATION": "rmw_fastrtps_dynamic_cpp"}, {"ROS_STATIC_PEERS": ""}],
)
def test_this_machine_over_the_loopback_interface(environment: dict[str, str]) -> None:
    assert PROFILE.is_file()
    assert stay_on_this_machine(environment) == DEFAULT


@pytest.mark.parametrize(
    ("environment", "added"),
    [
        ({"RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp"}, {"ROS_AUTOMATIC_DISCOVERY_RANGE"}),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}, set()),
        # rcl takes no notice of the range when this one is 1.
        ({"ROS_LOCALHOST_ONLY": "1"}, {"ROS_AUTOMATIC_DISCOVERY_RANGE"}),
        ({"FASTRTPS_DEFAULT_PROFILES_FILE": "my.xml"}, {"ROS_AUTOMATIC_DISCOVERY_RANGE"}),
    ],
)
def test_what_the_user_has_chosen_stays(environment: dict[str, str], added: set[str]) -> None:
    found = stay_on_this_machine(environment)
    assert found.keys() == {*added, "FASTDDS_BUILTIN_TRANSPORTS"}
    assert found.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST") == "LOCALHOST"


def test_the_transport_that_the_user_has_chosen_stays() -> None:
    found = stay_on_this_machine({"FASTDDS_BUILTIN_TRANSPORTS": "SHM"})
    assert found == {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
