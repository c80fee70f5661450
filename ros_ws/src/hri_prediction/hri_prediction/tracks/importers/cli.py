"""Command line of the import: ``import_mocap FILE --out OUT``."""

from __future__ import annotations

import argparse
import math
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table
from rich.text import Text

from hri_prediction.errors import ConfigError, HriError
from hri_prediction.tracks.files import save_tracks
from hri_prediction.tracks.importers.beside import check_together, read_beside
from hri_prediction.tracks.importers.convert import ImportOptions, ImportPlan, convert, plan_import
from hri_prediction.tracks.importers.recognise import KNOWN, read_markers
from hri_prediction.tracks.importers.report import gap_report
from hri_prediction.tracks.importers.units import UNITS
from hri_prediction.tracks.placement import Placement
from hri_prediction.tracks.plausible import check_arm
from hri_prediction.tracks.rate import check_rate
from hri_prediction.tracks.seating import suggest_placement
from hri_prediction.tracks.track import ArmTrack

_NAME = "import_mocap.py"


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog=_NAME,
        description=f"Make a track file or a motion capture bag of one arm from {KNOWN}. What is not "
        "said is found out from the file or guessed from the names of its markers; guesses are shown "
        "and need a yes. A bag of several people who were recorded together: import each but the last "
        "into a track file, and the last with --beside.",
        epilog="Exit codes: 0 written, 1 the file is refused, 2 wrong arguments or no agreement.",
    )
    parser.add_argument("file", type=Path, help="recording")
    parser.add_argument(
        "--map",
        default="",
        metavar="shoulder=A,elbow=B,wrist=C+D[,hand_tip=E]",
        help="markers of the arm; the mean of those joined by + (default: guessed)",
    )
    parser.add_argument("--side", choices=("left", "right"), default="", help="which arm")
    parser.add_argument(
        "--units",
        default="auto",
        help=f"length of the file's unit: auto, {', '.join(UNITS)}, or metres as a number",
    )
    parser.add_argument(
        "--axes",
        default="auto",
        help="axes of the file: auto, x-up, y-up, z-up, or those behind x, y and z, as x,-z,y",
    )
    parser.add_argument(
        "--rate", type=float, default=0.0, metavar="HZ", help="frame rate (default: the file's)"
    )
    parser.add_argument(
        "--resample", type=float, default=0.0, metavar="HZ", help="sampling rate of the result"
    )
    parser.add_argument(
        "--keep-zeros", action="store_true", help="take 0 0 0 as a place, not as not seen"
    )
    parser.add_argument(
        "--place",
        default="",
        metavar="X,Y,Z,YAW",
        help="place in the robot's world [m, degrees], or none, or auto: across the table "
        "(default: none for a track file, auto for a bag)",
    )
    parser.add_argument(
        "--beside",
        type=Path,
        nargs="+",
        default=[],
        metavar="FILE.npz",
        help="track files of the others in the same recording, each of one arm, as long as this one and "
        "not placed yet: all go into one bag, first frames at the same instant; --place is for all of them",
    )
    parser.add_argument("--subject", default="", help="person: a name, or one of the file's")
    parser.add_argument("--task", default="", help="name of the movement")
    parser.add_argument("--trial", type=int, default=0, metavar="N", help="number of the trial")
    parser.add_argument(
        "--out",
        type=Path,
        required=True,
        metavar="FILE.npz|FILE.csv|BAG_DIR",
        help="track file, or folder of a new bag",
    )
    parser.add_argument("--yes", action="store_true", help="agree to what is guessed")
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; returns its exit code."""
    given = _parser().parse_args(argv)
    try:
        return _run(given, Console(highlight=False, soft_wrap=True))
    except ConfigError as error:
        print(f"{_NAME}: {error}", file=sys.stderr)
        return 2
    except HriError as error:
        print(f"{_NAME}: {error}", file=sys.stderr)
        return 1


def _run(given: argparse.Namespace, console: Console) -> int:
    _check_out(given)
    _place(given, None)
    others = read_beside(given.beside, bag=not given.out.suffix, place=given.place)
    options = ImportOptions(
        mapping=given.map,
        side=given.side,
        units=given.units,
        axes=given.axes,
        rate_hz=given.rate,
        subject=given.subject,
        task=given.task,
        trial=given.trial,
        keep_zeros=given.keep_zeros,
    )
    progress = Console(stderr=True)
    with progress.status(f"reading {given.file}"):
        data = read_markers(given.file)
    try:
        with progress.status(f"looking for the arm in {len(data)} frames"):
            plan = plan_import(data, options)
            track = convert(plan)
            check_arm(track, hint="check --map and --units")
            check_rate(track)
            if given.resample:
                track = track.resampled(given.resample)
                check_rate(track, f"--resample {given.resample:g}")
            check_together(track, others)
            placement = _place(given, track)
            tracks = [track, *others]
            if placement is not None:
                tracks = [each.transformed(placement) for each in tracks]
            track = tracks[0]
    except HriError as error:
        raise type(error)(
            f"{given.file}: {error.problem}", expected=error.expected, hint=error.hint
        ) from error
    _show(plan, track, placement, given.place, console)
    if plan.guessed and not given.yes:
        repeat = _repeat(given, plan)
        if not sys.stdin.isatty():
            print(
                f"{_NAME}: nothing was written: the lines marked ? are guesses and need a yes. If "
                f"they are right, repeat with\n  {repeat}",
                file=sys.stderr,
            )
            return 2
        if not _agreed():
            print(f"{_NAME}: nothing was written. Correct and repeat:\n  {repeat}", file=sys.stderr)
            return 2
    _write(given.out, tracks, progress)
    console.print(f"wrote {given.out}", markup=False)
    return 0


def _check_out(given: argparse.Namespace) -> None:
    """Refuse what cannot be written before anything is read."""
    out: Path = given.out
    if out.suffix not in ("", ".npz", ".csv"):
        raise ConfigError(
            f"--out {out}", expected="a name in .npz or .csv, or a folder without an ending"
        )
    if out.exists() and given.file.exists() and out.samefile(given.file):
        raise ConfigError(f"--out {out} is the recording itself", expected="another name")
    if out.suffix and out.is_dir():
        raise ConfigError(f"--out {out} is a folder", expected="a file")
    if not out.suffix and out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise ConfigError(f"--out {out} exists already", expected="a new or an empty folder")


def _place(given: argparse.Namespace, track: ArmTrack | None) -> Placement | None:
    """The placement asked for; without a track the option is only checked."""
    choice = given.place.strip().lower() or ("none" if given.out.suffix else "auto")
    if choice == "none":
        return None
    if choice == "auto":
        return suggest_placement(track) if track is not None else None
    return Placement.parse(given.place)


def _show(
    plan: ImportPlan, track: ArmTrack, placement: Placement | None, place: str, console: Console
) -> None:
    """What will be written, and where each part of it comes from."""
    data = plan.data
    person = f", subject {plan.subject}" if plan.subject else ""
    console.print(
        f"{data.source}: {data.format}, {len(data)} frames at {plan.rate_hz:g} Hz "
        f"({track.duration:.2f} s), {len(data.labels)} points{person}",
        markup=False,
    )
    table = Table(box=None, pad_edge=False, show_header=False)
    for _ in range(4):
        table.add_column(overflow="fold")
    rows = [
        (
            name,
            "+".join(data.labels[row] for row in chosen) or "–",
            plan.mapping.set_name or "given",
            plan.mapping_guessed and bool(chosen),
        )
        for name, chosen in plan.mapping.items()
    ]
    seated = "across the table" if place.strip().lower() in ("", "auto") else "given"
    placed = (str(placement), seated) if placement else ("–", "as in the laboratory")
    why = "given" if plan.options.side else "by the names" if plan.mapping.side else "not told"
    rows += [
        ("side", plan.side, why, plan.side_guessed),
        ("units", plan.scale.text, plan.scale.why, plan.scale.guessed),
        ("axes", plan.axes.text, plan.axes.why, plan.axes.guessed),
        ("place", *placed, False),
    ]
    for name, value, source, guessed in rows:
        table.add_row("?" if guessed else " ", name, Text(value), Text(source))
    console.print(table)
    gaps = Table(box=None, pad_edge=False)
    gaps.add_column("keypoint")
    for column in ("seen", "gaps", "longest", "at"):
        gaps.add_column(column, justify="right")
    for gap in gap_report(track):
        # Rounded down: 100 % means all of it.
        share = f"{math.floor(1000.0 * gap.share) / 10.0:.1f} %"
        times = (f"{gap.longest_s:.3f} s", f"{gap.longest_at_s:.3f} s") if gap.count else ("–", "–")
        gaps.add_row(gap.keypoint, share, str(gap.count), *times)
    console.print(gaps)
    for note in plan.notes():
        console.print(f"note: {note}", markup=False)


def _agreed() -> bool:
    while True:
        try:
            answer = input("Are the lines marked ? right [yes/no]: ").strip().lower()
        except EOFError:
            return False
        if answer in ("y", "yes", "n", "no"):
            return answer.startswith("y")


def _repeat(given: argparse.Namespace, plan: ImportPlan) -> str:
    """The command that does the same without a guess."""
    words = [f"scripts/{_NAME}", str(given.file), "--map", plan.mapping.text(plan.data.labels)]
    words += ["--side", plan.side, "--units", plan.scale.text, f"--axes={plan.axes.text}"]
    for name in ("rate", "resample", "place", "subject", "task", "trial"):
        value = getattr(given, name)
        if value:
            words.append(f"--{name}={value}")
    words += ["--keep-zeros"] if given.keep_zeros else []
    words += ["--beside", *map(str, given.beside)] if given.beside else []
    return shlex.join([*words, "--out", str(given.out), "--yes"])


def _write(out: Path, tracks: Sequence[ArmTrack], progress: Console) -> None:
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(f"cannot make the folder {out.parent}: {error.strerror}") from error
    if out.suffix:
        save_tracks(out, tracks)
        return
    # Only bags need ROS: track files are made without it.
    from hri_prediction.ros.arm_bag import about_tracks, write_arms_bag

    total = sum(map(len, tracks))
    with progress.status(f"writing {out}") as status:
        write_arms_bag(
            out,
            tracks,
            about_tracks(tracks),
            lambda count: status.update(f"writing {out}: {count} of {total}"),
        )


if __name__ == "__main__":
    sys.exit(main())
