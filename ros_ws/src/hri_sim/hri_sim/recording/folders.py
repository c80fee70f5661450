"""Which bags a run has: one, or several where its recorder was started again."""

from __future__ import annotations

from pathlib import Path


def bag_folders(bag: Path) -> list[Path]:
    """The bags of a run that are there, in the order in which they were begun.

    Args:
        bag: Folder of the first one; a recorder that is started again goes on in ``<bag>_2`` and so on.
    """
    later = bag.parent.glob(f"{bag.name}_*")
    numbered = sorted(
        (path for path in later if path.name.removeprefix(f"{bag.name}_").isdigit()),
        key=lambda path: int(path.name.removeprefix(f"{bag.name}_")),
    )
    return [path for path in (bag, *numbered) if path.is_dir()]
