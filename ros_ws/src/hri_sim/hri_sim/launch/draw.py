"""Command line of ``scripts/draw_run.py``: picture and video of an earlier run, from its bag."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console

from hri_prediction.errors import ConfigError, DataError, HriError
from hri_prediction.files.values import read_json
from hri_prediction.ros.messages import PlannerStatus
from hri_prediction.ros.time import to_ns
from hri_sim.launch.command import draw
from hri_sim.launch.folder import BAG
from hri_sim.launch.record import read_run, status_topic, with_baseline
from hri_sim.launch.reports import ReachReport
from hri_sim.launch.run_bags import RunBags
from hri_sim.launch.scene import SCENARIO
from hri_sim.launch.summary import SUMMARY
from hri_sim.launch.telling import explain, print_line
from hri_sim.media.frames import RunRecord
from hri_sim.scenario.schema import load_scenario

UNKNOWN = "outcome not known"
"""Outcome of a reach of a run that was not summed up."""
_UNDER_WAY = (PlannerStatus.MOVING, PlannerStatus.WAITING, PlannerStatus.STOPPING)

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


def _summary(folder: Path) -> dict[str, Any]:
    path = folder / SUMMARY
    if not path.exists():  # broken off at the worst moment, say
        return {}
    found = read_json(path)
    if not isinstance(found, dict) or not isinstance(found.get("reaches"), list):
        raise DataError(f"{path} holds no reaches", expected="the summary of a run")
    return found


def _bags(folder: Path, summary: dict[str, Any]) -> list[Path]:
    """The bags of a run: in its folder, or where ``--record`` had put them."""
    places = [folder / BAG, Path(summary.get("bag", folder / BAG))]
    for place in places:
        if place.exists():
            # Those that a recorder went on in lie beside the first one, wherever that has been moved to.
            later = [place.with_name(Path(name).name) for name in summary.get("bags", ())[1:]]
            return [place, *(path for path in later if path.exists())]
    raise ConfigError(
        f"{folder} holds no {BAG}",
        expected="the folder of a run: --out of scripts/launch_ptomp.py, launch_rnn.py or demo",
        hint="" if places[1] == places[0] else f"its summary names {places[1]}, which is not there",
    )


def reports_of(bags: RunBags, outcomes: list[str]) -> list[ReachReport]:
    """The reaches of a run as its bags tell them: from cues, and from what the mover of the robot said.

    A reach ends with the last status that the robot was under way to it, which is right to a replan.

    Args:
        bags: Of the run.
        outcomes: Outcomes that the run was summed up with, as far as there are any.

    Returns:
        One report a cue, up to the first reach whose cue is in no bag.
    """
    cues: dict[int, int] = {}
    under_way: list[int] = []
    said = status_topic(bags.topics)
    data = bags.decoded({"/sim/cue", said})
    for _, cue in data["/sim/cue"]:
        cues.setdefault(cue.reach, to_ns(cue.header.stamp))
    for _, status in data[said]:
        if status.stage in _UNDER_WAY:
            under_way.append(to_ns(status.header.stamp))
    times = np.array(under_way, dtype=np.int64)
    reports: list[ReachReport] = []
    while (index := len(reports)) in cues:
        begin, until = cues[index], cues.get(index + 1, np.iinfo(np.int64).max)
        during = times[(times >= begin) & (times < until)]
        end_ns = int(during.max()) if len(during) else begin
        reports.append(
            ReachReport(
                index=index,
                target="",
                outcome=outcomes[index] if index < len(outcomes) else UNKNOWN,
                reason="",
                cue_ns=begin,
                end_ns=end_ns,
                over_ns=end_ns,
                duration_s=(end_ns - begin) * 1e-9,
                replans=0,
            )
        )
    return reports


@dataclass(frozen=True)
class EarlierRun:
    """A run out of its folder.

    Attributes:
        record: What pictures of it are made from, with its baseline.
        missing: What is missing from it, in words.
    """

    record: RunRecord
    missing: tuple[str, ...]


def earlier_run(folder: Path, bag: Path | None = None) -> EarlierRun:
    """Read a run from its folder.

    Args:
        folder: Of the run.
        bag: Bag to take instead of its own, a salvaged one say.

    Raises:
        ConfigError: when it is no folder of a run.
        DataError: when its bag or its summary cannot be read.
    """
    summary = _summary(folder)
    places = _bags(folder, summary) if bag is None else [bag]
    scenario = load_scenario(folder / SCENARIO)
    bags = RunBags.of(places, allow_damaged=True)
    outcomes = [str(reach.get("outcome", UNKNOWN)) for reach in summary.get("reaches", ())]
    known = {name: bags.custom_data.get(name, "?") for name in ("planner", "seed")}
    reports = reports_of(bags, outcomes)
    series = read_run(
        bags,
        scenario,
        reports,
        sensor_delay_s=0.0,
        title=f"{scenario.name} · {known['planner']} · seed {known['seed']}",
    )
    missing = bags.missing()
    if len(reports) < len(scenario.reaches):
        missing.append(
            f"{len(reports)} of {len(scenario.reaches)} reaches begin in what was recorded"
        )
    return EarlierRun(with_baseline(series.record), tuple(missing))


@app.command(context_settings={"help_option_names": ["-h", "--help"]})
def draw_run(
    run: Annotated[Path, typer.Argument(help="Folder of the run: the --out of its launch.")],
    video: Annotated[bool, typer.Option("--video", help="Render video.mp4 as well.")] = False,
    out: Annotated[
        Path | None, typer.Option(help="Where the files go. Default: the run's folder.")
    ] = None,
    bag: Annotated[
        Path | None, typer.Option(help="Bag to draw from, e.g. salvaged. Default: the run's own.")
    ] = None,
) -> None:
    """Draw picture.png, and with --video video.mp4, of an earlier run from its bag.

    Those that are there are replaced. Also draws runs that were broken off, and from bags that were not
    closed or are damaged, as far as they can be read, and says what is missing. The baseline is
    simulated anew.
    """
    console = Console()
    folder = out or run
    try:
        earlier = earlier_run(run, bag)
        for text in earlier.missing:
            print_line(console, text)
        folder.mkdir(parents=True, exist_ok=True)
        files = draw(earlier.record, folder, console, picture=True, video=video)
    except (HriError, OSError) as error:
        explain(error, console)
        raise typer.Exit(1) from error
    for path in files.values():
        console.print(str(path), highlight=False, markup=False, soft_wrap=True)


def main() -> int:
    """Entry point."""
    app(prog_name="draw_run.py")
    return 0
