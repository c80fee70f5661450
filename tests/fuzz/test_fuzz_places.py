"""What is no file, or cannot be read: refused at once, never waited for."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable
from pathlib import Path

import fuzz_readers
import fuzz_samples
import pytest

from hri_prediction.bags import BagReader
from hri_prediction.bags.metadata import METADATA_FILE


def folder(path: Path) -> None:
    path.mkdir()


def pipe(path: Path) -> None:
    os.mkfifo(path)


def no_file(path: Path) -> None:
    """Nothing is there."""


def itself(path: Path) -> None:
    path.symlink_to(path.name)


def loop(path: Path) -> None:
    other = path.with_name(f"other_{path.name}")
    path.symlink_to(other.name)
    other.symlink_to(path.name)


def into_nothing(path: Path) -> None:
    path.symlink_to("nowhere")


def link_to_pipe(path: Path) -> None:
    os.mkfifo(path.with_name("pipe"))
    path.symlink_to("pipe")


def endless_device(path: Path) -> None:
    path.symlink_to("/dev/zero")


def terminal_less_device(path: Path) -> None:
    path.symlink_to("/dev/null")


def socket_file(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as made:
        old = os.getcwd()
        os.chdir(path.parent)  # a socket's name is short
        try:
            made.bind(path.name)
        finally:
            os.chdir(old)


def unreadable(path: Path) -> None:
    """A regular file whose first byte cannot be read, not even by root."""
    path.symlink_to("/proc/self/mem")


def forbidden(path: Path) -> None:
    path.write_bytes(b"x")
    path.chmod(0)
    if os.access(path, os.R_OK):
        pytest.skip("root may read everything")


def empty(path: Path) -> None:
    path.write_bytes(b"")


def zeros(path: Path) -> None:
    path.write_bytes(bytes(5000))


def too_large(path: Path) -> None:
    """Takes no room on the disk, and a terabyte in memory."""
    with path.open("wb") as file:
        file.write(b"PK")
        file.truncate(1 << 40)


PLACES: tuple[Callable[[Path], None], ...] = (
    *(folder, pipe, no_file, itself, loop, into_nothing, link_to_pipe, endless_device, socket_file),
    *(terminal_less_device, unreadable, forbidden, empty, zeros, too_large),
)


def read_by_folder(path: Path) -> None:
    """By the reader that the folder of a file is named after."""
    fuzz_readers.EVERYTHING[path.parent.name](path)


@pytest.mark.parametrize("place", PLACES, ids=lambda place: place.__name__)
def test_places(sandbox, tmp_path: Path, place: Callable[[Path], None]) -> None:
    box = sandbox(read_by_folder, seconds=5.0)
    for name in fuzz_readers.EVERYTHING:
        (tmp_path / name).mkdir()
        path = tmp_path / name / "file.npz"
        place(path)
        assert box.check(path).kind == "refused" or name in fuzz_readers.WITHOUT, name


def test_names_that_no_file_has(sandbox, tmp_path: Path) -> None:
    box = sandbox(read_by_folder, seconds=5.0)
    for name in fuzz_readers.EVERYTHING:
        for path in (tmp_path / name / "a\x00b.npz", tmp_path / name / f"{'long' * 100}.npz"):
            found = box.verdict(path)
            assert found.kind == "refused" or name in fuzz_readers.WITHOUT, f"{name}: {found.text}"


def read_by_link(path: Path) -> None:
    """By the reader that the link to a bag is named after."""
    fuzz_readers.BAGS[path.name](path)


@pytest.mark.parametrize("place", [folder, pipe, loop, into_nothing, endless_device, unreadable])
def test_a_bag_with_what_is_no_file_in_it(sandbox, tmp_path: Path, place) -> None:
    bag = fuzz_samples.write_bag(tmp_path / "bag", 6)
    place(bag / "another.mcap")
    (bag / METADATA_FILE).unlink()
    box = sandbox(read_by_link, seconds=5.0)
    for name in fuzz_readers.BAGS:
        (tmp_path / name).symlink_to(bag)
        found = box.verdict(tmp_path / name)
        assert found.kind == "refused", found.text
        assert "another.mcap" in found.text


def test_metadata_that_is_a_pipe(sandbox, tmp_path: Path) -> None:
    bag = fuzz_samples.write_bag(tmp_path / "bag", 6)
    (bag / METADATA_FILE).unlink()
    os.mkfifo(bag / METADATA_FILE)
    assert sandbox(BagReader, seconds=5.0).check(bag).kind == "refused"


def test_metadata_that_names_other_places(sandbox, tmp_path: Path) -> None:
    bag = fuzz_samples.write_bag(tmp_path / "bag", 6)
    text = (bag / METADATA_FILE).read_text()
    box = sandbox(BagReader, seconds=5.0)
    for name in ("/etc/passwd", "../../etc/passwd", "..", "", "/", "long" * 5000, '"a\\0b"', "[a]"):
        (bag / METADATA_FILE).write_text(text.replace("bag_0.mcap", name))
        found = box.check(bag)
        assert found.kind == "refused"
        assert len(found.text) < 1000
