"""Command line of ``scripts/fit_ioc.py``: which costs explain recorded reaches."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from hri_prediction.errors import ConfigError, DataError, HriError
from hri_prediction.evaluation.recordings import Recording, load_recordings
from hri_prediction.files.whole import write_whole
from hri_prediction.motor_control.arm_model import ANATOMICAL, BODY_HEIGHT_M, BODY_MASS_KG
from hri_prediction.motor_control.batch import Job, Kept, Outcome, correlated, explain_all
from hri_prediction.motor_control.collected import AUTO, CollectedReach, People, collect
from hri_prediction.motor_control.compiled_graph import is_prepared
from hri_prediction.motor_control.convention import CONVENTIONS, YAW_PITCH
from hri_prediction.motor_control.costs import (
    CHAPTER_2,
    COSTS,
    DYNAMIC,
    KINEMATIC,
    indices_of,
    shares,
)
from hri_prediction.motor_control.law import FEATURES, WeightLaw
from hri_prediction.motor_control.person_laws import LEAST_REACHES, fit_person_laws, law_lines
from hri_prediction.motor_control.results_table import HEAD, draw, markdown, summary_rows
from hri_prediction.motor_control.scaling import MAXIMUM, SCALINGS
from hri_prediction.results.options import Scheduler, Workers, make_folders, resumable, run_app
from hri_prediction.results.origin import available_cores, origin_line, results_origin
from hri_prediction.results.progress import ProgressLine
from hri_prediction.results.used import check_used
from hri_prediction.tracks.segmentation import SegmentationConfig

REACHES, RESULTS, REPORT, PICTURE = "reaches.jsonl", "results.json", "results.md", "results.png"
LAWS = "laws"
"""Folder of the laws that were found, a file an arm."""
_SMOKE_REACHES = 3
_SHOWN = 5
"""Lines of a kind that are printed; the report has all."""
MUCH_AT_LIMITS = 0.05
"""Share of a reach's samples at a limit of a joint, from which on the report says so."""

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


def read_all(files: Sequence[Path]) -> tuple[list[Recording], list[str]]:
    """Recordings of all files, and a line for each file that holds none.

    Raises:
        DataError: none holds any.
    """
    found: list[Recording] = []
    skipped = []
    refused: DataError | None = None
    for file in files:
        try:
            found += load_recordings(file, SegmentationConfig())
        except DataError as error:
            skipped.append(str(error))
            refused = refused or error
    if not found:
        if refused is not None:
            raise refused
        raise DataError("no file was named", expected="recorded reaches")
    return found, skipped


def write_results(
    out: Path,
    outcomes: Sequence[Outcome],
    reaches: Sequence[CollectedReach],
    skipped: Sequence[str],
    settings: dict[str, Any],
    origin: dict[str, Any],
    laws: tuple[list[dict[str, Any]], list[str]] | None = None,
) -> None:
    """Write results.json, results.md and results.png."""
    names = settings["costs"]
    rows = []
    for outcome, reach in zip(outcomes, reaches, strict=True):
        problem = reach.observed.problem
        rows.append(
            {
                **asdict(outcome),
                "person": reach.person,
                "q_start_deg": np.degrees(problem.q_start).tolist(),
                "q_end_deg": np.degrees(problem.q_end).tolist(),
                "duration_s": problem.duration,
                "facing_deg": reach.facing_deg,
                "upper_arm_m": reach.arm.upper_m,
                "forearm_m": reach.arm.forearm_m,
                "misfit_cm": 100.0 * reach.observed.misfit_m,
                "share_at_limits": share_at_limits(reach),
            }
        )
    content = {**settings, "origin": origin, "skipped": list(skipped), "reaches": rows}
    if laws is not None:
        content["laws"] = laws[0]
    figures = json.dumps(content, indent=1, allow_nan=False) + "\n"
    failed = [f"- {each.name}: {each.error}" for each in outcomes if each.error]
    misfits = [100.0 * reach.observed.misfit_m for reach in reaches]
    done = [each.alpha for each in outcomes if not each.error]
    shared = []
    if done and {*KINEMATIC, *DYNAMIC} & set(names):
        shared = [
            f"Share of the {word} costs in alpha: {share.mean():.2f} ± {share.std():.2f}."
            for word, share in (
                ("kinematic", shares(done, names, KINEMATIC)),
                ("dynamic", shares(done, names, DYNAMIC)),
            )
        ]
    text = [
        "# Which costs explain these reaches\n",
        f"{origin_line(origin)}\n",
        f"{len(outcomes) - len(failed)} reaches of {', '.join(settings['files'])}. Errors: dynamic time "
        "warping between the optimum and what was seen, by sample; mean ± standard deviation over reaches. "
        "Uncertainty: of the weight of one reach, from Fisher's information.\n",
        markdown(HEAD, summary_rows(outcomes, names)),
        f"{uncertain_line(settings['whole'])}\n",
        *(" ".join(shared).splitlines()),
        "",
        f"Elbow and wrist of the model are {np.median(misfits):.1f} cm from where they were seen (root "
        f"mean square; median over reaches, {max(misfits):.1f} cm at most): what a shoulder rolls the "
        "model has not. Another --convention may come nearer; where people face otherwise than --facing "
        "says, it is decimetres.\n",
        *limit_lines(reaches),
        *(law_lines(*laws, whole=settings["whole"]) if laws is not None else []),
        *(["", "Not explained:\n", *failed] if failed else []),
        *(["", "Left out:\n", *(f"- {line}" for line in skipped)] if skipped else []),
        "",
    ]
    files: dict[Path, Callable[[Path], object]] = {}
    if len(failed) < len(outcomes):
        files[out / PICTURE] = lambda path: draw(outcomes, names, path)
    else:
        (out / PICTURE).unlink(missing_ok=True)
    files[out / REPORT] = lambda path: path.write_text("\n".join(text))
    files[out / RESULTS] = lambda path: path.write_text(figures)
    write_whole(files)


def uncertain_line(whole: bool) -> str:
    """What uncertainties of single reaches leave out.

    Args:
        whole: Whether reaches go from rest to rest, and are not cut.
    """
    why = (
        "when each began and ended is taken from its speed, and 20 ms are enough to change its weights"
        if whole
        else "reaches were cut at 5 % of the peak speed, and accelerations there are left to the optimum"
    )
    return (
        f"Weights of single reaches are less sure than that: {why} (docs/motor_control.md). Distances "
        "are not touched by it."
    )


def share_at_limits(reach: CollectedReach) -> float:
    """Share of the samples in which a joint is at the limit that its angle was kept to."""
    angles = reach.observed.angles
    at = (angles <= np.array(ANATOMICAL.lower)) | (angles >= np.array(ANATOMICAL.upper))
    return float(at.any(axis=1).mean())


def limit_lines(reaches: Sequence[CollectedReach]) -> list[str]:
    """Which reaches are often at a limit: what they did there is not known."""
    often = [each for each in reaches if share_at_limits(each) > MUCH_AT_LIMITS]
    if not often:
        return []
    first = ", ".join(
        f"{each.observed.name or each.person} ({share_at_limits(each):.0%})" for each in often[:5]
    )
    more = f" and {len(often) - 5} more" if len(often) > 5 else ""
    return [
        f"In {len(often)} reaches joint angles were kept to the anatomical limits for more than "
        f"{MUCH_AT_LIMITS:.0%} of the samples, and say little there: {first}{more}.\n"
    ]


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
    whole: Annotated[
        bool,
        typer.Option(
            "--whole",
            help="People rest before and after each reach, which is explained as a whole: when it began "
            "and ended is estimated from its speed, and with --law fitted. Else it is cut at 5 % of its "
            "peak speed, and a law says nothing of the true weights.",
        ),
    ] = False,
    facing: Annotated[
        str,
        typer.Option(
            help="Where people face in the axes of the recording, in degrees from x towards y; auto: the "
            "quarter turn nearest to where a person's arms point in the mean of all recordings."
        ),
    ] = AUTO,
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
    law: Annotated[
        bool,
        typer.Option(
            "--law",
            help="Besides, fit one law of weights by posture to all reaches of each arm: known much better "
            f"than the weights of one reach, with --whole and without --average. It needs {LEAST_REACHES} "
            "different reaches of an arm.",
        ),
    ] = False,
    workers: Workers = None,
    scheduler: Scheduler = None,
    smoke: Annotated[
        bool, typer.Option("--smoke", help=f"The first {_SMOKE_REACHES} reaches only.")
    ] = False,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace what --out holds of other options.")
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
        if law and average:
            raise ConfigError(
                "--law with --average",
                expected="one of them: the mean path of repetitions is the optimum of nothing",
                hint="leave out --average",
            )
        if law:
            WeightLaw(names, np.zeros((len(names) - 1, len(FEATURES))))  # says what costs it needs
        if convention not in CONVENTIONS:
            raise ConfigError(
                f"--convention {convention}", expected="one of " + ", ".join(CONVENTIONS)
            )
        settings = {
            "files": [str(file) for file in files],
            "costs": list(names),
            "scaling": scaling,
            "convention": convention,
            "average": average,
            "whole": whole,
            "law": law,
            "facing": facing,
            "height_m": height,
            "mass_kg": mass,
            "smoke": smoke,
        }
        check_used(out, RESULTS, settings, overwrite=overwrite)
        make_folders(out=out)
        origin = results_origin()
        with resumable(console, out), ProgressLine(console) as progress:
            progress.say("reading")
            recordings, unread = read_all(files)
            people = People(facing, height, mass, convention, average, whole)
            progress.say("bringing reaches to the model of the arm")
            reaches, unusable = collect(recordings, people, progress.count)
            skipped = unread + unusable
            if smoke:
                reaches = reaches[:_SMOKE_REACHES]
            if not reaches:
                raise DataError(
                    f"no reach of {len(recordings)} recordings can be used"
                    + (f"; the first: {skipped[0]}" if skipped else ""),
                    expected="one at least",
                )
            if not is_prepared(convention):
                progress.say("compiling the model of the arm, once")
            # Splines pass what is slower than their knots: so many samples share an error.
            jobs = [
                Job(
                    i,
                    each.observed,
                    each.arm,
                    names,
                    scaling,
                    correlated=correlated(each.observed),
                )
                for i, each in enumerate(reaches)
            ]
            progress.say("explaining reaches")
            outcomes = explain_all(
                jobs,
                workers=workers or available_cores(),
                scheduler=scheduler,
                kept=Kept(out / REACHES),
                progress=progress.count,
            )
            laws = None
            if law:
                progress.say("fitting laws")
                make_folders(laws=out / LAWS)
                laws = fit_person_laws(
                    reaches,
                    outcomes,
                    names,
                    scaling,
                    folder=out / LAWS,
                    workers=workers or available_cores(),
                    scheduler=scheduler,
                    progress=progress.count,
                )
        write_results(out, outcomes, reaches, skipped, settings, origin, laws)
    except HriError as error:
        print(f"error: {error}", file=sys.stderr)
        raise typer.Exit(1) from error
    except OSError as error:
        where = error.filename or out
        print(f"error: {where}: {error.strerror or error}", file=sys.stderr)
        raise typer.Exit(1) from error
    failed = [each for each in outcomes if each.error]
    table = Table(*map(escape, HEAD), title=f"{len(outcomes) - len(failed)} reaches")
    for row in summary_rows(outcomes, names):
        table.add_row(*row)
    console.print(table)
    console.print(uncertain_line(whole), highlight=False)
    if len(names) > 1 and not (law and whole):
        console.print(
            f"Surer: --law --whole, of whoever rests before and after {LEAST_REACHES} different reaches.",
            highlight=False,
        )
    for one in laws[0] if laws is not None else ():
        console.print(
            f"law of {one['person']}: {one['reaches']} reaches, {one['rms_cm']:.2f} cm",
            highlight=False,
        )
    no_law = [f"no law of {line}" for line in (laws[1] if laws is not None else ())]
    left_out = [*(f"{each.name}: {each.error}" for each in failed), *skipped]
    for lines in (no_law, [f"left out: {line}" for line in left_out]):
        for line in lines[:_SHOWN]:
            console.print(line, markup=False, highlight=False)
        if len(lines) > _SHOWN:
            console.print(f"and {len(lines) - _SHOWN} more like that, in {REPORT}", highlight=False)
    console.print(f"results: {out / REPORT}, {out / PICTURE}", highlight=False, soft_wrap=True)
    if len(failed) == len(outcomes):
        raise typer.Exit(1)


def main(argv: Sequence[str] | None = None) -> int:
    """Run ``fit_ioc`` with ``argv`` (default: the process' arguments); its exit code."""
    return run_app(app, "fit_ioc.py", argv)
