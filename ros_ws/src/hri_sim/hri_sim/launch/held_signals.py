"""Signals that take effect only where they can do no harm."""

from __future__ import annotations

import signal

from hri_prediction.closing import Closing


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

    @property
    def waiting(self) -> tuple[int, ...]:
        """Those that have come since the last :meth:`release`."""
        return tuple(self._come)

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


class EndingSignals(Closing):
    """Lets SIGINT and SIGTERM only hurry the end of a run, from :meth:`begin` on.

    Who presses Ctrl-C again wants it to be over sooner, not to lose the recording. A context manager:
    at its end the signals have their former effect.
    """

    def __init__(self) -> None:
        present = {n: signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)}
        self._handlers = {n: handler for n, handler in present.items() if callable(handler)}
        self._come: list[int] = []

    @property
    def count(self) -> int:
        """How many have come since the end began."""
        return len(self._come)

    def begin(self, waiting: tuple[int, ...] = ()) -> None:
        """The end begins.

        Args:
            waiting: Those that have come meanwhile and had no effect.
        """
        self._come.extend(waiting)
        for number in self._handlers:
            if signal.getsignal(number) != signal.SIG_IGN:  # as a handler may want after the first
                signal.signal(number, self._note)

    def _note(self, number: int, frame: object) -> None:
        self._come.append(number)

    def pass_on(self) -> None:
        """Let the first that came have its effect, now that nothing is lost by it."""
        if self._come:
            self.close()
            number = signal.Signals(self._come[0])
            self._handlers[number](number, None)

    def close(self) -> None:
        """Every signal has its handler again."""
        for number, handler in self._handlers.items():
            if signal.getsignal(number) == self._note:
                signal.signal(number, handler)
