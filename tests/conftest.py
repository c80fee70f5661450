"""Which tests run alone, and which of them say nothing on a machine that is too slow for them."""

from __future__ import annotations

import time
from collections.abc import Generator
from pathlib import Path
from statistics import median

import pytest
from hypothesis import settings

# What an example takes depends on what is compiled, loaded or run beside it: no bar of a test.
settings.register_profile("no deadline", deadline=None)
settings.load_profile("no deadline")

HERE = Path(__file__).parent
ALONE = (
    "hri_planner/ros",
    "hri_prediction/live",
    "hri_prediction/ros",
    "hri_sim/health",
    "hri_sim/launch",
    "hri_sim/recording",
    "launch",
)
"""Folders of tests that nodes or clocks have a part in, which other load would disturb; ``scripts/test``
runs all others in several processes."""
REAL_TIME = ("launch",)
"""Folders of those in which a whole graph runs in real time, which takes most of two cores."""
ADDITIONS = 10_000_000
SLOW_S = 1.1
"""So many additions in a loop take 0.7 s of processor time on the machines that bars of real time are for.
Where they take longer than this the graph lacks the time that it needs, and rests for want of it [s]."""
UNJUDGED = pytest.StashKey[list[tuple[str, str]]]()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark them."""
    for item in items:
        if _is_in(item, ALONE):
            item.add_marker(pytest.mark.alone)


def _is_in(item: pytest.Item, folders: tuple[str, ...]) -> bool:
    folder = item.path.parent.relative_to(HERE).as_posix()
    return any(folder == one or folder.startswith(f"{one}/") for one in folders)


def loop_s() -> float:
    """Processor time that a loop of additions takes, the median of five [s].

    Not the time that passes: what the test has started still runs, and a graph that keeps the processors
    busy must not make a machine seem slow.
    """
    found = []
    for _ in range(5):
        begin, total = time.thread_time(), 0
        for number in range(ADDITIONS):
            total += number
        found.append(time.thread_time() - begin)
    return median(found)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """A test in real time that fails on a machine that is too slow is not judged, and told at the end."""
    report = yield
    if report.failed and _is_in(item, REAL_TIME) and (seconds := loop_s()) > SLOW_S:
        words = f"{ADDITIONS:,} additions take {seconds:.2f} s, {SLOW_S} s at most are wanted"
        item.config.stash.setdefault(UNJUDGED, []).append((item.nodeid, report.longreprtext))
        report.outcome = "skipped"
        report.longrepr = (str(item.path), 0, f"not judged: too slow a machine: {words}")
    return report


def pytest_terminal_summary(
    terminalreporter: pytest.TerminalReporter, config: pytest.Config
) -> None:
    """Name what was not judged, with all that was said of it."""
    found = config.stash.get(UNJUDGED, [])
    for name, text in found:
        terminalreporter.section(f"not judged: {name}")
        terminalreporter.line(text)
    if found:
        terminalreporter.section("not judged, as this machine is too slow for them")
        for name, _ in found:
            terminalreporter.line(name)
