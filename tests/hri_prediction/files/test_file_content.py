"""Regular files are read whole; what is none is told by what it is."""

import os
from pathlib import Path

import pytest

from hri_prediction.errors import DataError
from hri_prediction.files.content import open_file, read_content, read_text


def test_content_and_text(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_bytes(b"\xef\xbb\xbfR\xc3\xbccken\r\n")
    assert read_content(path) == path.read_bytes()
    assert read_text(str(path)) == "Rücken\r\n"
    with open_file(path) as stream:
        assert stream.read(3) == b"\xef\xbb\xbf"
    link = tmp_path / "b.txt"
    link.symlink_to(path)
    assert read_text(link) == "Rücken\r\n"


def test_files_that_say_that_they_are_empty() -> None:
    """As those of /proc do, which tell something all the same."""
    assert Path("/proc/self/stat").stat().st_size == 0
    assert str(os.getpid()) in read_text("/proc/self/stat")


def test_a_file_that_is_too_large_is_not_begun(tmp_path: Path) -> None:
    path = tmp_path / "a.bin"
    path.write_bytes(b"12345")
    assert read_content(path, most=5) == b"12345"
    with pytest.raises(DataError, match=r"a\.bin has 5 bytes; expected a file of 4 bytes at most"):
        read_content(path, most=4)


@pytest.mark.parametrize(
    ("make", "match"),
    [
        (lambda path: path.mkdir(), "it is a folder; expected a regular file"),
        (os.mkfifo, "it is a pipe; expected a regular file"),
        (lambda path: path.symlink_to("/dev/null"), "it is a device"),
        (lambda path: path.symlink_to(path.name), "Too many levels of symbolic links"),
        (lambda path: None, "No such file or directory"),
        (
            lambda path: path.write_bytes(b"\xff\xfe"),
            "can't decode byte 0xff.*expected text in UTF-8",
        ),
    ],
)
def test_what_is_no_file_or_no_text(tmp_path: Path, make, match: str) -> None:
    make(tmp_path / "a")
    with pytest.raises(DataError, match=f"cannot read .*a: .*{match}"):
        read_text(tmp_path / "a")


def test_a_name_that_no_file_has() -> None:
    with pytest.raises(DataError, match="embedded null byte"):
        read_content("a\x00b")
