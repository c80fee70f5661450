"""Signals that take effect only where they can do no harm."""

from __future__ import annotations

import signal


class HeldSignals:
    """Holds SIGINT and SIGTERM back until :meth:`release`, as far as they have handlers.

    The handlers raise. Within rclpy's C++ part that may come out as an error of another kind.
    """

    def __init__(self) -> None:
        self._come: list[int] = []
        present = {n: signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)}
        self._handlers = {n: handler for n, handler in present.items() if callable(handler)}
        for number in self._handlers:
            signal.signal(number, self._hold)

    def _hold(self, number: int, frame: object) -> None:
        self._come.append(number)

    def release(self) -> None:
        """Call the handler of the first that has come; the others have no effect any more."""
        if self._come:
            number = signal.Signals(self._come[0])
            self._come.clear()
            self._handlers[number](number, None)

    def restore(self) -> None:
        """Put the handlers back, unless they were replaced meanwhile."""
        for number, handler in self._handlers.items():
            if signal.getsignal(number) == self._hold:
                signal.signal(number, handler)
