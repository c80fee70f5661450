"""Command line of ``scripts/reproduce_ontology.py``: the chapter on interactions, beside the thesis."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from hri_prediction.errors import HriError
from hri_prediction.extras import check_networkx, check_scikit_learn
from hri_prediction.ontology.classifier import COST, InteractionClassifier
from hri_prediction.ontology.cost_file import LearntCosts, load_costs
from hri_prediction.ontology.costs import LENGTH_M
from hri_prediction.ontology.movements import PENALTY, SAMPLES
from hri_prediction.ontology.shipped import SHIPPED, SHIPPED_COSTS
from hri_prediction.results.options import Workers, make_folders, resumable
from hri_prediction.results.origin import available_cores, origin_line, results_origin
from hri_prediction.results.progress import ProgressLine
from hri_sim.ontology import handovers, planned
from hri_sim.ontology.case_costs import CaseJob, do_cases, simulated_sessions
from hri_sim.ontology.cosine import ALL_JOINTS
from hri_sim.ontology.costs_command import (
    BENT,
    DEFAULT_CASES,
    PEOPLE,
    SMOKE_PEOPLE,
    cost_table,
    draw_all_costs,
    draw_costs,
)
from hri_sim.ontology.data import SIMULATED
from hri_sim.ontology.evaluation_command import DOMAIN, SEED
from hri_sim.ontology.judging import FULL_EXTENT, SMOKE_EXTENT, judge, overall_words
from hri_sim.ontology.sweep import JITTERS_M, Swept, draw_sweep, sweep, sweep_lines
from hri_sim.ontology.training_command import RUNS, SMOKE_NOTE
from hri_sim.readability_report.run_folder import write_json

DATA_VARIABLE = "HRI_DATA_DIR"
RESULTS, SMOKE_RESULTS = Path("docs/results"), Path("runs/smoke_ontology")
FILE, TEXT, PICTURES = "ontology.json", "ontology.md", "ontology"
SWEPT, BARS, ALL, WAYS = "jitter.png", "costs.png", "all_costs.png", "ways.png"
SWEEP_REPETITIONS = 10
REACHES, SMOKE_REACHES = 30, 2
SMOKE_DRAWS = 2
PLANNED_CASES = ("case_1", "case_3", "case_7", "case_13")

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


def real_lines(seed: int, *, smoke: bool) -> list[str]:
    """The part on real people, or why there is none."""
    folder = os.environ.get(DATA_VARIABLE, "")
    title = "### Two real people\n"
    if not folder:
        return [title, f"Left out: {DATA_VARIABLE} is not set.\n"]
    file = Path(folder) / handovers.FILE
    if not file.is_file():
        return [title, f"Left out: {handovers.FILE} is not in ${DATA_VARIABLE}.\n"]
    try:
        trials = handovers.load_skeletons(file)
        draws = SMOKE_DRAWS if smoke else handovers.DRAWS
        costs = handovers.learn_handovers(trials, seed, draws)
    except HriError as error:
        return [title, f"Left out: {error}\n"]
    found = handovers.label(trials, InteractionClassifier.load(SHIPPED))
    return [*handovers.handover_lines(found), *handovers.cost_lines(costs)]


def cost_lines(first: LearntCosts, shipped: LearntCosts, folder: Path) -> list[str]:
    """The part on what people avoid, with pictures.

    Args:
        first: Of the first cases, all joints.
        shipped: Of all cases.
        folder: For pictures.
    """
    draw_costs(folder / BARS, first)
    draw_all_costs(folder / ALL, shipped)
    return [
        "## What people avoid\n",
        f"Path-integral inverse reinforcement learning. Figure 4.5: {first.about}, all fourteen joints.\n",
        *cost_table(first),
        "",
        "The thesis (4.8), of its people: in case 1 the hands' distance (25) and that of forearm to "
        "humerus (4) alone; in case 2 more weights, and larger ones; case 3 is less restrictive. Most "
        "weights are 0. Here people are bent by costs that are set by hand, from the edges of each case: "
        "what is found shows that the method finds them, not what people avoid.\n",
        f"![Weights of the first cases, like figure 4.5]({PICTURES}/{BARS})\n",
        f"Those that ship, for robots: {shipped.about}.\n",
        *cost_table(shipped),
        "",
        f"![Weights of all cases]({PICTURES}/{ALL})\n",
    ]


def sweep_results(swept: list[Swept]) -> list[dict[str, Any]]:
    """For the file of figures."""
    return [
        {
            "jitter_m": one.jitter,
            **{
                f"{labels}_{kind}": round(rate, 4) if rate is not None else None
                for (labels, kind), rate in one.rates.items()
            },
            "edges_kept": round(one.kept, 4),
            "edges_of_another": round(one.other, 4),
            "edges_kept_by_case": {str(n): round(share, 4) for n, share in one.by_case.items()},
        }
        for one in swept
    ]


@app.command(context_settings={"help_option_names": ["-h", "--help"]})
def reproduce_ontology(
    out: Annotated[
        Path | None,
        typer.Option(
            help=f"Folder for {TEXT}, {FILE} and {PICTURES}/*.png. Default: {RESULTS}; smoke: "
            f"{SMOKE_RESULTS}."
        ),
    ] = None,
    seed: Annotated[
        int, typer.Option(help="Of simulated dyads, splits and reaches.", min=0)
    ] = SEED,
    workers: Workers = None,
    runs: Annotated[
        Path, typer.Option(help="Folder of what is done, which is not done again.")
    ] = RUNS,
    smoke: Annotated[
        bool,
        typer.Option("--smoke", help="Four people, two encounters, few halves, draws and reaches."),
    ] = False,
) -> None:
    """Everything on kinds of interaction, beside the thesis' tables 4.1 to 4.4 and figure 4.5.

    How well cases are told apart, of simulated dyads; how that hangs on how much places differ; how late
    the monitor tells them, live; which costs people move by, whether known ones are found again, and what
    they change in the planner; and what becomes of two real people (found through HRI_DATA_DIR; left out,
    with the reason, where it is not set). Leave the machine alone while people are watched live.
    """
    console = Console()
    check_scikit_learn()
    check_networkx()
    out = out or (SMOKE_RESULTS if smoke else RESULTS)
    pictures = out / PICTURES
    make_folders(out=out, runs=runs)
    pictures.mkdir(exist_ok=True)
    os.environ.setdefault("ROS_DOMAIN_ID", DOMAIN)
    origin, cores = results_origin(), workers or available_cores()
    extent = SMOKE_EXTENT if smoke else FULL_EXTENT
    study = extent.study
    with resumable(console, runs), ProgressLine(console) as progress:

        def begun(text: str) -> Callable[[int, int], None]:
            progress.say(text)
            return progress.count

        found = judge(SIMULATED, extent, seed, COST, runs, cores, progress)
        swept = sweep(
            study, JITTERS_M[2:3] if smoke else JITTERS_M, 1 if smoke else SWEEP_REPETITIONS, seed, COST,
            runs, cores, begun,
        )  # fmt: skip
        people = SMOKE_PEOPLE if smoke else PEOPLE
        jobs = [
            CaseJob(
                name,
                simulated_sessions(name, study, people, seed),
                (),
                study,
                SAMPLES,
                PENALTY,
                seed,
                ALL_JOINTS,
            )
            for name in DEFAULT_CASES
        ]
        costs = do_cases(jobs, runs, cores, begun("costs of the first cases"))
        learnt = dict(zip(DEFAULT_CASES, costs, strict=True))
        cases = PLANNED_CASES[:1] if smoke else PLANNED_CASES
        ways = planned.compare(
            cases,
            SMOKE_REACHES if smoke else REACHES,
            seed,
            runs,
            cores,
            begun("reaches of the robot"),
        )
    first = LearntCosts(
        {name: one for name, one in learnt.items() if one is not None},
        LENGTH_M,
        f"{BENT}, seed {seed}, penalty {PENALTY:g}",
    )
    results = {
        "origin": origin,
        "smoke": smoke,
        **found.results(),
        "jitter": sweep_results(swept),
        "planned": {
            case: {
                planned.AGAIN: planned.anyway(ways, case),
                **{f"{weight:g}": planned.effect(ways, case, weight) for weight in planned.WEIGHTS},
            }
            for case in cases
        },
    }
    write_json(out / FILE, results)
    draw_sweep(pictures / SWEPT, swept)
    planned.draw_ways(pictures / WAYS, ways, cases, planned.WEIGHTS[0])
    text = [
        "# Kinds of interaction, measured\n",
        f"Made by `scripts/reproduce_ontology.py --seed {seed}{' --smoke' if smoke else ''}`. "
        f"{origin_line(origin)}\n",
        *([SMOKE_NOTE] if smoke else []),
        "Dyads are simulated. How hard they are to tell apart is set (`layout_jitter`), with other seeds, "
        "so that random halves come near to the thesis' 88 % of 7 classes: these figures are no "
        "result. All others are.\n",
        "## Telling cases apart\n",
        *found.lines(pictures, f"{PICTURES}/"),
        *sweep_lines(swept),
        f"![Rates by jitter]({PICTURES}/{SWEPT})\n",
        *real_lines(seed, smoke=smoke),
        *cost_lines(first, load_costs(SHIPPED_COSTS), pictures),
        *planned.effect_lines(ways, cases),
        f"![Ways of the tool]({PICTURES}/{WAYS})\n",
        *found.case_lines(pictures, f"{PICTURES}/"),
    ]
    (out / TEXT).write_text("\n".join(text))
    for line in overall_words(results):
        console.print(line, highlight=False)
    console.print(f"table: {out / TEXT}", highlight=False, soft_wrap=True)


def main() -> int:
    """Entry point."""
    app(prog_name="reproduce_ontology.py")
    return 0
