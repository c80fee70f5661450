"""Command lines of ``scripts/reproduce_demo.py`` and ``scripts/reproduce_replay.py``."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from hri_prediction.errors import ConfigError, HriError
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.prediction.training import seated, train
from hri_prediction.results.origin import origin_line, results_origin
from hri_prediction.tracks.files import save_tracks
from hri_sim.launch.coverage import Coverage, prediction_coverage
from hri_sim.launch.replay_cases import DATA_VARIABLE, ReplayCase, dfki_cases, vicon_cases
from hri_sim.launch.rows import KeptRows, Row, failures, outcome_cell
from hri_sim.launch.run import RunOptions, RunResult, run_graph
from hri_sim.launch.summary import late_replans, number
from hri_sim.launch.telling import explain
from hri_sim.media.picture import draw_picture

RESULTS = Path("docs/results")


def _of_all(
    choose: Callable[[list[float]], float], reaches: list[dict[str, Any]], key: str
) -> float | None:
    """Largest or smallest figure of all reaches; none when that of one of them is not known."""
    values = [reach[key] for reach in reaches]
    return choose(values) if values and None not in values else None


def demo_row(seed: int, summary: dict[str, Any]) -> str:
    """One line of the demo table."""
    reaches = summary["reaches"]
    latency = summary.get("latency_ms", {}).get("mocap_to_trajectory", {}).get("p99")
    cells = (
        str(seed),
        outcome_cell(summary),
        number(_of_all(max, reaches, "goal_error_m"), ".1f", 1e3),
        number(_of_all(min, reaches, "min_clearance_m"), ".1f", 100.0),
        number(summary.get("baseline_min_clearance_m"), ".1f", 100.0),
        " / ".join(f"{reach['duration_s']:.1f}" for reach in reaches),
        number(_of_all(max, reaches, "max_handover_jump_rad"), ".1e"),
        "{} of {}".format(*late_replans(reaches)),
        number(latency, ".0f"),
    )
    return "| " + " | ".join(cells) + " |"


DEMO_HEAD = (
    "| seed | outcome | worst goal error [mm] | least clearance [cm] | baseline [cm] | times [s] "
    "| worst jump [rad] | late replans | mocap → trajectory p99 [ms] |\n"
    "| --- | --- | --- | --- | --- | --- | --- | --- | --- |"
)


def reproduce_demo(
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder for demo.md and demo.json. Default: docs/results; smoke: --runs."
        ),
    ] = None,
    runs: Annotated[
        Path | None,
        typer.Option(
            help="Folder for the runs; with runs of the same commit in it, only what is missing or "
            "failed is run. Default: runs/reproduce_demo; smoke: runs/smoke_demo."
        ),
    ] = None,
    seeds: Annotated[int, typer.Option(help="Number of seeds.", min=1)] = 10,
    first_seed: Annotated[int, typer.Option(help="First seed.", min=0)] = 100,
    smoke: Annotated[bool, typer.Option("--smoke", help="One seed, one reach: for CI.")] = False,
) -> None:
    """Run the demo for several seeds and write the table of all of them.

    The table is written after each. A run that fails is a row with its cause; the exit code is 1 then.
    """
    console = Console()
    reaches = 1 if smoke else 3
    runs = runs or Path("runs/smoke_demo" if smoke else "runs/reproduce_demo")
    out = out or (runs if smoke else RESULTS)
    rows: dict[int, Row] = {}
    try:
        origin = results_origin()
        kept = KeptRows(runs, origin, console)
        _make(out)
    except HriError as error:
        explain(error, console)
        raise typer.Exit(1) from error
    for seed in range(first_seed, first_seed + (1 if smoke else seeds)):
        console.print(f"seed {seed}", highlight=False)
        options = {"seed": seed, "reaches": reaches}
        make = partial(run_demo, console=console, seed=seed, reaches=reaches)
        rows[seed] = kept.row(str(seed), options, make)
        console.print(demo_row(seed, rows[seed]), highlight=False, markup=False)
        write_demo(out, origin, rows, reaches)
    _finish(out / "demo.md", rows, console)


def run_demo(folder: Path, console: Console, *, seed: int, reaches: int) -> Row:
    """Run the demo of one seed."""
    result = run_graph(RunOptions(out=folder, seed=seed, reaches=reaches), console)
    if result.series is not None:
        draw_picture(result.series.record, folder / "picture.png")
    return {**_figures(result), "bag": "bag", "cpu_cores": result.cpu_cores}


def _figures(result: RunResult) -> Row:
    """The summary of a run; its origin is that of the whole table."""
    return {name: value for name, value in result.summary.items() if name != "origin"}


def _finish(table: Path, rows: dict[Any, Row], console: Console) -> None:
    """Say where the table is.

    Raises:
        typer.Exit: with code 1 when a run failed.
    """
    console.print(f"table: {table}", highlight=False, markup=False, soft_wrap=True)
    if failed := failures(rows):
        text = (
            f"{failed} of {len(rows)} runs failed; the same command runs them again, and only them"
        )
        console.print(text, highlight=False, soft_wrap=True)
        raise typer.Exit(1)


def write_demo(
    out: Path, origin: dict[str, Any], summaries: dict[int, dict[str, Any]], reaches_each: int = 3
) -> None:
    """``demo.json`` and ``demo.md`` of the summaries by seed."""
    content = {"origin": origin, "seeds": summaries}
    (out / "demo.json").write_text(json.dumps(content, indent=1, allow_nan=False) + "\n")
    reaches = [reach for summary in summaries.values() for reach in summary["reaches"]]
    misses, planned = late_replans(reaches)
    reached = sum(reach["outcome"] == "reached" for reach in reaches)
    clear = sum((reach["min_clearance_m"] or -1.0) > 0.0 for reach in reaches)
    text = "\n".join(
        [
            "# The demo, seed by seed",
            "",
            f"Made by `scripts/reproduce_demo.py`; reaches a seed in the live graph: {reaches_each}. "
            "Clearance is the smallest true distance between robot and arm from the cue of the first "
            "reach to the end; the baseline is the same scene and person without replanning.",
            "",
            origin_line(origin),
            "",
            DEMO_HEAD,
            *(demo_row(seed, summary) for seed, summary in summaries.items()),
            "",
            f"{reached} of {reaches_each * len(summaries)} reaches reached, {clear} with true "
            f"clearance > 0 throughout; {misses} of {planned} replans late "
            f"({100.0 * misses / max(planned, 1):.2f} %).",
            "",
        ]
    )
    (out / "demo.md").write_text(text)


def _make(out: Path) -> None:
    """Make the folder for results before hours are spent on them."""
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(
            f"cannot make --out {out}: {error.strerror}", hint="choose another with --out"
        ) from error


def run_replay(folder: Path, console: Console, *, case: ReplayCase, seed: int) -> Row:
    """Train, replay, measure."""
    folder.mkdir(parents=True)
    recording = folder / "recording.npz"
    save_tracks(recording, [case.track])
    library = folder / "library.npz"
    same_side = [track for track in case.training if track.side == case.track.side]
    settings = PredictorConfig(min_demonstrations=3)
    people = [seated(track, "auto") for track in same_side or case.training]
    train(people, settings, group_by=case.task_from).library.save(library)
    options = RunOptions(
        out=folder / "run", seed=seed, human="replay", human_file=recording, library=library
    )
    result = run_graph(options, console)
    coverage = None
    if result.series is not None:
        draw_picture(result.series.record, folder / "picture.png")
        coverage = prediction_coverage(result.bag, "person1")
    return {
        **_figures(result),
        "bag": "run/bag",
        "coverage": None if coverage is None else vars(coverage),
    }


REPLAY_HEAD = (
    "| recording | outcome | reaches | least clearance [cm] | baseline [cm] | 50 % region | 95 % region "
    "| median error [cm] |\n| --- | --- | --- | --- | --- | --- | --- | --- |"
)


def replay_row(name: str, summary: dict[str, Any], coverage: Coverage | None) -> str:
    """One line of the replay table."""
    reaches = summary["reaches"]
    reached = sum(reach["outcome"] == "reached" for reach in reaches)
    shares = ("–", "–", "–")
    if coverage is not None:
        shares = (
            f"{coverage.share_50 * 100:.0f} %",
            f"{coverage.share_95 * 100:.0f} %",
            f"{coverage.error_m * 100:.1f}",
        )
    cells = (
        name,
        outcome_cell(summary),
        f"{reached} of {len(reaches)}",
        number(_of_all(min, reaches, "min_clearance_m"), ".1f", 100.0),
        number(summary.get("baseline_min_clearance_m"), ".1f", 100.0),
        *shares,
    )
    return "| " + " | ".join(cells) + " |"


def reproduce_replay(
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder for replay.md and replay.json. Default: docs/results; smoke: --runs."
        ),
    ] = None,
    runs: Annotated[
        Path | None,
        typer.Option(
            help="Folder for the runs; with runs of the same commit in it, only what is missing or "
            "failed is run. Default: runs/reproduce_replay; smoke: runs/smoke_replay."
        ),
    ] = None,
    dfki: Annotated[int, typer.Option(help="Pick-and-place runs to replay.", min=0)] = 5,
    vicon: Annotated[int, typer.Option(help="Seated reaches to replay.", min=0)] = 10,
    seed: Annotated[int, typer.Option(help="Seed of the robot's scenes.", min=0)] = 0,
    smoke: Annotated[bool, typer.Option("--smoke", help="One seated reach: for CI.")] = False,
) -> None:
    """Replay real recordings through the live graph, libraries trained on other runs or subjects.

    Finds the recordings through HRI_DATA_DIR. The table is written after each. A run that fails is a
    row with its cause; the exit code is 1 then.
    """
    console = Console()
    if not os.environ.get(DATA_VARIABLE):
        console.print(f"skipped: {DATA_VARIABLE} does not say where the recordings are")
        raise typer.Exit(0)
    data = Path(os.environ[DATA_VARIABLE])
    runs = runs or Path("runs/smoke_replay" if smoke else "runs/reproduce_replay")
    out = out or (runs if smoke else RESULTS)
    rows: dict[str, Row] = {}
    try:
        if not data.is_dir():
            raise ConfigError(f"{DATA_VARIABLE} = {data}", expected="a folder with recordings")
        cases = vicon_cases(data, 1) if smoke else dfki_cases(data, dfki) + vicon_cases(data, vicon)
        origin = results_origin()
        kept = KeptRows(runs, origin, console)
        _make(out)
    except HriError as error:
        explain(error, console)
        raise typer.Exit(1) from error
    for index, case in enumerate(cases):
        console.print(case.name, highlight=False)
        make = partial(run_replay, console=console, case=case, seed=seed + index)
        rows[case.name] = kept.row(case.name, {"seed": seed + index}, make)
        table = [
            replay_row(name, row, Coverage(**row["coverage"]) if row.get("coverage") else None)
            for name, row in rows.items()
        ]
        console.print(table[-1], highlight=False, markup=False)
        write_replay(out, origin, rows, table)
    _finish(out / "replay.md", rows, console)


def write_replay(
    out: Path, origin: dict[str, Any], results: dict[str, Any], table: list[str]
) -> None:
    """``replay.json`` of the results by recording, and ``replay.md`` with the rows of its table."""
    content = {"origin": origin, "recordings": results}
    (out / "replay.json").write_text(json.dumps(content, indent=1, allow_nan=False) + "\n")
    text = "\n".join(
        [
            "# Real people, replayed through the live graph",
            "",
            "Made by `scripts/reproduce_replay.py`. `dfki_*`: pick-and-place runs (Gutzeit, "
            "dfki-ric/vMCI_segmentation), library trained on the other runs; `vicon_*`: seated reaches "
            "(MiaH-kin/UE_ADLdatabase), library trained on the other subjects. The robot's scene is drawn "
            "by seed so that its nominal motion collides with the recording; no planner's outcome is "
            "looked at. "
            "Regions and errors: wrist, all horizons, while reaching.",
            "",
            origin_line(origin),
            "",
            REPLAY_HEAD,
            *table,
            "",
        ]
    )
    (out / "replay.md").write_text(text)


def main_demo() -> int:
    """Entry point of reproduce_demo.py."""
    typer.run(reproduce_demo)
    return 0


def main_replay() -> int:
    """Entry point of reproduce_replay.py."""
    typer.run(reproduce_replay)
    return 0
