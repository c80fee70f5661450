"""A person's trials as a table: how updates went."""

from __future__ import annotations

import numpy as np
from rich.console import Console
from rich.table import Table

from hri_planner.pibb.session import Result, Session


def print_session(console: Console, session: Session) -> None:
    """Print one line for the habituation and each update."""
    results = session.state.results
    name = session.experiment.name
    table = Table(title=f"{name}: {len(results)} of {session.trials} trials")
    columns = ("update", "cost", "J_pred [s]", "wrong", "J_dur [s]", "J_delta [1/m]", "clear [cm]")
    for column in columns:
        table.add_column(column, justify="right")
    for update in sorted({result.trial.update for result in results}):
        own = [result for result in results if result.trial.update == update]
        table.add_row("habituation" if update < 0 else str(update + 1), *_cells(own))
    console.print(table)


def _cells(own: list[Result]) -> list[str]:
    def mean(name: str) -> float:
        return float(np.mean([getattr(result.terms, name) for result in own]))

    nearest = min(result.clearance for result in own)
    learning = own[0].trial.update >= 0
    return [
        f"{np.mean([result.cost for result in own]):.1f}" if learning else "–",
        f"{mean('prediction_time'):.2f}",
        f"{100 * mean('task'):.0f} %",
        f"{mean('human_duration'):.2f}",
        f"{mean('indistinct'):.3f}",
        f"{100 * nearest:.1f}" if nearest < 1e3 else "–",
    ]
