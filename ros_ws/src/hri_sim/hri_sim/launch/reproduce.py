"""Command lines of ``scripts/reproduce_demo.py`` and ``scripts/reproduce_replay.py``."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from hri_prediction.errors import ConfigError, HriError
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.prediction.training import seated, train
from hri_prediction.tracks.files import load_tracks, save_tracks
from hri_prediction.tracks.selection import nominal_reaches
from hri_prediction.tracks.track import ArmTrack
from hri_sim.launch.coverage import Coverage, prediction_coverage
from hri_sim.launch.folder import NewFolder
from hri_sim.launch.origin import origin_line, results_origin
from hri_sim.launch.run import RunOptions, RunResult, explain, run_graph
from hri_sim.launch.summary import late_replans, number
from hri_sim.media.picture import draw_picture

DATA_VARIABLE = "HRI_DATA_DIR"


def _of_all(
    choose: Callable[[list[float]], float], reaches: list[dict[str, Any]], key: str
) -> float | None:
    """Largest or smallest figure of all reaches; none when that of one of them is not known."""
    values = [reach[key] for reach in reaches]
    return choose(values) if values and None not in values else None


def demo_row(seed: int, summary: dict[str, Any]) -> str:
    """One line of the demo table."""
    reaches = summary["reaches"]
    cells = (
        str(seed),
        summary["outcome"],
        number(_of_all(max, reaches, "goal_error_m"), ".1f", 1e3),
        number(_of_all(min, reaches, "min_clearance_m"), ".1f", 100.0),
        number(summary["baseline_min_clearance_m"], ".1f", 100.0),
        " / ".join(f"{reach['duration_s']:.1f}" for reach in reaches),
        number(_of_all(max, reaches, "max_handover_jump_rad"), ".1e"),
        "{} of {}".format(*late_replans(reaches)),
        number(summary["latency_ms"]["mocap_to_trajectory"]["p99"], ".0f"),
    )
    return "| " + " | ".join(cells) + " |"


DEMO_HEAD = (
    "| seed | outcome | worst goal error [mm] | least clearance [cm] | baseline [cm] | times [s] "
    "| worst jump [rad] | late replans | mocap → trajectory p99 [ms] |\n"
    "| --- | --- | --- | --- | --- | --- | --- | --- | --- |"
)


def reproduce_demo(
    out: Annotated[Path, typer.Option(help="Folder for demo.md and demo.json.")] = Path(
        "docs/results"
    ),
    runs: Annotated[Path, typer.Option(help="Folder for the runs; new or empty.")] = Path(
        "runs/reproduce_demo"
    ),
    seeds: Annotated[int, typer.Option(help="Number of seeds.", min=1)] = 10,
    first_seed: Annotated[int, typer.Option(help="First seed.", min=0)] = 100,
) -> None:
    """Run the demo for several seeds and write the table of all of them."""
    console = Console()
    try:
        _make(out)
        NewFolder(runs, "--runs")
        origin = results_origin()
        summaries = {}
        for seed in range(first_seed, first_seed + seeds):
            console.print(f"seed {seed}", highlight=False)
            result = run_graph(RunOptions(out=runs / str(seed), seed=seed), console)
            if result.series is not None:
                draw_picture(result.series.record, runs / str(seed) / "picture.png")
            summaries[seed] = {**result.summary, "bag": "bag", "cpu_cores": result.cpu_cores}
            console.print(demo_row(seed, result.summary), highlight=False, markup=False)
    except HriError as error:
        explain(error, console)
        raise typer.Exit(1) from error
    write_demo(out, origin, summaries)
    console.print(f"table: {out / 'demo.md'}", highlight=False)


def write_demo(out: Path, origin: dict[str, Any], summaries: dict[int, dict[str, Any]]) -> None:
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
            "Made by `scripts/reproduce_demo.py`: three reaches a seed in the live graph. Clearance is "
            "the smallest true distance between robot and arm from the cue of the first reach to the "
            "end; the baseline is the same scene and person without replanning.",
            "",
            origin_line(origin),
            "",
            DEMO_HEAD,
            *(demo_row(seed, summary) for seed, summary in summaries.items()),
            "",
            f"{reached} of {3 * len(summaries)} reaches reached, {clear} with true clearance > 0 "
            f"throughout; {misses} of {planned} replans late "
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


@dataclass(frozen=True)
class ReplayCase:
    """One recording to replay, and what the predictor may learn from.

    Attributes:
        name: Short name.
        track: The recording.
        training: Recordings of others.
        task_from: What names the tasks of the library.
    """

    name: str
    track: ArmTrack
    training: list[ArmTrack]
    task_from: str


def dfki_cases(folder: Path, count: int) -> list[ReplayCase]:
    """Pick-and-place runs; the library learns from the other runs, cut into reaches."""
    files = sorted((folder / "pickplace_dfki_qualisys" / "original").glob("*.tsv"))
    tracks = [track for file in files for track in load_tracks(file)]
    # Spread over both subjects.
    chosen = tracks[:: max(len(tracks) // count, 1)][:count]
    return [
        ReplayCase(
            f"dfki_{track.subject}_{track.trial}".replace(" ", "_"),
            track,
            [other for other in tracks if other is not track],
            "movement",
        )
        for track in chosen
    ]


def vicon_cases(folder: Path, count: int) -> list[ReplayCase]:
    """Seated reaches, one a subject; the library learns from the other subjects."""
    tracks = load_tracks(folder / "reach_adl_vicon" / "reach.npz")
    groups = nominal_reaches(tracks)
    subjects = sorted({track.subject for track in tracks})
    cases = []
    for index, subject in enumerate(subjects[:count]):
        # Alternate over tasks and sides.
        own = [group for key, group in sorted(groups.items()) if key[0] == subject]
        track = own[index % len(own)][0]
        others = [t for key, group in groups.items() if key[0] != subject for t in group]
        cases.append(
            ReplayCase(f"vicon_{subject}_{track.task}_{track.side}", track, others, "task")
        )
    return cases


def run_replay(
    case: ReplayCase, folder: Path, seed: int, console: Console
) -> tuple[RunResult, Coverage | None]:
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
    if result.series is None:
        return result, None
    draw_picture(result.series.record, folder / "picture.png")
    return result, prediction_coverage(result.bag, "person1")


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
    outcome = summary["outcome"]
    if outcome != "reached":
        outcome += ": " + next(r["reason"] for r in reaches if r["outcome"] != "reached")
    cells = (
        name,
        outcome,
        f"{reached} of {len(reaches)}",
        number(_of_all(min, reaches, "min_clearance_m"), ".1f", 100.0),
        number(summary["baseline_min_clearance_m"], ".1f", 100.0),
        *shares,
    )
    return "| " + " | ".join(cells) + " |"


def reproduce_replay(
    out: Annotated[Path, typer.Option(help="Folder for replay.md and replay.json.")] = Path(
        "docs/results"
    ),
    runs: Annotated[Path, typer.Option(help="Folder for the runs; new or empty.")] = Path(
        "runs/reproduce_replay"
    ),
    dfki: Annotated[int, typer.Option(help="Pick-and-place runs to replay.", min=0)] = 5,
    vicon: Annotated[int, typer.Option(help="Seated reaches to replay.", min=0)] = 10,
    seed: Annotated[int, typer.Option(help="Seed of the robot's scenes.", min=0)] = 0,
) -> None:
    """Replay real recordings through the live graph, libraries trained on other runs or subjects.

    Finds the recordings through HRI_DATA_DIR.
    """
    console = Console()
    if not os.environ.get(DATA_VARIABLE):
        console.print(f"skipped: {DATA_VARIABLE} does not say where the recordings are")
        raise typer.Exit(0)
    data = Path(os.environ[DATA_VARIABLE])
    try:
        if not data.is_dir():
            raise ConfigError(f"{DATA_VARIABLE} = {data}", expected="a folder with recordings")
        _make(out)
        NewFolder(runs, "--runs")
        origin = results_origin()
        results: dict[str, Any] = {}
        table = []
        for index, case in enumerate(dfki_cases(data, dfki) + vicon_cases(data, vicon)):
            console.print(case.name, highlight=False)
            result, coverage = run_replay(case, runs / case.name, seed + index, console)
            table.append(replay_row(case.name, result.summary, coverage))
            console.print(table[-1], highlight=False, markup=False)
            results[case.name] = {
                **result.summary,
                "bag": "run/bag",
                "coverage": None if coverage is None else vars(coverage),
            }
    except HriError as error:
        explain(error, console)
        raise typer.Exit(1) from error
    write_replay(out, origin, results, table)
    console.print(f"table: {out / 'replay.md'}", highlight=False)


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
