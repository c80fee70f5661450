"""What is checked before an experiment begins: options of another mode, and the place of its policy."""

from __future__ import annotations

from pathlib import Path

import typer

from hri_planner.pibb.library import Entry, PolicyLibrary
from hri_planner.pibb.names import check_name
from hri_planner.pibb.session import Session
from hri_planner.pibb.storage import SESSION, learnt_in, load_session
from hri_prediction.errors import ConfigError

MODES = ("live", "lockstep", "batch")
NOT_IN = {
    "live": ("seeds", "first_seed", "workers", "readings"),
    "lockstep": (
        "human", "parameters", "record", "separation", "on_death", "seeds", "first_seed", "workers",
        "readings",
    ),
    "batch": (
        "human", "population", "person", "seed", "library", "replace_policy", "parameters", "record",
        "separation", "on_death",
    ),
}  # fmt: skip
"""Options that mean nothing in a mode."""


def check_given(ctx: typer.Context, mode: str) -> None:
    """Refuse what was given and would be ignored.

    Raises:
        ConfigError: naming it.
    """
    flags = {option.name: option.opts[0] for option in ctx.command.params}
    for name in NOT_IN[mode]:
        source = ctx.get_parameter_source(name)
        if source is not None and source.name == "COMMANDLINE":
            others = [other for other in MODES if name not in NOT_IN[other]]
            raise ConfigError(
                f"{flags[name]} with --mode {mode}",
                expected=f"{flags[name]} with --mode {' or '.join(others)}",
                hint="leave it away, or choose that mode",
            )


def check_free(library: PolicyLibrary, person: str, experiment: str, trials: Path | None) -> None:
    """Check that the policy to be learnt will have a place.

    Args:
        library: Gets it.
        person: With whom it is learnt.
        experiment: In which.
        trials: Folder of the trials: what they have taught so far may be replaced; none: whatever is there.

    Raises:
        ConfigError: when it would take the place of another one, or has no name for a file.
    """
    check_name("person", person)
    if trials is None:
        return
    session = load_session(trials)[0] if (trials / SESSION).exists() else None
    for entry in library.entries():
        if (entry.person, entry.experiment) != (person, experiment):
            continue
        if session is None or not _taught(entry, session):
            raise ConfigError(
                f"{library.folder} has another policy of {person} for {experiment}",
                expected="a person of whom it has none",
                hint="another --person, another --library, or --replace",
            )


def _taught(entry: Entry, session: Session) -> bool:
    """Whether a policy of the library is what the trials of a session have taught, now or earlier."""
    own = learnt_in(session, person=entry.person, seed=0)
    if entry.problem or entry.trials is None or entry.trials > own["trials"]:
        return False
    return entry.cost_first in (None, own["cost_first"])
