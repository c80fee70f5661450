"""Command line of ``scripts/reproduce_prediction.py``: every evaluation of the documentation."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from hri_prediction.errors import ConfigError
from hri_prediction.evaluation.folds import LEAVE_ONE_OUT, NEW_TASK, OURS, WITHIN
from hri_prediction.evaluation.report import (
    BOUNDARY_HEAD,
    UNNOTICED,
    belief_words,
    boundary_row,
    knowledge_list,
    observed_table,
    predictor_table,
    region_table,
    winners,
)
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.results.origin import available_cores, origin_line, results_origin
from hri_prediction.tracks.boundaries import match_boundaries, pooled
from hri_prediction.tracks.files import load_tracks
from hri_prediction.tracks.labels import onset_labels, segment_labels, whole_movements
from hri_prediction.tracks.segmentation import SegmentationConfig, find_reaches
from hri_sim.evaluation.bars import bar_lines
from hri_sim.evaluation.evaluate import AUTO, SIMULATED, Job, run_job
from hri_sim.evaluation.unknown_targets import unknown_target_lines
from hri_sim.people.population import FAMILIES

DATA_VARIABLE = "HRI_DATA_DIR"
ADL = "reach_adl_vicon/reach.npz"
RUNS = "pickplace_dfki_qualisys/runs.npz"
OBSERVED = (0.1, 0.2, 0.3, 0.35, 0.4, 0.5, 0.6, 0.7, 0.8)
MIN_DEMONSTRATIONS = 3
"""Unlabelled movements that were seen fewer times make no task, as in reproduce_replay.py."""
PLOTS = ("error.png", "calibration.png")
EXAMPLE_PLOT = "tubes.png"
BETTER = "Better than ours (`…_told_duration` and `…_told_task` know what ours must find out):"
_TITLES = {
    "adl": "Seated reaches (ADL Vicon, 10 subjects)",
    "dfki": "Pick and place (DFKI, 2 subjects), reaches cut from continuous recordings",
    "matched": "Simulated people",
    "other_lengths": "Simulated people with shorter or longer arms",
    "via_points": "Simulated people who reach in two overlapping movements",
    "changed_mind": "Simulated people who change to another target on the way",
    "minimum_jerk": "Simulated people who move along plain minimum-jerk lines",
}


def recordings_folder() -> Path | None:
    """The folder of recordings by others, if there is one.

    Raises:
        ConfigError: when the variable names something else.
    """
    name = os.environ.get(DATA_VARIABLE)
    if name and not Path(name).is_dir():
        raise ConfigError(f"{DATA_VARIABLE} = {name}", expected="a folder with recordings")
    return Path(name) if name else None


def jobs(folder: Path | None, seed: int, smoke: bool) -> tuple[dict[str, Job], list[str]]:
    """All evaluations by name, and a line for each that the recordings are missing for."""
    config = PredictorConfig()
    simulated = Job(SIMULATED, FAMILIES[0], WITHIN, OBSERVED, config, AUTO, seed, smoke)
    chosen: dict[str, Job] = {}
    skipped = []
    # A smoke test sees too few reaches for any to be frequent.
    often = config if smoke else replace(config, min_demonstrations=MIN_DEMONSTRATIONS)
    for name, file, settings in (("adl", ADL, config), ("dfki", RUNS, often)):
        reason = missing(folder, file)
        if reason:
            skipped.append(f"{_TITLES[name]}: {reason}")
            continue
        # Pick and place has no names of tasks, by which one could be left out.
        for protocol in (WITHIN, LEAVE_ONE_OUT, *((NEW_TASK,) if name == "adl" else ())):
            chosen[f"{name}_{protocol}"] = replace(
                simulated, data=str(folder and folder / file), protocol=protocol, config=settings
            )
    chosen[f"matched_{WITHIN}"] = simulated
    chosen[f"matched_{NEW_TASK}"] = replace(simulated, protocol=NEW_TASK)
    for family in FAMILIES:
        chosen[f"{family}_{LEAVE_ONE_OUT}"] = replace(
            simulated, people=family, protocol=LEAVE_ONE_OUT
        )
    return chosen, skipped


def plots_of(name: str) -> tuple[str, ...]:
    """The plots of an evaluation that the report shows; examples only of the seated reaches."""
    return (*PLOTS, EXAMPLE_PLOT) if name.startswith("adl") else PLOTS


def missing(folder: Path | None, file: str) -> str:
    """Why a recording cannot be used; empty when it can."""
    if folder is None:
        return f"{DATA_VARIABLE} does not say where the recordings are"
    return "" if (folder / file).is_file() else f"{DATA_VARIABLE} holds no {file}"


def check_segmentation(
    folder: Path | None, config: SegmentationConfig
) -> dict[str, dict[str, Any]]:
    """Boundaries that the segmentation finds against the labels, for the recordings that are there."""
    found: dict[str, dict[str, Any]] = {}
    for name, file in (("DFKI, by hand", RUNS), ("ADL, 5 % of peak speed", ADL)):
        if folder is None or missing(folder, file):
            continue
        runs = segment_labels(folder / file)
        trials = onset_labels(folder / file)
        labels = [whole_movements(run) for run in runs or []] or [[trial] for trial in trials or []]
        found[name] = pooled(
            match_boundaries(find_reaches(t.time_s, t.keypoints[:, 2], config), wanted)
            for t, wanted in zip(load_tracks(folder / file), labels, strict=True)
        ).figures()
    return found


def _section(name: str, results: Mapping[str, Any]) -> list[str]:
    protocol = results["protocol"]
    key = name.removesuffix("_" + protocol)
    learnt = {
        WITHIN: "learnt from the same person's other recordings",
        LEAVE_ONE_OUT: "learnt from other people"
        + ("" if key in ("adl", "dfki", "matched") else ", all of them matched"),
        NEW_TASK: "learnt from other people's reaches to other targets",
    }[protocol]
    share = f"{100.0 * results['observed']:g} %"
    better = winners(results, OURS)
    lines = [
        f"## {_TITLES[key]}: {protocol}",
        "",
        f"{results['n']} reaches of {results['subjects']} people; {learnt}. After {share} our predictor "
        f"had noticed {100.0 * results['noticed'][format(results['observed'], 'g')]:.0f} % of the reaches"
        f"{belief_words(results)}. Then:",
        "",
        predictor_table(results["predictors"]),
        "Median end-point error [mm] by the share that was seen:",
        "",
        observed_table(results["by_observed"]),
        UNNOTICED,
        "",
        region_table(results, OURS),
    ]
    if better:
        lines += [BETTER, "", *(f"- {line}" for line in better), ""]
    else:
        lines += ["No other predictor is better in any of these figures.", ""]
    lines += [f"![{plot[:-4]}](prediction/{name}_{plot})" for plot in plots_of(name)]
    lines += [""]
    if results["skipped"]:
        lines += ["Skipped: " + "; ".join(results["skipped"]) + ".", ""]
    return lines


def report(content: Mapping[str, Any]) -> str:
    """The text of ``prediction.md``."""
    results = content["evaluations"]
    smoke = " --smoke" if content["smoke"] else ""
    knows: dict[str, str] = {}
    for found in results.values():
        knows |= found["knows"]
    lines = [
        "# Prediction of reaches, measured",
        "",
        f"Made by `scripts/reproduce_prediction.py{smoke}`. Recordings are replayed sample by sample "
        "through the predictor of the node. All figures are of the wrist: the end-point error is the "
        "distance between what was predicted for the time at which the reach ends and where the wrist "
        "was then; regions and negative log-likelihood (NLL, nats, metres) are over all points, 50 ms "
        "apart, from then until the reach ends. Latency is of one sample and the prediction after it "
        "(simple predictors: of one prediction), while other processes kept the remaining cores busy.",
        "",
        origin_line(content["origin"]),
        "",
    ]
    lines += bar_lines(results)
    lines += ["What each predictor is told:", "", knowledge_list(knows)]
    lines += unknown_target_lines(_TITLES, results)
    for name, found in results.items():
        lines += _section(name, found)
    if content["segmentation"]:
        lines += [
            "## Segmentation",
            "",
            "Reaches cut from continuous tracks (hysteresis on the speed of the wrist) against labels. "
            "Found: reaches that overlap a labelled movement by half of what either covers, one to one; "
            "boundary errors are those of their onsets and ends. A movement that a recording breaks off "
            "has no end to be found. Labels by hand: whole movements, without their parts.",
            "",
            BOUNDARY_HEAD,
            *(boundary_row(name, row) for name, row in content["segmentation"].items()),
            "",
        ]
    if content["skipped"]:
        lines += ["## Skipped", "", *(f"- {line}" for line in content["skipped"]), ""]
    return "\n".join(lines)


def _short(results: Mapping[str, Any]) -> dict[str, Any]:
    """All figures after the first share; after the others, what tables and bars need."""
    kept = ("endpoint_error_m", "nll", "coverage50", "coverage95")
    by_observed = {
        share: {name: {key: found[key] for key in kept} for name, found in predictors.items()}
        for share, predictors in results["by_observed"].items()
    }
    return {**results, "by_observed": by_observed}


app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


@app.command(context_settings={"help_option_names": ["-h", "--help"]})
def reproduce_prediction(
    out: Annotated[
        Path, typer.Option(help="Folder for prediction.md, prediction.json and prediction/*.png.")
    ] = Path("docs/results"),
    runs: Annotated[
        Path,
        typer.Option(help="Folder for the single evaluations; what is done is not done again."),
    ] = Path("runs/reproduce_prediction"),
    seed: Annotated[
        int, typer.Option(help="Seed of simulated people and of the plots' examples.", min=0)
    ] = 0,
    workers: Annotated[
        int | None, typer.Option(help="Processes (default: one a core).", min=1, show_default=False)
    ] = None,
    smoke: Annotated[
        bool, typer.Option("--smoke", help="Two people and two reaches a task only (a minute).")
    ] = False,
) -> None:
    """Evaluate the predictor on real reaches, on simulated people of all kinds, and its segmentation.

    Finds real recordings through HRI_DATA_DIR; without them, or with some of them, says what it skips.
    """
    console = Console()
    folder = recordings_folder()
    try:
        (out / "prediction").mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(
            f"cannot make --out {out}: {error.strerror}", hint="choose another with --out"
        ) from error
    origin = results_origin()
    chosen, skipped = jobs(folder, seed, smoke)
    for line in skipped:
        console.print(f"skipped: {line}", highlight=False, markup=False)
    results: dict[str, dict[str, Any]] = {}
    try:
        for name, job in chosen.items():
            console.print(name, highlight=False)
            results[name] = run_job(job, runs / name, workers or available_cores(), console)
            for plot in plots_of(name):
                shutil.copy(runs / name / plot, out / "prediction" / f"{name}_{plot}")
    except KeyboardInterrupt:
        console.print(f"stopped; the same command goes on from what is in {runs}", highlight=False)
        raise typer.Exit(130) from None
    content = {
        "origin": origin,
        "seed": seed,
        "smoke": smoke,
        "evaluations": {name: _short(found) for name, found in results.items()},
        "segmentation": check_segmentation(folder, PredictorConfig().segmentation),
        "skipped": skipped,
    }
    (out / "prediction.json").write_text(json.dumps(content, allow_nan=False) + "\n")
    (out / "prediction.md").write_text(report({**content, "evaluations": results}))
    console.print(f"table: {out / 'prediction.md'}", highlight=False)


def main() -> int:
    """Entry point."""
    app(prog_name="reproduce_prediction.py")
    return 0
