"""Command line of ``scripts/label_interactions.py``: what each movement of two recorded people is."""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from hri_prediction.arm.geometry import SIDES
from hri_prediction.bags.reader import BagReader
from hri_prediction.errors import ConfigError, DataError
from hri_prediction.files.whole import write_whole
from hri_prediction.ontology.cases import GROUP_NAMES, find_case
from hri_prediction.ontology.classifier import InteractionClassifier
from hri_prediction.ontology.recordings import segments_of_bag
from hri_prediction.ontology.shipped import SHIPPED
from hri_prediction.ontology.verdict import verdict_on
from hri_prediction.results.options import run_app

CASE_TYPE = "hri_msgs/msg/InteractionCase"
COMPLETE = 2
"""State of a movement that is over, as in the message."""
HEAD = ("who", "onset_s", "end_s", "case", "probability", "class", "class_probability", "reason")

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


@dataclass(frozen=True)
class Labelled:
    """A movement.

    Attributes:
        who: Whose.
        onset_ns: When it began, on the clock of its samples [ns].
        end_ns: When it was over [ns].
        number: The likeliest case; 0: none, see the reason.
        probability: Its probability.
        group: The likeliest class of the reduced ontology; 0: none.
        group_probability: Its probability.
        reason: Why there is none, or why probabilities say little; may be empty.
    """

    who: str
    onset_ns: int
    end_ns: int
    number: int = 0
    probability: float = 0.0
    group: int = 0
    group_probability: float = 0.0
    reason: str = ""


def label_bag(
    bag: str | Path,
    classifier: InteractionClassifier,
    bodies: tuple[str, ...] = (),
    side: str = "right",
) -> list[Labelled]:
    """All movements of two people in a bag, as the interaction monitor would say them live.

    Args:
        bag: Folder or .mcap file.
        classifier: Which.
        bodies: Ids of the two; empty: there must be no others.
        side: Which arm of both.

    Raises:
        DataError: when the bag cannot be read, or does not hold these two.
    """
    pair, segments = segments_of_bag(bag, bodies, side)
    found = []
    for one in sorted(segments, key=lambda each: each.end_ns):
        who, times = pair[one.agent], (one.onset_ns, one.end_ns)
        if one.features is None:
            found.append(Labelled(who, *times, reason=one.reason))
            continue
        said = verdict_on(classifier, one.features)
        found.append(
            Labelled(
                who,
                *times,
                said.number,
                said.probability,
                said.group,
                said.group_probability,
                said.unlike,
            )
        )
    return found


def recorded_cases(bag: str | Path) -> dict[tuple[str, int, int], int]:
    """Cases of movements that a monitor told of while the bag was recorded, by who, onset and end [ns]."""
    reader = BagReader(bag)
    topics = {name for name, info in reader.topics.items() if info.type == CASE_TYPE}
    found = {}
    for message in reader.messages(topics) if topics else ():
        told = message.decode()
        if told.state == COMPLETE:
            ends = (_ns(told.onset), _ns(told.end))
            found[(str(told.first), *ends)] = int(told.number)
    return found


def _ns(stamp: Any) -> int:
    # Not to_ns of ros.time: a bag is read without ROS.
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)


def compared(labelled: list[Labelled], told: dict[tuple[str, int, int], int]) -> str:
    """How many movements have the case that was told live, in words."""
    here = {(one.who, one.onset_ns, one.end_ns): one.number for one in labelled if one.number}
    both = here.keys() & told.keys()
    same = sum(here[key] == told[key] for key in both)
    text = (
        f"told live: {len(told)} movements, {len(both)} of which are found here; {same} have the same "
        "case"
    )
    if len(both) < len(told):
        text += " (a replay has other stamps, and a monitor that began late has seen less)"
    if len(both) < len(here):
        text += f"; {len(here) - len(both)} that are found here were not told"
    return text


def _rows(labelled: list[Labelled], begin_ns: int) -> list[tuple[str, ...]]:
    return [
        (
            one.who,
            f"{(one.onset_ns - begin_ns) * 1e-9:.3f}",
            f"{(one.end_ns - begin_ns) * 1e-9:.3f}",
            str(one.number or ""),
            f"{one.probability:.3f}" if one.number else "",
            str(one.group or ""),
            f"{one.group_probability:.3f}" if one.number else "",
            one.reason,
        )
        for one in labelled
    ]


@app.command(context_settings={"help_option_names": ["-h", "--help"]})
def label_interactions(
    bag: Annotated[Path, typer.Argument(help="Bag of two people: a folder, or a .mcap file.")],
    bodies: Annotated[
        str, typer.Option(help="Ids of the two, by comma. Default: there are no others in the bag.")
    ] = "",
    side: Annotated[str, typer.Option(help="Which arm of both: right or left.")] = "right",
    classifier: Annotated[
        Path, typer.Option(help="Of train_ontology.py. Default: the one that ships.")
    ] = SHIPPED,
    out: Annotated[
        Path | None, typer.Option(help="Also write the table as a CSV file, times in seconds.")
    ] = None,
) -> None:
    """Say of each movement of two recorded people which case of interaction it is.

    These are the labels that interaction_monitor, with its default parameters, gives the recording when it
    is replayed. Times count from the begin of the bag. Where the bag holds what a monitor said
    when it was recorded, that is compared.
    """
    console = Console()
    if side not in SIDES:
        raise ConfigError(f"--side {side}", expected="right or left")
    machine = InteractionClassifier.load(classifier)
    pair = _pair(bodies)
    try:
        labelled = label_bag(bag, machine, pair, side)
    except DataError as error:
        # The hint is one for sessions.yaml.
        hint = (
            "" if pair or "name two" not in error.hint else "name two of them: --bodies ONE,OTHER"
        )
        raise DataError(error.problem, expected=error.expected, hint=hint) from error
    rows = _rows(labelled, BagReader(bag).metadata.starting_time_ns)
    _print_table(console, rows)
    cases = Counter(one.number for one in labelled if one.number)
    said = [
        (n, f"case {number}, {find_case(number).description}") for number, n in cases.most_common(3)
    ]
    groups = Counter(one.group for one in labelled if one.group)
    said += [(n, f"class {group}, {GROUP_NAMES[group - 1]}") for group, n in groups.most_common(3)]
    for count, what in said:
        words = f"{count} of {len(labelled)} movements: {what}"
        console.print(words, highlight=False, markup=False, soft_wrap=True)
    if not labelled:
        console.print("nobody moves from rest to rest in this bag")
    if told := recorded_cases(bag):
        console.print(compared(labelled, told), highlight=False, soft_wrap=True)
    if out is not None:
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerows([HEAD, *rows])
        write_whole({out: lambda path: path.write_text(text.getvalue())})
        console.print(f"table: {out}", highlight=False, soft_wrap=True)


def _print_table(console: Console, rows: Sequence[tuple[str, ...]]) -> None:
    """Movements a line each; reasons, which are long and often nearly the same, beneath it by number."""
    table = Table(box=None, pad_edge=False)
    for name in (*HEAD[:-1], "note"):
        table.add_column(
            escape(name.replace("_s", " [s]").replace("_", " ")),
            justify="left" if name == "who" else "right",
            overflow="fold",
        )
    notes: dict[str, int] = {}
    for *cells, reason in rows:
        note = str(notes.setdefault(reason, len(notes) + 1)) if reason else ""
        table.add_row(*map(escape, (*cells, note)))
    console.print(table)
    for reason, number in notes.items():
        console.print(f"note {number}: {reason}", highlight=False, markup=False, soft_wrap=True)


def _pair(given: str) -> tuple[str, ...]:
    names = tuple(part.strip() for part in given.split(",") if part.strip())
    if len(set(names)) != len(names) or len(names) not in (0, 2):
        raise ConfigError(f"--bodies {given}", expected="two different ids, by comma")
    return names


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command with ``argv`` (default: the process' arguments); its exit code."""
    return run_app(app, "label_interactions.py", argv)
