"""Command line of ``scripts/fit_ioc.py``: which costs explain recorded reaches."""

from __future__ import annotations

import json
import math
import sys
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from hri_prediction.errors import ConfigError, DataError, HriError
from hri_prediction.evaluation.recordings import Recording, load_recordings
from hri_prediction.motor_control.arm_model import BODY_HEIGHT_M, BODY_MASS_KG, ArmModel
from hri_prediction.motor_control.batch import Job, Kept, Outcome, explain_all
from hri_prediction.motor_control.compiled_graph import is_prepared
from hri_prediction.motor_control.convention import CONVENTIONS, YAW_PITCH
from hri_prediction.motor_control.costs import CHAPTER_2, COSTS, indices_of
from hri_prediction.motor_control.observed import ObservedReach
from hri_prediction.motor_control.results_table import HEAD, draw, markdown, summary_rows
from hri_prediction.motor_control.scaling import MAXIMUM, SCALINGS
from hri_prediction.motor_control.seen import KNOT_S, arm_of, mean_of, observe
from hri_prediction.results.options import Scheduler, Workers, make_folders, resumable
from hri_prediction.results.origin import available_cores, origin_line, results_origin
from hri_prediction.results.progress import ProgressLine
from hri_prediction.tracks.placement import Placement
from hri_prediction.tracks.seating import facing_deg
from hri_prediction.tracks.segmentation import SegmentationConfig
from hri_prediction.tracks.track import ArmTrack

REACHES, RESULTS, REPORT, PICTURE = "reaches.jsonl", "results.json", "results.md", "results.png"
_SMOKE_REACHES = 3
_AUTO = "auto"

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


def _facing(track: ArmTrack, given: str) -> float:
    """Where the person faces in the axes of the recording [rad]."""
    if given == _AUTO:
        return math.radians(facing_deg(track, Placement()))
    try:
        angle = float(given)
    except ValueError:
        angle = math.nan
    if not math.isfinite(angle):
        raise ConfigError(f"--facing {given}", expected="auto, or degrees from x towards y")
    return math.radians(angle)


def collect(
    recordings: Sequence[Recording],
    *,
    facing: str,
    height_m: float,
    mass_kg: float,
    convention: str,
    average: bool,
) -> tuple[list[tuple[ObservedReach, ArmModel]], list[str]]:
    """Bring recorded reaches to the arm models of the people who made them.

    Args:
        recordings: With their reaches.
        facing: ``auto`` or degrees.
        height_m: Of the people.
        mass_kg: Of the people.
        convention: Of the joint angles.
        average: Whether to take the mean of the repetitions of a person, side and task.

    Returns:
        The reaches with their arms, and a line for each that cannot be used.
    """
    people: dict[tuple[str, str], list[ArmTrack]] = defaultdict(list)
    for recording in recordings:
        people[recording.track.subject, recording.track.side].append(recording.track)
    arms = {
        who: arm_of(tracks, height_m=height_m, mass_kg=mass_kg, convention=convention)
        for who, tracks in people.items()
    }
    groups: dict[tuple[str, str, str], list[ObservedReach]] = defaultdict(list)
    skipped = []
    for recording in recordings:
        track = recording.track
        arm = arms[track.subject, track.side]
        for number, reach in enumerate(recording.reaches):
            name = " ".join(
                part
                for part in (track.subject, track.side, track.task, f"{track.trial}.{number}")
                if part
            )
            try:
                seen = observe(
                    track,
                    reach.onset_s,
                    reach.end_s,
                    arm,
                    facing_rad=_facing(track, facing),
                    name=name,
                )
            except DataError as error:
                skipped.append(f"{name}: {error}")
                continue
            groups[track.subject, track.side, track.task].append(seen)
    found = []
    for (subject, side, task), reaches in groups.items():
        arm = arms[subject, side]
        if average:
            name = " ".join(part for part in (subject, side, task) if part)
            found.append((mean_of(reaches, arm, name), arm))
        else:
            found += [(reach, arm) for reach in reaches]
    return found, skipped


def write_results(
    out: Path,
    outcomes: Sequence[Outcome],
    reaches: Sequence[tuple[ObservedReach, ArmModel]],
    skipped: Sequence[str],
    settings: dict[str, Any],
    origin: dict[str, Any],
) -> None:
    """Write results.json, results.md and results.png."""
    names = settings["costs"]
    rows = []
    for outcome, (reach, arm) in zip(outcomes, reaches, strict=True):
        problem = reach.problem
        rows.append(
            {
                **asdict(outcome),
                "q_start_deg": np.degrees(problem.q_start).tolist(),
                "q_end_deg": np.degrees(problem.q_end).tolist(),
                "duration_s": problem.duration,
                "upper_arm_m": arm.upper_m,
                "forearm_m": arm.forearm_m,
                "misfit_cm": 100.0 * reach.misfit_m,
            }
        )
    content = {**settings, "origin": origin, "skipped": list(skipped), "reaches": rows}
    (out / RESULTS).write_text(json.dumps(content, indent=1, allow_nan=False) + "\n")
    failed = [f"- {each.name}: {each.error}" for each in outcomes if each.error]
    misfit = 100.0 * float(np.median([reach.misfit_m for reach, _ in reaches]))
    text = [
        "# Which costs explain these reaches\n",
        f"{origin_line(origin)}\n",
        f"{len(outcomes) - len(failed)} reaches of {', '.join(settings['files'])}. Errors: dynamic time "
        "warping between the optimum and what was seen, by sample; mean ± standard deviation over reaches. "
        "Uncertainty: of the weight of one reach, from Fisher's information.\n",
        markdown(HEAD, summary_rows(outcomes, names)),
        f"Elbow and wrist of the model are {misfit:.1f} cm (root mean square, median over reaches) from "
        "where they were seen: what a shoulder rolls the model has not. Another --convention may come "
        "nearer.\n",
        *(["", "Not explained:\n", *failed] if failed else []),
        *(["", "Left out:\n", *(f"- {line}" for line in skipped)] if skipped else []),
        "",
    ]
    (out / REPORT).write_text("\n".join(text))
    if len(failed) < len(outcomes):
        draw(outcomes, names, out / PICTURE)


@app.command(context_settings={"help_option_names": ["-h", "--help"]})
def fit_ioc(
    files: Annotated[
        list[Path],
        typer.Argument(help="Recordings of reaches: track files (NPZ, CSV, QTM TSV) or bags."),
    ],
    out: Annotated[
        Path,
        typer.Option(
            help=f"Folder for {RESULTS}, {REPORT}, {PICTURE}, and {REACHES}, a line a reach."
        ),
    ],
    costs: Annotated[
        str,
        typer.Option(help="Costs that may have a part, by comma. Known: " + ", ".join(COSTS) + "."),
    ] = ",".join(CHAPTER_2),
    average: Annotated[
        bool,
        typer.Option(
            "--average", help="Explain the mean of a person's repetitions of a task, not each."
        ),
    ] = False,
    facing: Annotated[
        str,
        typer.Option(
            help="Where people face in the axes of the recording, in degrees from x towards y; auto: the "
            "quarter turn nearest to where the arm points in the mean."
        ),
    ] = _AUTO,
    height: Annotated[
        float, typer.Option(help="Height of the people in metres.", min=0.5, max=2.5)
    ] = BODY_HEIGHT_M,
    mass: Annotated[
        float, typer.Option(help="Their mass in kilograms.", min=10.0, max=300.0)
    ] = BODY_MASS_KG,
    convention: Annotated[
        str, typer.Option(help="How joint angles are counted: " + ", ".join(CONVENTIONS) + ".")
    ] = YAW_PITCH.name,
    scaling: Annotated[
        str, typer.Option(help="How costs are brought to one range: " + " or ".join(SCALINGS) + ".")
    ] = MAXIMUM,
    workers: Workers = None,
    scheduler: Scheduler = None,
    smoke: Annotated[
        bool, typer.Option("--smoke", help=f"The first {_SMOKE_REACHES} reaches only.")
    ] = False,
) -> None:
    """Find which mix of optimal-control costs explains each of recorded reaches, how well and how surely.

    What is done is kept in --out: the same command goes on where it was broken off. Exit code 1 when no
    reach can be explained.
    """
    console = Console()
    try:
        names = tuple(part.strip() for part in costs.split(",") if part.strip())
        indices_of(names)
        if scaling not in SCALINGS:
            raise ConfigError(f"--scaling {scaling}", expected="one of " + ", ".join(SCALINGS))
        if convention not in CONVENTIONS:
            raise ConfigError(
                f"--convention {convention}", expected="one of " + ", ".join(CONVENTIONS)
            )
        make_folders(out=out)
        origin = results_origin()
        with resumable(console, out), ProgressLine(console) as progress:
            progress.say("reading")
            recordings = [
                one for file in files for one in load_recordings(file, SegmentationConfig())
            ]
            reaches, skipped = collect(
                recordings,
                facing=facing,
                height_m=height,
                mass_kg=mass,
                convention=convention,
                average=average,
            )
            if smoke:
                reaches = reaches[:_SMOKE_REACHES]
            if not reaches:
                raise DataError(
                    f"no reach of {len(recordings)} recordings can be used"
                    + (f"; the first: {skipped[0]}" if skipped else ""),
                    expected="one at least",
                )
            if not is_prepared(convention):
                progress.say("compiling the model of the arm, once (some twenty seconds)")
            # Splines pass what is slower than their knots: so many samples share an error.
            jobs = [
                Job(i, reach, arm, names, scaling, correlated=_correlated(reach))
                for i, (reach, arm) in enumerate(reaches)
            ]
            progress.say("explaining reaches")
            outcomes = explain_all(
                jobs,
                workers=workers or available_cores(),
                scheduler=scheduler,
                kept=Kept(out / REACHES),
                progress=progress.count,
            )
        settings = {
            "files": [str(file) for file in files],
            "costs": list(names),
            "scaling": scaling,
            "convention": convention,
            "average": average,
            "height_m": height,
            "mass_kg": mass,
            "smoke": smoke,
        }
        write_results(out, outcomes, reaches, skipped, settings, origin)
    except HriError as error:
        print(f"error: {error}", file=sys.stderr)
        raise typer.Exit(1) from error
    except OSError as error:
        print(f"error: cannot write to {out}: {error.strerror or error}", file=sys.stderr)
        raise typer.Exit(1) from error
    failed = [each for each in outcomes if each.error]
    table = Table(*HEAD, title=f"{len(outcomes) - len(failed)} reaches")
    for row in summary_rows(outcomes, names):
        table.add_row(*row)
    console.print(table)
    for line in [*(f"{each.name}: {each.error}" for each in failed), *skipped][:5]:
        console.print(f"left out: {line}", markup=False, highlight=False)
    console.print(f"results: {out / REPORT}, {out / PICTURE}", highlight=False, soft_wrap=True)
    if len(failed) == len(outcomes):
        raise typer.Exit(1)


def _correlated(reach: ObservedReach) -> float:
    """Samples that share an error after smoothing."""
    step_s = reach.problem.duration / (len(reach.phases) - 1)
    return max(KNOT_S / step_s, 1.0)


def main(argv: Sequence[str] | None = None) -> int:
    """Run ``fit_ioc`` with ``argv`` (default: the process' arguments); its exit code."""
    try:
        app(args=None if argv is None else list(argv), prog_name="fit_ioc.py")
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else int(stop.code is not None)
    return 0
