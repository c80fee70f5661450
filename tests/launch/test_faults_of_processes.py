"""Lines of the table of faults with real processes, each once."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from hri_sim.faults.catalogue import FAULTS
from hri_sim.faults.processes import PROCESS_FAULTS
from hri_sim.faults.sources import MOCAP_LIVE
from hri_sim.reliability.fault import Fault, Place, Result, Skipped, Stays

NAMES = (
    *(fault.name for fault in PROCESS_FAULTS),
    "disk_full",
    "unwritable_folder",
    "recorder_rate",
)
"""Those of one graph follow each other: it is started once."""
BY_NAME = {fault.name: fault for fault in FAULTS}


@pytest.fixture(scope="module")
def stays() -> Iterator[dict[str, Stays]]:
    """A graph that serves several tests."""
    open_: dict[str, Stays] = {}
    yield open_
    for one in open_.values():
        one.close()


@pytest.fixture(scope="module")
def keep(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Its folder, and its library."""
    return tmp_path_factory.mktemp("runs") / "libraries"


@pytest.mark.parametrize("fault", [BY_NAME[name] for name in NAMES], ids=lambda fault: fault.name)
def test_a_line(fault: Fault, stays: dict[str, Stays], keep: Path, tmp_path: Path) -> None:
    place = Place(tmp_path, keep, smoke=True, stays=stays)
    if fault.name.endswith(MOCAP_LIVE):
        pytest.importorskip("qtm_rt")
    try:
        result = Result(fault, tuple(fault.measure([0], place)))
    except Skipped as error:
        pytest.skip(str(error))
    assert result.met, "\n".join(result.misses())
