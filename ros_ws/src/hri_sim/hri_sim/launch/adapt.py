"""Command line of ``scripts/adapt_policy.py``: experiments in which a policy improves by a person."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Annotated

import typer
import yaml
from rich.console import Console

from hri_planner.dmp.model_file import save_dmp
from hri_planner.dmp.policy import DmpPolicy
from hri_planner.pibb.beginning import first_policy
from hri_planner.pibb.experiment import Experiment
from hri_planner.pibb.experiment_file import (
    experiment_of,
    find_experiment,
    load_experiment,
    shipped_experiments,
    to_mapping,
)
from hri_planner.pibb.library import PolicyLibrary
from hri_planner.pibb.session import Session
from hri_planner.pibb.storage import POLICY, learnt_in, learnt_policy
from hri_planner.pibb.storage import TRIALS as TABLE
from hri_planner.policy.model_file import find_dmp
from hri_planner.robot.model import load_robot
from hri_prediction.config import from_mapping
from hri_prediction.errors import ConfigError, HriError
from hri_prediction.files.values import parse_yaml
from hri_prediction.results.origin import results_origin
from hri_prediction.results.progress import ProgressLine
from hri_sim.launch.adapt_checks import MODES, check_free, check_given
from hri_sim.launch.adaptation import (
    HUMANS,
    SIMULATED,
    TRIALS,
    AdaptationOptions,
    Conducted,
    run_adaptation,
)
from hri_sim.launch.deaths import ON_DEATH, STOP
from hri_sim.launch.folder import naming
from hri_sim.launch.lockstep import run_in_lockstep
from hri_sim.launch.options import Parameters, Seed, default_folder, one_of
from hri_sim.launch.separation import DEFAULT_SEPARATION, SEPARATIONS, WITHOUT, Separation
from hri_sim.launch.telling import explain, left_words, print_line
from hri_sim.readability.batch import PEOPLE, batch_table, learn_all
from hri_sim.readability.library_command import DEFAULT_LIBRARY
from hri_sim.readability.traits import POPULATIONS

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


@app.command(context_settings={"help_option_names": ["-h", "--help"]})
def adapt(
    ctx: typer.Context,
    experiment: Annotated[
        str,
        typer.Option(
            help="A .yaml file, or one that ships: " + ", ".join(shipped_experiments()) + "."
        ),
    ] = "transfer",
    mode: Annotated[
        str,
        typer.Option(
            help="live: all nodes, in real time, recorded; lockstep: all nodes in one process, as fast as "
            "they go; batch: without ROS, many people, for statistics."
        ),
    ] = "live",
    human: Annotated[
        str,
        typer.Option(
            help="live: whose answers count: simulated (the observer node), or live (keys pressed with "
            "examples/live/press_goal.py, or hands from motion capture nodes that you start)."
        ),
    ] = SIMULATED,
    population: Annotated[
        str,
        typer.Option(help="Whom simulated people are drawn from: " + ", ".join(POPULATIONS) + "."),
    ] = "usual",
    person: Annotated[
        str | None, typer.Option(help="Name of the person. Default: person<seed>.")
    ] = None,
    policy: Annotated[
        Path | None,
        typer.Option(
            help="Policy to begin with: a .npz file, such as another person's, or dmp_transfer, which "
            "ships; it may be one of another start. "
            "Default: straight ways."
        ),
    ] = None,
    weights: Annotated[
        str | None,
        typer.Option(
            help="Weights of the costs, as in table 7.2 (end_effector, joint), balanced, or a YAML "
            "mapping such as '{task: 40, indistinct: 0}'. Default: the experiment's."
        ),
    ] = None,
    updates: Annotated[
        int | None, typer.Option(help="Updates. Default: the experiment's.", min=1)
    ] = None,
    rollouts: Annotated[
        int | None,
        typer.Option(help="Trials of each goal in an update. Default: the experiment's.", min=2),
    ] = None,
    habituation: Annotated[
        int | None,
        typer.Option(help="Trials of each goal before. Default: the experiment's.", min=1),
    ] = None,
    seed: Seed = 0,
    seeds: Annotated[int, typer.Option(help="batch: how many people, one a seed.", min=1)] = 4,
    first_seed: Annotated[int, typer.Option(help="batch: seed of the first.", min=0)] = 0,
    workers: Annotated[int, typer.Option(help="batch: processes; 0: one a core.", min=0)] = 0,
    readings: Annotated[
        int,
        typer.Option(
            help="batch: trials of each goal by which the first and the last policy are compared.",
            min=1,
        ),
    ] = 40,
    library: Annotated[
        Path,
        typer.Option(
            help="Policy library that the person's policy goes into; not that of a smoke run."
        ),
    ] = DEFAULT_LIBRARY,
    replace_policy: Annotated[
        bool,
        typer.Option(
            "--replace", help="Replace what the library has of that person and experiment."
        ),
    ] = False,
    parameters: Parameters = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder of the experiment; one that holds trials of it is gone on with. "
            "Default: runs/adapt_<time>."
        ),
    ] = None,
    record: Annotated[bool, typer.Option(help="live: record a bag.")] = True,
    separation: Separation = DEFAULT_SEPARATION,
    on_death: Annotated[
        str,
        typer.Option(
            help="live: what is done when a node dies. stop: the experiment ends, unless it can do "
            "without it (recorder); restart: it is started again, three times each, and the trial under "
            "way is made again. A node that is frozen (kill -STOP) has not died: that is said, and no more."
        ),
    ] = STOP,
    smoke: Annotated[bool, typer.Option(help="A few trials only: does it run?")] = False,
) -> None:
    """Let a policy improve by how a person reads the robot (PI^BB).

    The robot goes to goals in random order, in samples of its policy; the person says, or shows, which
    goal it is going to; what was read soon and rightly counts for more in the next update. Everything is
    saved after each trial: Ctrl-C, a crash or a kill lose the trial under way, and the same command with
    the same --out goes on. Leaves trials.csv, policy.npz (also in the library), adaptation.png and, live,
    a bag. Exit code 0: done; 1: something went wrong; 3: the robot touched something or somebody, in
    a trial or, in the run that ends with it, elsewhere; 130 after Ctrl-C.
    """
    console = Console()
    folder = out or default_folder("adapt")
    try:
        one_of("mode", mode, MODES)
        one_of("human", human, HUMANS)
        one_of("population", population, tuple(POPULATIONS))
        check_given(ctx, mode)
        if policy is not None:
            with naming("--policy", policy):
                policy = find_dmp(str(policy))
        with naming("--experiment", experiment):
            chosen = load_experiment(find_experiment(experiment))
        chosen = _changed(chosen, weights, updates, rollouts, habituation)
        if smoke:
            plan = replace(chosen.improvement.lasting(1), rollouts=2, habituation=1)
            chosen, readings, seeds = chosen.with_(improvement=plan), 2, min(seeds, 2)
        chosen.check(load_robot())
        if mode == "batch":
            first = None
            if policy is not None:
                with naming("--policy", policy):
                    first = first_policy(chosen, load_robot(), policy)
            people = range(first_seed, first_seed + seeds)
            _batch(chosen, first, folder, people, workers, readings, console)
            return
        name = person or f"person{seed}"
        # What a few trials taught is nothing to keep.
        kept = None if smoke else PolicyLibrary(library)
        own = None if replace_policy else folder / TRIALS
        if kept is not None:
            check_free(kept, name, chosen.name, own)
        options = AdaptationOptions(
            out=folder,
            experiment=chosen,
            person=name,
            seed=seed,
            policy=policy,
            human=human,
            population=population,
            parameters=parameters,
            record=record,
            separation=one_of("separation", separation, SEPARATIONS, WITHOUT),
            on_death=one_of("on-death", on_death, ON_DEATH),
        )
        done, begun = _one(options, mode, console)
        touched = _conclude(done, begun, folder, name, console)
        kept_too = kept is None or _keep(kept, done.session, name, seed, own, console)
        if touched or not kept_too:
            raise typer.Exit(3 if touched else 1)
    except (HriError, OSError) as error:
        explain(error, console)
        run = max(folder.glob("run_*"), key=lambda path: path.stat().st_mtime, default=folder)
        for text in left_words(run):
            print_line(console, text)
        raise typer.Exit(1) from error
    except KeyboardInterrupt:
        what = f"--out {folder} again goes on"
        if mode == "batch":
            what = f"{folder / PEOPLE} has who is done; a batch does not go on, begin it in another --out"
        console.print(f"stopped; {what}", highlight=False, soft_wrap=True)
        raise typer.Exit(130) from None


def _read(text: str) -> object:
    try:
        return parse_yaml(text)
    except yaml.YAMLError as error:
        raise ConfigError(" ".join(str(error).split()), expected="YAML") from error


def _changed(
    experiment: Experiment,
    weights: str | None,
    updates: int | None,
    rollouts: int | None,
    habituation: int | None,
) -> Experiment:
    """The experiment with what the command line says otherwise."""
    content = to_mapping(experiment)
    if weights is not None:
        with naming("--weights", weights):
            given = _read(weights)
            # Of weights that are not given the experiment's own stay.
            own = content["weights"]
            content["weights"] = {**own, **given} if isinstance(given, dict) else given
            experiment = experiment_of(content)
    shipped = experiment.improvement
    given = {"updates": updates, "rollouts": rollouts, "habituation": habituation}
    plan = {**asdict(shipped), **{k: v for k, v in given.items() if v is not None}}
    if updates:  # of fewer, fewer are averaged: those in which little is learnt any more
        plan["averaged"] = shipped.lasting(updates).averaged
    return experiment.with_(improvement=from_mapping(type(experiment.improvement), plan))


def _one(options: AdaptationOptions, mode: str, console: Console) -> tuple[Conducted, DmpPolicy]:
    """An experiment with one person, in the graph: what came of it, and the policy that it began with."""
    begun = first_policy(options.experiment, load_robot(), options.policy or "")
    with ProgressLine(console) as line:
        line.say("starting")
        if mode == "live":
            return run_adaptation(options, console, line), begun
        line.say("trials")
        return run_in_lockstep(options, line.count), begun


def _conclude(
    done: Conducted, begun: DmpPolicy, folder: Path, person: str, console: Console
) -> bool:
    """Draw the trials, say what came of them; whether the robot touched somebody or something."""
    from hri_sim.readability.session_picture import draw_session
    from hri_sim.readability.session_table import print_session

    session = done.session
    name = session.experiment.name
    picture = folder / "adaptation.png"
    draw_session(picture, session, begun, f"{name}: {person}")
    print_session(console, session)
    _say_paths(
        console,
        {"trials": folder / TRIALS / TABLE, "picture": picture, "policy": folder / TRIALS / POLICY},
    )
    touched = sum(result.clearance <= 0.0 for result in session.state.results)
    if touched:
        console.print(f"the robot touched somebody or something in {touched} trials", style="red")
    if done.nearest_m <= 0.0:
        console.print(
            "the robot touched somebody or something: outside of trials that count, or as only the "
            "simulator knows",
            style="red",
        )
    return touched > 0 or done.nearest_m <= 0.0


def _keep(
    library: PolicyLibrary,
    session: Session,
    person: str,
    seed: int,
    trials: Path | None,
    console: Console,
) -> bool:
    """Put the policy into the library, unless another one has come there meanwhile; whether it is there."""
    name = session.experiment.name
    commit = str(results_origin()["commit"])
    learnt = learnt_in(session, person=person, seed=seed, commit=commit)
    try:
        check_free(library, person, name, trials)
        file = library.add(learnt_policy(session), person, name, learnt, replace=True)
    except HriError as error:
        explain(error, console)
        return False
    _say_paths(console, {"library": file})
    return True


def _say_paths(console: Console, paths: Mapping[str, Path]) -> None:
    for what, path in paths.items():
        console.print(f"{what + ':':<9}{path}", highlight=False, markup=False, soft_wrap=True)


def _batch(
    experiment: Experiment,
    first: DmpPolicy | None,
    folder: Path,
    people: range,
    workers: int,
    readings: int,
    console: Console,
) -> None:
    """Many people, without ROS.

    Raises:
        ConfigError: when the folder holds a batch already.
    """
    if (folder / PEOPLE).exists():
        raise ConfigError(
            f"--out {folder} holds a batch already",
            expected="an empty folder, or one that is not there yet",
            hint="name another --out, or remove that one",
        )
    folder.mkdir(parents=True, exist_ok=True)
    with ProgressLine(console) as line:
        line.say(f"{experiment.name}: people")
        rows = learn_all(
            experiment,
            people,
            first=first,
            readings=readings,
            workers=workers,
            folder=folder,
            progress=line.count,
        )
    table, figures = batch_table(rows)
    (folder / "results.json").write_text(
        json.dumps(
            {
                "experiments": {experiment.name: figures},
                "people": [row.row for row in rows],
                "origin": results_origin(),
            },
            indent=2,
            allow_nan=False,
        )
        + "\n"
    )
    for row in rows:
        learnt = {"experiment": experiment.name, "person": f"person{row.seed}", **row.row}
        save_dmp(folder / f"policy_{row.seed}.npz", row.last, learnt)
    console.print(table)
    console.print(f"figures: {folder / 'results.json'}", highlight=False, soft_wrap=True)


def main() -> int:
    """Entry point."""
    app(prog_name="adapt_policy.py")
    return 0
