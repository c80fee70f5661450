"""A record is readable up to wherever it was cut."""

from __future__ import annotations

from pathlib import Path

import pytest

from hri_prediction.errors import DataError
from hri_sim.soak.log import BEGIN, END, LOG, SAMPLE, SoakLog, read_log


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / LOG
    with SoakLog(path) as log:
        log.write(BEGIN, {"seed": 4})
        for number in range(3):
            log.write(SAMPLE, {"s": number})
        # It is on the disk while the script runs.
        assert len(read_log(path).of(SAMPLE)) == 3
        log.write(END, {"broken": ""})
    return path


def test_a_whole_record(path: Path) -> None:
    record = read_log(path)
    assert record.begin == {"seed": 4}
    assert [row["s"] for row in record.of(SAMPLE)] == [0, 1, 2]
    assert not record.cut
    assert record.of("fault") == []


def test_a_record_that_was_cut(path: Path) -> None:
    whole = path.read_bytes()
    path.write_bytes(whole[: whole.rindex(b"broken")])
    record = read_log(path)
    assert record.cut
    assert len(record.of(SAMPLE)) == 3


@pytest.mark.parametrize(
    "content", [b"", b"{", b"[1]\n", b"5\n", b"no\n", b'{"kind":"sample","s":1}\n', b"\xff\xfe\n"]
)
def test_what_is_no_record(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / LOG
    path.write_bytes(content)
    with pytest.raises(DataError, match="no record of a soak"):
        read_log(path)
    with pytest.raises(DataError, match="cannot read"):
        read_log(tmp_path / "other")
