"""What the nodes of a run say of themselves, and what of that its user must hear at once."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Collection, Sequence

from diagnostic_msgs.msg import DiagnosticStatus

from hri_prediction.ros.diagnostics import LEVEL_NOW
from hri_prediction.ros.node import STANDSTILL
from hri_sim.launch.vital import hears
from hri_sim.nodes.recorder_node import TROUBLES
from hri_sim.recording.condition import TRANSPORT
from hri_sim.simulator.controller import STOPPING
from hri_sim.simulator.stopchain import NO_HEARTBEAT, TOUCHED

RECORDER, MONITOR, SIMULATOR = "recorder", "separation_monitor", "simulator"
"""Labels of nodes."""
SILENT_S = 3.0
"""A node that says nothing for so long, though it should every second, hangs [s]."""
SILENT = {
    RECORDER: "it may be recording nothing",
    "adaptation": "no trial goes on meanwhile",
    "interaction_monitor": "nobody says what case of interaction it is",
}
"""Nodes for which nobody else speaks when they hang, and what that means."""
HANGS = "it hangs, or the machine does not run it"
"""The same of all others: the robot rests without them, but why is not said by who waits for them."""
HEARTBEAT = "simulator: heartbeat"
"""Key of a heartbeat that the controller misses."""
AGAIN_S = 10.0
"""A trouble that comes and goes is told again after so long [s]."""
_STEP_S = 0.1
TOLD_FAULTS = (("adaptation", "guess"), ("adaptation", "hand"))
"""Faults that are told: answers of a person that did not count, who sits there and wonders."""


class GraphHealth:
    """Keeps the newest status of each node.

    Args:
        tell: Takes what must not be missed: a node that stood still, messages that are not recorded.
    """

    def __init__(self, tell: Callable[[str], None]) -> None:
        self._tell = tell
        self._heard: dict[tuple[str, str], str] = {}
        self._statuses: dict[str, DiagnosticStatus] = {}
        self._stood: set[str] = set()
        self._troubles: set[str] = set()
        self._told_s: dict[str, float] = {}
        self._silent_s: defaultdict[str, float] = defaultdict(float)
        self._looked_s: float | None = None

    def take(self, statuses: Sequence[DiagnosticStatus], now_s: float, *, begun: bool) -> None:
        """Note what nodes say.

        Args:
            statuses: What came on /diagnostics.
            now_s: Time of any clock that does not jump [s].
            begun: Whether the run has begun: before that, nodes stand still while they load.
        """
        for status in statuses:
            name = status.hardware_id
            self._statuses[name] = status
            self._silent_s[name] = 0.0
            if name == RECORDER:
                self._tell_troubles(status, now_s)
            elif NO_HEARTBEAT in status.message and begun:
                self._tell_heartbeat(now_s)
            self._tell_fault(status)
            if STANDSTILL in status.message and name not in self._stood and begun:
                self._stood.add(name)
                self._tell(f"{name}: {status.message}")

    def forget(self, label: str) -> None:
        """Drop what a node has said: it is started again."""
        self._statuses.pop(label, None)
        self._heard = {key: text for key, text in self._heard.items() if key[0] != label}
        self._stood.discard(label)

    def look(self, now_s: float, running: Collection[str]) -> None:
        """Notice nodes that have fallen silent; call it often.

        Args:
            now_s: Time of any clock that does not jump [s].
            running: Names of the nodes that run, and are not stopped by a signal.
        """
        # A process that was itself not run for a while has not listened either.
        passed_s = 0.0 if self._looked_s is None else min(now_s - self._looked_s, _STEP_S)
        self._looked_s = now_s
        for name in self._statuses.keys() & set(running):
            before_s = self._silent_s[name]
            self._silent_s[name] += passed_s
            if before_s <= SILENT_S < self._silent_s[name]:
                self._tell(
                    f"{name} has said nothing for {SILENT_S:.0f} s: {SILENT.get(name, HANGS)}"
                )

    def missing(
        self,
        labels: Collection[str],
        recorded: Sequence[str],
        *,
        patient: bool,
        past: bool = True,
    ) -> set[str]:
        """Nodes that are not ready.

        Args:
            labels: Nodes that there should be.
            recorded: Topics that the recorder must have heard.
            patient: Whether a node that only warns is waited for. A recorder that misses messages which
                were lost on the way is not: that is never over, and it records.
            past: Whether a node that still tells of a fault which is over is waited for, too.
        """
        if not patient:
            return set(labels) - self._statuses.keys()
        level = _level if past else _level_now
        well = {name for name, s in self._statuses.items() if level(s) == DiagnosticStatus.OK}
        recorder = self._statuses.get(RECORDER)
        if recorder and recorder.level == DiagnosticStatus.WARN and _kinds(recorder) == {TRANSPORT}:
            well.add(RECORDER)
        if RECORDER in well and not hears(self._statuses[RECORDER], recorded):
            well.remove(RECORDER)
        return set(labels) - well

    @property
    def holds(self) -> bool:
        """Whether all that the simulator warns of is that its robot was stopped, or that it is touched.

        It says so until the next motion, or until whoever leans on the robot goes.
        """
        status = self._statuses.get(SIMULATOR)
        if status is None or NO_HEARTBEAT in status.message:
            return False
        if status.message == TOUCHED:
            return True
        return any(item.key == "controller" and item.value == STOPPING for item in status.values)

    def _tell_fault(self, status: DiagnosticStatus) -> None:
        name = status.hardware_id
        for node, fault in TOLD_FAULTS:
            if node != name:
                continue
            key = f"fault {fault}"
            text = next((item.value for item in status.values if item.key == key), "")
            if text and text != self._heard.get((name, key)):
                self._tell(f"{name}: {text}")
            self._heard[name, key] = text

    def _tell_heartbeat(self, now_s: float) -> None:
        """The controller hears no heartbeat: nothing else that is said of the robot's rest is why."""
        if now_s - self._told_s.get(HEARTBEAT, -AGAIN_S) < AGAIN_S:
            return
        self._told_s[HEARTBEAT] = now_s
        sender = MONITOR if MONITOR in self._statuses else "the node that moves the robot"
        self._tell(
            f"the controller hears no heartbeat of {sender} (/separation/speed_scale): "
            "the robot rests because of it"
        )

    def _tell_troubles(self, status: DiagnosticStatus, now_s: float) -> None:
        kinds = _kinds(status)
        news = {
            kind
            for kind in kinds - self._troubles
            if now_s - self._told_s.get(kind, -AGAIN_S) >= AGAIN_S
        }
        if news:
            self._tell(f"{RECORDER}: {status.message}")
            self._told_s |= dict.fromkeys(kinds, now_s)
        self._troubles = kinds


def _level(status: DiagnosticStatus) -> bytes:
    """What a node says of the last seconds."""
    level: bytes = status.level
    return level


def _level_now(status: DiagnosticStatus) -> bytes:
    """The same of this moment."""
    level = next((int(item.value) for item in status.values if item.key == LEVEL_NOW), None)
    return _level(status) if level is None else level.to_bytes(1, "little")


def _kinds(recorder: DiagnosticStatus) -> set[str]:
    """The troubles that a recorder has, by kind."""
    values = {item.key: item.value for item in recorder.values}
    return set(values.get(TROUBLES, "").split())
