"""One job at a time; whoever needs its end can wait for it, not for ever."""

import threading

import pytest

from hri_planner.ros.worker import Worker


@pytest.fixture
def worker():
    made: Worker[int] = Worker("test", inline=False)
    yield made
    made.close()


def test_the_end_of_a_job_can_be_waited_for(worker: Worker[int]) -> None:
    go = threading.Event()
    assert worker.wait(0.0), "nothing is under way"
    worker.submit(lambda: int(go.wait(5.0)))
    assert not worker.wait(0.01)
    assert worker.busy
    with pytest.raises(RuntimeError, match="under way"):
        worker.submit(lambda: 2)
    go.set()
    assert worker.wait(5.0)
    assert not worker.busy
    assert worker.take() == 1
    assert worker.take() is None


def test_a_job_that_fails_ends_too(worker: Worker[int]) -> None:
    def fail() -> int:
        raise ValueError("no")

    worker.submit(fail)
    assert worker.wait(5.0)
    with pytest.raises(ValueError, match="no"):
        worker.take()
    worker.submit(lambda: 3)
    assert worker.wait(5.0)
    assert worker.take() == 3


def test_inline_jobs_are_over_at_once() -> None:
    worker: Worker[int] = Worker("test", inline=True)
    worker.submit(lambda: 4)
    assert worker.wait(0.0)
    assert worker.take() == 4
