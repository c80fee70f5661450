"""The hybrid loop beside a predictor: in a process of its own, so that no prediction ever waits for it.

Optimal control, its inverse and learning take milliseconds to a second, and hold the interpreter while they
do. So they are asked for, and what comes of it is fetched when it is there. A question that a newer one of
the same arm overtakes is dropped.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import queue
import subprocess
import sys
import threading
import time
from collections import deque
from multiprocessing.connection import Connection

from hri_prediction.errors import HriError
from hri_prediction.hybrid.loop import Answer, Loop, Question, Rested, Setup
from hri_prediction.hybrid.weight_file import load_process

_MODULE = "hri_prediction.hybrid.background"
_READY, _DONE = "ready", "done"
_NICE = 10
"""The process steps back behind those of the graph."""
_END_S = 3.0
"""So long may it take to end; whoever launches the predictor waits for 5 s."""
_READY_S = 80.0
"""So long may it take to begin: the first time, the model of the arm and kernels are compiled."""
_STALLED_S = 20.0
"""A question is answered within a second; a process that takes longer than that hangs, or gets no time."""
_MOST_WAITING = 100
"""Questions at most that wait to be asked."""


class Background:
    """The loop in a process of its own.

    Two threads carry questions there and answers back, so that neither :meth:`ask` nor :meth:`answers` ever
    waits, whatever the process does. That it is ready is waited for at the begin: what is asked before
    would be answered too late.

    Args:
        setup: What it needs to know.

    Attributes:
        lost: Questions that were not asked, as too many waited.

    Raises:
        DataError: the file of weights cannot be used.
        HriError: the process does not begin.
    """

    def __init__(self, setup: Setup) -> None:
        load_process(setup.weights)  # a file that cannot be used is named now, not in the process
        self.lost = 0
        self._questions: queue.Queue[Question | None] = queue.Queue(_MOST_WAITING)
        self._answers: deque[Answer] = deque()
        self._asked = self._done = 0
        self._heard_s = time.monotonic()
        self._connection, theirs = multiprocessing.Pipe()
        # Not what `multiprocessing` starts: that would run the script anew that this is a part of.
        self._process = subprocess.Popen(
            [sys.executable, "-m", _MODULE, str(theirs.fileno())],
            pass_fds=[theirs.fileno()],
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
            process_group=0,  # Ctrl-C is for whoever started it
        )
        theirs.close()
        self._wait_ready(setup)
        self._carriers = [
            threading.Thread(target=carry, name="hybrid", daemon=True)
            for carry in (self._carry_there, self._carry_back)
        ]
        for carrier in self._carriers:
            carrier.start()

    def _wait_ready(self, setup: Setup) -> None:
        ready = False
        with contextlib.suppress(EOFError, OSError):
            self._connection.send(setup)
            ready = self._connection.poll(_READY_S) and self._connection.recv() == _READY
        if not ready:
            self._process.kill()
            self._process.wait()
            self._connection.close()
            raise HriError(
                f"the process that learns people did not begin (within {_READY_S:.0f} s)",
                hint="what it said, if anything, stands above, on stderr; on a slow or busy machine "
                "compiling takes that long: start it again, and it goes on from what is compiled",
            )

    def _carry_there(self) -> None:
        with contextlib.suppress(OSError):
            while (question := self._questions.get()) is not None:
                self._connection.send(question)
            self._connection.send(None)

    def _carry_back(self) -> None:
        with contextlib.suppress(OSError, EOFError):
            while True:
                found = self._connection.recv()
                self._heard_s = time.monotonic()
                if isinstance(found, Answer):
                    self._answers.append(found)
                else:
                    self._done += found[1]

    def ask(self, question: Question) -> None:
        """Have something done; does not wait."""
        if self._asked == self._done:  # it had nothing to say until now
            self._heard_s = time.monotonic()
        try:
            self._questions.put_nowait(question)
            self._asked += 1
        except queue.Full:
            self.lost += 1

    def answers(self) -> list[Answer]:
        """What came of it since last asked; does not wait."""
        return [self._answers.popleft() for _ in range(len(self._answers))]

    @property
    def pid(self) -> int:
        """Of the process."""
        return self._process.pid

    @property
    def alive(self) -> bool:
        """Whether the process is there."""
        return self._process.poll() is None

    @property
    def stalled(self) -> bool:
        """Whether it has been asked, and said nothing for long."""
        waiting = self._asked > self._done
        return waiting and time.monotonic() - self._heard_s > _STALLED_S

    def close(self) -> None:
        """End the process; what it is at is waited for, for a while."""
        with contextlib.suppress(queue.Full):
            self._questions.put_nowait(None)
        try:
            self._process.wait(_END_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        # Nobody reads any more, so that both end. The number of a connection that is closed under a thread
        # may be another's before the thread writes: it would write there.
        for carrier in self._carriers:
            carrier.join(_END_S)
        if not any(carrier.is_alive() for carrier in self._carriers):
            self._connection.close()


def _work(connection: Connection) -> None:
    """The process: questions first, then what waits to be explained; ends with whoever started it."""
    try:
        setup = connection.recv()
    except EOFError:
        return
    with contextlib.suppress(OSError):
        os.nice(_NICE)
    loop = Loop(setup)
    connection.send(_READY)
    try:
        _serve(loop, connection)
    finally:
        loop.close()  # what could not be kept so far may be kept now


def _serve(loop: Loop, connection: Connection) -> None:
    """Until nobody asks any more."""
    ended = False
    while not ended:
        questions: list[Question | None] = []
        try:
            while not questions or connection.poll():
                if not questions and not connection.poll():
                    found = loop.explain_next()
                    for answer in found:
                        connection.send(answer)
                    if found:
                        continue
                questions.append(connection.recv())
        except (EOFError, OSError):
            ended = True  # what was asked before is still done, and kept
        for question in _still_asked(questions):
            if question is None:
                return
            for answer in loop.answer(question):
                with contextlib.suppress(OSError):
                    connection.send(answer)
        with contextlib.suppress(OSError):
            connection.send((_DONE, len(questions)))


def _still_asked(questions: list[Question | None]) -> list[Question | None]:
    """Without questions of resting arms that a later one has overtaken."""
    newest = {
        (question.person, question.rest.body.side): index
        for index, question in enumerate(questions)
        if isinstance(question, Rested)
    }
    return [
        question
        for index, question in enumerate(questions)
        if not isinstance(question, Rested)
        or newest[question.person, question.rest.body.side] == index
    ]


if __name__ == "__main__":
    _work(Connection(int(sys.argv[1])))
