"""How long messages are in memory alone, and gaps in what the benchmark finds."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from hri_prediction.bags import BagWriter, TopicInfo
from hri_prediction.errors import ConfigError, GraphError
from hri_sim.recording import benchmark
from hri_sim.recording.benchmark import BenchmarkResult, benchmark_recorder, count_gaps
from hri_sim.recording.growth import FileGrowth, longest_unsaved_s

SECOND = 10**9


def test_the_longest_wait_for_the_disk(tmp_path: Path) -> None:
    """Two chunks: received from 10 s and 20 s on, in the file at 10.4 s and 20.7 s."""
    sizes = []
    with BagWriter(tmp_path / "run") as writer:
        channel = writer.add_topic(TopicInfo("/a", "std_msgs/msg/UInt64"))
        for start in (10, 20):
            for index in range(5):
                writer.write(channel, bytes(12), start * SECOND + index)
            sizes.append(writer.size)
            writer.flush()
        sizes.append(writer.size)
    file = tmp_path / "run" / "run_0.mcap"
    header, one, both = sizes
    seen = [
        (9 * SECOND, header),
        (int(10.3 * SECOND), header),
        (int(10.4 * SECOND), one),
        (15 * SECOND, one),  # nothing waits
        (int(20.7 * SECOND), one),
        (int(20.8 * SECOND), both),
        (90 * SECOND, both),
    ]
    assert longest_unsaved_s(seen, file) == pytest.approx(0.7)
    assert longest_unsaved_s(seen[:4], file) == pytest.approx(0.3)
    assert longest_unsaved_s([], file) == 0.0


def test_a_file_is_watched_from_its_beginning(tmp_path: Path) -> None:
    with FileGrowth(tmp_path / "run") as growth, BagWriter(tmp_path / "run") as writer:
        while not growth.seen:
            pass
        size = writer.size
    assert growth.seen[0][1] <= size


def test_gaps_are_runs_of_missing_numbers() -> None:
    for counts, gaps in (
        ([], 0),
        ([1, 1, 1], 0),
        ([0, 0, 1, 2, 1], 1),
        ([1, 0, 1, 0, 0], 2),
        ([0], 1),
    ):
        assert count_gaps(np.array(counts, dtype=np.int64)) == gaps


def test_a_message_on_another_topic_is_no_message(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "run") as writer:
        for index, number in enumerate((0, 3)):
            channel = writer.add_topic(
                TopicInfo(f"/benchmark/topic_{index}", "std_msgs/msg/UInt64MultiArray")
            )
            writer.write(channel, benchmark._payload(number, 64), index)
    assert sorted(benchmark._numbers(tmp_path / "run", 2)) == [0, 3]
    with pytest.raises(GraphError, match=r"message 3 was recorded on /benchmark/topic_1"):
        benchmark._numbers(tmp_path / "run", 3)


@pytest.mark.parametrize(
    ("rate", "seconds", "options"),
    [(0.0, 1.0, {}), (100.0, -1.0, {}), (100.0, 1.0, {"topics": 0})],
)
def test_figures_that_measure_nothing(rate: float, seconds: float, options: dict) -> None:
    with pytest.raises(ConfigError, match=r"numbers above zero"):
        benchmark_recorder(rate, seconds, **options)


@pytest.mark.parametrize("lost", [0, 2])
def test_the_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], lost: int
) -> None:
    asked: list[tuple] = []

    def measure(rate: float, seconds: float, **options: object) -> BenchmarkResult:
        asked.append((rate, seconds, options["folder"]))
        return BenchmarkResult(
            rate, 10, 100, rate, 100 - lost, lost, lost, 0, 0.1, 90.0, 0.5, 2.0, 0.1, 0.6, 9999
        )

    monkeypatch.setattr(benchmark, "benchmark_recorder", measure)
    assert benchmark.main(["--smoke", "--out", str(tmp_path / "out")]) == (3 if lost else 0)
    assert asked == [(5000.0, 1.0, tmp_path / "out")]
    printed = json.loads(capsys.readouterr().out)
    written = json.loads((tmp_path / "out" / "results.json").read_text())
    assert written.pop("origin")["machine"]["cores"] > 0
    assert printed == written
    assert (printed["lost"], printed["gaps"], printed["file_bytes"]) == (lost, lost, 9999)
    assert benchmark.main(["--out", str(tmp_path / "out")]) == 1
    assert "is not empty" in capsys.readouterr().err
    benchmark.main([])
    assert asked[-1] == (5000.0, 60.0, None)
