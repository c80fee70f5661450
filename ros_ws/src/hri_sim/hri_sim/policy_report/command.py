"""Command line of ``scripts/reproduce_rnn.py``: every table and picture of learnt policies."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from hri_planner.rnn.training.config import TrainingConfig
from hri_prediction.config import load_yaml
from hri_prediction.errors import ConfigError
from hri_prediction.results.dependencies import dependency_hash
from hri_prediction.results.options import Workers, make_folders, resumable
from hri_prediction.results.origin import available_cores, results_origin
from hri_prediction.results.progress import ProgressLine
from hri_sim.policies.evaluation import finite
from hri_sim.policies.training_command import SMOKE
from hri_sim.policy_report import bars
from hri_sim.policy_report.handovers import pairs
from hri_sim.policy_report.laboratory import Laboratory
from hri_sim.policy_report.policies import (
    Policy,
    handover_policies,
    large_policies,
    seed_policies,
    train_missing,
)
from hri_sim.policy_report.report import SECTIONS, report
from hri_sim.policy_report.section import Section

RESULTS = Path("docs/results")
RUNS, SMOKE_RUNS = RESULTS / "rnn" / "policies", Path("runs/smoke_rnn")
FILE, TEXT = "rnn.json", "rnn.md"
DONE = "report.json"
"""In the folder of policies: sections that are done, with what decides about them."""

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


def reproduce(laboratory: Laboratory, only: Sequence[str]) -> dict[str, Any]:
    """Train what is missing, measure, and write report, figures and pictures.

    Args:
        laboratory: What to measure with.
        only: Names of sections that are measured again, the others are kept from the last report; none:
            all are measured of which neither code nor policies are as they were.

    Returns:
        The content of ``rnn.json``.

    Raises:
        ConfigError: when sections that are not to be measured never were.
    """
    path = laboratory.out / FILE
    kept = _sections(path, laboratory.smoke)
    missing = [one.name for one in SECTIONS if only and one.name not in (*only, *kept)]
    if missing:
        raise ConfigError(
            f"{path} has no results of {', '.join(missing)}",
            hint="measure these too, without --only",
        )
    everything = (laboratory.config, laboratory.smoke)
    policies = [
        *seed_policies(*everything),
        *handover_policies(laboratory.config, pairs(), laboratory.smoke),
        *large_policies(*everything),
    ]
    train_missing(policies, laboratory.runs, laboratory.workers, laboratory.progress)
    origin = results_origin()
    done_path = laboratory.runs / DONE
    done = _sections(done_path, laboratory.smoke)
    sections = {}
    for section in SECTIONS:
        name = section.name
        key = _key(section, policies, laboratory)
        if only and name not in only:
            sections[name] = kept[name]
        elif not only and done.get(name, {}).get("key") == key:
            sections[name] = done[name]
        else:
            results = finite(section.measure(laboratory))
            sections[name] = {"key": key, "origin": origin, "results": results}
        done[name] = sections[name]
        _write(done_path, {"smoke": laboratory.smoke, "sections": done})
    found = bars.bars({name: one["results"] for name, one in sections.items()})
    content = {
        "origin": origin,
        "smoke": laboratory.smoke,
        "bars": bars.as_json(found),
        "sections": sections,
    }
    _write(path, content)
    (laboratory.out / TEXT).write_text(report(content))
    return content


def _key(section: Section, policies: Sequence[Policy], laboratory: Laboratory) -> str:
    """Stands for all that decides about a section's results: sources, policies, recordings."""
    digest = hashlib.sha256(dependency_hash(section.measure.__module__).encode())
    for policy in policies:
        digest.update(policy.file(laboratory.runs).read_bytes())
    digest.update(f"{laboratory.out.resolve()} {pairs()}".encode())
    return digest.hexdigest()[:16]


def _write(path: Path, content: dict[str, Any]) -> None:
    """A half-written file never takes the place of a whole one."""
    new = path.with_suffix(".new")
    new.write_text(json.dumps(content, allow_nan=False, indent=1) + "\n")
    new.replace(path)


def _sections(path: Path, smoke: bool) -> dict[str, Any]:
    """Sections of an earlier report of the same kind."""
    try:
        content = json.loads(path.read_text())
    except (OSError, ValueError):
        return {}
    if not isinstance(content, dict) or content.get("smoke") != smoke:
        return {}
    sections = content.get("sections")
    return dict(sections) if isinstance(sections, dict) else {}


def chosen(only: str) -> list[str]:
    """Names of the sections that are measured again.

    Raises:
        ConfigError: when one is not known.
    """
    known = [section.name for section in SECTIONS]
    names = [name.strip() for name in only.split(",")] if only else []
    unknown = [name for name in names if name not in known]
    if unknown:
        raise ConfigError(f"--only {', '.join(unknown)}", expected="some of " + ", ".join(known))
    return names


@app.command(context_settings={"help_option_names": ["-h", "--help"]})
def reproduce_rnn(
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder for rnn.md, rnn.json and rnn/*.png. Default: docs/results; smoke: --runs."
        ),
    ] = None,
    runs: Annotated[
        Path | None,
        typer.Option(
            help="Folder of trained policies; those that are there are not trained again. Default: "
            "docs/results/rnn/policies, those of the report; smoke: runs/smoke_rnn."
        ),
    ] = None,
    config: Annotated[
        Path | None,
        typer.Option(help="YAML file of training parameters, for policies that are missing."),
    ] = None,
    only: Annotated[
        str,
        typer.Option(
            help="Sections to be measured again whatever they depend on, as encounters,pictures; of the "
            "others the figures of the last report are kept."
        ),
    ] = "",
    workers: Workers = None,
    smoke: Annotated[
        bool, typer.Option("--smoke", help="Tiny trainings, few encounters (minutes).")
    ] = False,
) -> None:
    """Train the policies of the thesis' chapter 5, and make all of its tables and pictures again.

    What was broken off goes on where it stopped: training and sections of the report.
    Recorded handovers are found through HRI_DATA_DIR, and left out, with the reason, where that is not
    set.
    """
    console = Console()
    names = chosen(only)
    runs = runs or (SMOKE_RUNS if smoke else RUNS)
    out = out or (runs if smoke else RESULTS)
    settings = load_yaml(TrainingConfig, config) if config else TrainingConfig()
    if smoke:
        settings = replace(settings, **SMOKE)
    make_folders(runs=runs, out=out)
    with resumable(console, runs), ProgressLine(console) as progress:
        laboratory = Laboratory(runs, out, workers or available_cores(), settings, progress, smoke)
        content = reproduce(laboratory, names)
    for bar in content["bars"]:
        verdict = {True: "met", False: "missed", None: "not measured"}[bar["met"]]
        value = "–" if bar["measured"] is None else f"{bar['measured']:.3g} {bar['unit']}"
        console.print(
            f"{verdict:<12}  {bar['what']}: {value}, wanted {bar['wanted']:g} {bar['unit']}",
            highlight=False, markup=False, soft_wrap=True,
        )  # fmt: skip
    console.print(f"table: {out / TEXT}", highlight=False, soft_wrap=True)


def main() -> int:
    """Entry point."""
    app(prog_name="reproduce_rnn.py")
    return 0
