"""Command line of ``scripts/reproduce_import.py``: what becomes of other programs' files."""

from __future__ import annotations

import argparse
import dataclasses
import json
import math
import os
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

from hri_prediction.errors import ConfigError, DataError, HriError
from hri_prediction.results.origin import origin_line, results_origin
from hri_prediction.tracks.importers.convert import ImportOptions, convert, plan_import
from hri_prediction.tracks.importers.markers import MarkerData
from hri_prediction.tracks.importers.recognise import read_markers
from hri_prediction.tracks.importers.report import gap_report
from hri_prediction.tracks.plausible import check_arm
from hri_prediction.tracks.rate import check_rate

DATA_VARIABLE = "HRI_DATA_DIR"
FOLDERS = ("file_samples", "pickplace_dfki_qualisys/original")
ENDINGS = (".bvh", ".c3d", ".csv", ".trc", ".tsv")
_CLUSTERS = ImportOptions(mapping="shoulder=RAR1,elbow=RFA1,wrist=RFA2")
FURTHER: dict[str, tuple[ImportOptions, ...]] = {
    "ADL001FR1.csv": (
        ImportOptions(mapping="shoulder=RSHO1,elbow=RUAR1+RUAR2,wrist=RLAR1,hand_tip=RFTP"),
    ),
    "131_01.bvh": (ImportOptions(side="left"),),
    "pc_real.c3d": (_CLUSTERS,),
    "pc_int.c3d": (_CLUSTERS,),
    "dec_real.c3d": (_CLUSTERS,),
    "dec_int.c3d": (_CLUSTERS,),
    "kinematics_tennis_serve_2players.c3d": (
        ImportOptions(subject="Derrick"),
        ImportOptions(subject="Viktor", side="left"),
    ),
    "exampleFormat.trc": (ImportOptions(mapping="shoulder=marker1,elbow=marker2,wrist=marker3"),),
}
"""What is tried besides the import without options, for files whose names do not tell the arm."""
HEAD = (
    "| file | options | format | frames | rate [Hz] | side | seen [%] | gaps | longest [s] | outcome |\n"
    "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
)
_FLAGS = (("map", "mapping"), ("subject", "subject"), ("side", "side"))

Row = dict[str, Any]


def sample_files(folder: Path) -> list[Path]:
    """The files of motion capture programs in a folder of recordings, sorted."""
    found = [path for name in FOLDERS for path in sorted((folder / name).rglob("*"))]
    return [path for path in found if path.suffix.lower() in ENDINGS]


def import_rows(path: Path, name: str) -> list[Row]:
    """What becomes of a file, once without options and once for each of :data:`FURTHER`.

    Args:
        path: The file.
        name: What it is called in the table.
    """
    tries = (ImportOptions(), *FURTHER.get(path.name, ()))
    try:
        data = read_markers(path)
    except DataError as error:
        return [_row(name, ImportOptions(), refused=error.problem)]
    return [_imported(name, data, options) for options in tries]


def _imported(name: str, data: MarkerData, options: ImportOptions) -> Row:
    row = _row(name, options, format=data.format, frames=len(data), rate_hz=data.rate_hz)
    try:
        plan = plan_import(data, options)
        track = convert(plan)
        check_arm(track)
        check_rate(track)
    except HriError as error:
        return {**row, "refused": error.problem}
    gaps = [dataclasses.asdict(gap) for gap in gap_report(track)]
    found = {"markers": plan.mapping.text(data.labels), "guessed": plan.guessed}
    return {**row, "rate_hz": plan.rate_hz, "side": track.side, "gaps": gaps, **found}


def _row(name: str, options: ImportOptions, **found: Any) -> Row:
    given = {flag: getattr(options, field) for flag, field in _FLAGS if getattr(options, field)}
    return {"file": name, "options": given, **found}


def table_line(row: Mapping[str, Any]) -> str:
    """One line of the table."""
    given = " ".join(f"--{flag} {shlex.quote(text)}" for flag, text in row["options"].items())
    cells = [row["file"], given and f"`{given}`"]
    cells += [
        row.get("format", ""),
        str(row.get("frames", "")),
        f"{row['rate_hz']:.6g}" if "rate_hz" in row else "",
    ]
    if "refused" in row:
        cells += ["", "", "", "", f"refused: {row['refused']}"]
    else:
        gaps = row["gaps"]
        # Rounded down: 100 means all of it.
        shares = (f"{math.floor(1000.0 * gap['share']) / 10.0:g}" for gap in gaps)
        longest = (f"{gap['longest_s']:.2f}" if gap["count"] else "–" for gap in gaps)
        counts = (str(gap["count"]) for gap in gaps)
        said = "imported; guesses to be confirmed" if row["guessed"] else "imported"
        outcome = f"{said}: `{row['markers']}`"
        cells += [row["side"], *(" / ".join(each) for each in (shares, counts, longest)), outcome]
    # A bar within a cell would end it.
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def write_table(out: Path, origin: dict[str, Any], rows: Sequence[Row]) -> None:
    """``import.md`` and ``import.json``."""
    content = {"origin": origin, "rows": rows}
    (out / "import.json").write_text(json.dumps(content, indent=1, allow_nan=False) + "\n")
    files = {row["file"] for row in rows}
    imported = {row["file"] for row in rows if "refused" not in row}
    lines = [
        "# Files of motion capture programs, imported",
        "",
        f"Made by `scripts/reproduce_import.py`: what `scripts/import_mocap.py` makes of the files in "
        f"{' and '.join(f'`{name}/`' for name in FOLDERS)} of the recordings by others (README), none of "
        "them written by this project. Each is tried without options; where the names of its markers do "
        "not tell the arm, or name several, also with some. Seen, gaps and longest gap: shoulder / elbow "
        "/ wrist / hand tip.",
        "",
        origin_line(origin),
        "",
        f"{len(files)} files: {len(imported)} imported, {len(files) - len(imported)} refused each time.",
        "",
        HEAD,
        *(table_line(row) for row in rows),
        "",
    ]
    (out / "import.md").write_text("\n".join(lines))


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit code.

    Raises:
        ConfigError: when the variable names no such folder, or the results have no place.
    """
    parser = argparse.ArgumentParser(
        prog="reproduce_import.py",
        description="Import every file of motion capture programs among the recordings by others "
        f"and write the table import.md, import.json. Finds them through {DATA_VARIABLE}; without it "
        "says so and writes nothing.",
    )
    parser.add_argument(
        "--out", type=Path, default=Path("docs/results"), help="folder (default: docs/results)"
    )
    given = parser.parse_args(argv)
    console = Console(highlight=False, markup=False, soft_wrap=True)
    name = os.environ.get(DATA_VARIABLE)
    if not name:
        console.print(f"skipped: {DATA_VARIABLE} does not say where the recordings are")
        return 0
    folder = Path(name)
    files = sample_files(folder)
    if not files:
        raise ConfigError(
            f"{DATA_VARIABLE} = {name} holds no file to import",
            expected="files in " + " or ".join(FOLDERS),
        )
    try:
        given.out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(f"cannot make --out {given.out}: {error.strerror}") from error
    origin = results_origin()
    rows: list[Row] = []
    for path in files:
        console.print(str(path.relative_to(folder)))
        rows += import_rows(path, str(path.relative_to(folder)))
    write_table(given.out, origin, rows)
    console.print(f"table: {given.out / 'import.md'}")
    return 0
