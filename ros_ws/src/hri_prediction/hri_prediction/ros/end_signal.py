"""SIGINT and SIGTERM end a process that runs nodes without shutting its context down under a callback."""

from __future__ import annotations

import signal


class EndSignal:
    """Takes both signals: interrupts a start-up, asks what runs to end when its turn is over.

    With rclpy's own handlers the messages of a callback that is under way fail.

    Attributes:
        asked: Whether one has come.
        interrupt: Whether one raises :class:`KeyboardInterrupt`.
    """

    def __init__(self) -> None:
        self.asked = False
        self.interrupt = True
        self._before = {
            number: signal.signal(number, self._take) for number in (signal.SIGINT, signal.SIGTERM)
        }

    def _take(self, number: int, frame: object) -> None:
        self.asked = True
        if self.interrupt:
            raise KeyboardInterrupt

    def restore(self) -> None:
        """Put back the handlers that there were."""
        for number, handler in self._before.items():
            signal.signal(number, handler)
