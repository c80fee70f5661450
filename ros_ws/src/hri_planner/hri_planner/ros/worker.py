"""Work beside the executor: one job at a time, its result fetched on a tick."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

ResultT = TypeVar("ResultT")


class Worker(Generic[ResultT]):
    """Runs jobs in a thread of its own, or at once when ``inline`` (lock-step).

    Args:
        name: Thread name.
        inline: Run each job within :meth:`submit`.
    """

    def __init__(self, name: str, *, inline: bool) -> None:
        self._inline = inline
        self._changed = threading.Condition()
        self._job: Callable[[], ResultT] | None = None
        self._busy = False
        self._closed = False
        self._result: ResultT | None = None
        self._error: BaseException | None = None
        self._thread = None
        if not inline:
            self._thread = threading.Thread(target=self._loop, name=name, daemon=True)
            self._thread.start()

    @property
    def busy(self) -> bool:
        """Whether a job waits or runs."""
        with self._changed:
            return self._busy

    def wait(self, timeout_s: float) -> bool:
        """Wait for the end of the job under way; whether there is none any more."""
        with self._changed:
            return self._changed.wait_for(lambda: not self._busy, timeout_s)

    def submit(self, job: Callable[[], ResultT]) -> None:
        """Hand over a job.

        Raises:
            RuntimeError: when one is under way.
        """
        if self._inline:
            self._run(job)
            return
        with self._changed:
            if self._busy:
                raise RuntimeError("a job is under way")
            self._busy = True
            self._job = job
            self._changed.notify_all()

    def take(self) -> ResultT | None:
        """The result of the last job, once; none while there is none. Raises what the job raised."""
        with self._changed:
            result, self._result = self._result, None
            error, self._error = self._error, None
        if error is not None:
            raise error
        return result

    def close(self) -> None:
        """End the thread; waits for a running job."""
        if self._thread is None:
            return
        with self._changed:
            self._closed = True
            self._changed.notify()
        self._thread.join(timeout=5.0)

    def _loop(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._job is not None or self._closed)
                if self._closed:
                    return
                job, self._job = self._job, None
            assert job is not None
            self._run(job)

    def _run(self, job: Callable[[], ResultT]) -> None:
        result: ResultT | None = None
        error: BaseException | None = None
        try:
            result = job()
        except Exception as raised:  # handed to the node, which decides
            error = raised
        with self._changed:
            self._result, self._error = result, error
            self._busy = False
            self._changed.notify_all()
