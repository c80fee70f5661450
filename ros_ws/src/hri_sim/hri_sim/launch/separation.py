"""The separation monitor of a launched run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

import typer

from hri_planner.separation.config import ASSUMED, BOTH, HUMAN_MODES, SEEN
from hri_planner.separation.timely import MOST_HELD_S, TRANSPORT_S
from hri_prediction.errors import ConfigError
from hri_sim.launch.supervisor import NodeSpec
from hri_sim.scenario.schema import Scenario
from hri_sim.simulator.stopchain import COMMAND_TIMEOUT_S, HEARTBEAT_TIMEOUT_S

OFF = "off"
SEPARATIONS = (*HUMAN_MODES, OFF)
DEFAULT_SEPARATION = OFF
MONITOR = "separation_monitor"
WITHOUT = "give one of them; without --separation there is no monitor (off)"
"""What to do about another one."""
CONTACT_SPEED = 0.15
"""At that the robot may always go in launched runs, beside a simulated hand [m/s]."""

Separation = Annotated[
    str,
    typer.Option(
        help="Speed and separation monitoring: how fast the person is taken to come nearer. measured: as "
        "fast as seen; predicted: as the predictor says; assumed: always at the speed of the standard, so "
        "that the robot stands while a hand is within some 30 cm; off: the planner's own care alone."
    ),
]


def contact_speed(mode: str) -> float:
    """At that the robot may touch somebody in a launched run [m/s]; 0: it is to stand."""
    return 0.0 if mode in (ASSUMED, OFF) else CONTACT_SPEED


def separation_specs(mode: str, scenario: Scenario, *, real: bool = False) -> list[NodeSpec]:
    """The monitor, unless it is off.

    Real people have trunk and head and two arms, and nobody evades or nudges them: it reckons with what it
    does by itself. Simulated and replayed people are an arm and nothing else, or both arms where a scenario
    says so: where all of its people have both, both are waited for. A planner that evades them is to be
    let do so, and a robot that was stopped right beside a hand is to get away from it: but not where people
    are assumed to be as fast as the standard has them, which is how a robot rests before anybody can touch
    it.

    Args:
        mode: One of :data:`SEPARATIONS`.
        scenario: The scene, with the people that are simulated or replayed.
        real: Whether people are real instead.
    """
    if mode == OFF:
        return []
    if real:
        return [NodeSpec("hri_planner", MONITOR, {"human": mode})]
    whole = bool(scenario.persons) and all(person.both_arms for person in scenario.persons)
    parameters: dict[str, Any] = {
        "human": mode,
        "arms": BOTH if whole else SEEN,
        "trunk": False,
        "intrusion": 0.0,
    }
    if mode != ASSUMED:
        parameters |= {"evasion": True, "contact_speed": contact_speed(mode)}
    return [NodeSpec("hri_planner", MONITOR, parameters)]


def permitted_words(parameters: Mapping[str, Mapping[str, Any]]) -> str:
    """What a monitor lets a robot do beside people, to be said before it does; empty: nothing.

    Args:
        parameters: All of them by node.
    """
    monitor = parameters.get(MONITOR, {})
    permitted = []
    if monitor.get("evasion"):
        permitted.append("leave people at any speed")
    if monitor.get("contact_speed"):
        permitted.append(f"go at {monitor['contact_speed']:g} m/s beside them")
    if not permitted:
        return ""
    return (
        f"{MONITOR}: the robot may {' and '.join(permitted)}, and so touch them: docs/separation.md "
        "(--separation assumed: it may not)"
    )


def timeouts(mode: str) -> dict[str, float]:
    """Parameters of the controller: how long it goes on without commands.

    What a monitor said last is good for its reaction time. Without one nobody reckons with that.
    """
    given = {"command_timeout": COMMAND_TIMEOUT_S}
    return given if mode == OFF else {**given, "heartbeat_timeout": HEARTBEAT_TIMEOUT_S}


def heartbeat(mode: str) -> dict[str, bool]:
    """Parameters of what moves the robot: where a monitor supplies the speed scale, it alone does."""
    return {} if mode == OFF else {"heartbeat": False}


def check_stopping(parameters: Mapping[str, Mapping[str, Any]], source: str) -> None:
    """Refuse a monitor that reckons with a robot which stops sooner than the controller does.

    Args:
        parameters: All of them by node.
        source: Where they were given, for the error.

    Raises:
        ConfigError: naming both.
    """
    if MONITOR not in parameters or "simulator" not in parameters:
        return
    robot, monitor = parameters["simulator"], parameters[MONITOR]
    ramp, reckoned = robot["ramp_down"], monitor["stopping_time"]
    if reckoned < ramp:
        raise ConfigError(
            f"{source}: {MONITOR}: stopping_time = {reckoned} s, but the controller takes {ramp} s to stop",
            expected=f"at least simulator: ramp_down = {ramp}",
        )
    if not robot["command_timeout"]:
        raise ConfigError(
            f"{source}: simulator: command_timeout = 0 beside a {MONITOR}",
            expected="a time, after which a robot stops whose monitor is dead",
        )
    silence = robot["heartbeat_timeout"] or robot["command_timeout"]
    least = MOST_HELD_S + TRANSPORT_S + silence
    if monitor["reaction_time"] < least - 1e-9:
        raise ConfigError(
            f"{source}: {MONITOR}: reaction_time = {monitor['reaction_time']} s, but the controller goes "
            f"on for {silence} s when the monitor is dead",
            expected=f"at least {least:g} s, with {MOST_HELD_S} s until it is said and {TRANSPORT_S} s on "
            "the way",
            hint="lower simulator: heartbeat_timeout instead",
        )
