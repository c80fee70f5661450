"""A planner whose computing takes longer than it may, as on a machine that is too slow."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from hri_prediction.ros.node import HriNode


class SlowWorker:
    """Hands each result out long after its job was submitted; stands for the worker of a planner.

    Args:
        node: Whose clock counts.
        delay_s: How long each job takes [s].
    """

    def __init__(self, node: HriNode, delay_s: float) -> None:
        self._node, self._delay_ns = node, round(delay_s * 1e9)
        self._ready_ns: int | None = None
        self._result: Any = None

    @property
    def busy(self) -> bool:
        """Whether a job is being done."""
        return self._ready_ns is not None and self._node.now_ns() < self._ready_ns

    def submit(self, job: Callable[[], Any]) -> None:
        """Begin a job."""
        self._result = job()
        self._ready_ns = self._node.now_ns() + self._delay_ns

    def take(self) -> Any:
        """What came of it; none while it is not done."""
        if self._ready_ns is None or self.busy:
            return None
        self._ready_ns = None
        return self._result

    def close(self) -> None:
        """Nothing to end."""
