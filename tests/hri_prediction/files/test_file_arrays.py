"""Archives give the arrays that numpy gives, except where these would do harm."""

import io
import warnings
import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from hri_prediction.errors import DataError
from hri_prediction.files.arrays import parse_arrays, read_arrays

NUMBERS = st.one_of(
    *(hnp.floating_dtypes(), hnp.integer_dtypes(), hnp.boolean_dtypes(), hnp.datetime64_dtypes()),
    hnp.byte_string_dtypes(min_len=1),
)
SHAPES = hnp.array_shapes(min_dims=0, min_side=0)
CHARACTERS = st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=3)
ARRAYS = st.one_of(
    NUMBERS.flatmap(lambda kind: hnp.arrays(kind, SHAPES)),
    hnp.arrays("<U3", SHAPES, elements=CHARACTERS),
)


@given(ARRAYS, st.booleans(), st.booleans())
def test_what_is_written_is_read(array: np.ndarray, packed: bool, fortran: bool) -> None:
    out = io.BytesIO()
    array = np.asfortranarray(array) if fortran else array
    (np.savez_compressed if packed else np.savez)(out, first=array, second=np.zeros(3))
    found = parse_arrays(out.getvalue())
    assert list(found) == ["first", "second"]
    assert found["first"].dtype == array.dtype
    assert found["first"].flags.f_contiguous == array.flags.f_contiguous
    assert found["first"].flags.writeable
    np.testing.assert_array_equal(found["first"], array)


def test_texts_of_another_byte_order() -> None:
    out = io.BytesIO()
    np.savez(out, a=np.array(["ü", "😀"], dtype=">U1"))
    assert parse_arrays(out.getvalue())["a"].tolist() == ["ü", "😀"]


def archive(*members: tuple[str, bytes], method: int = zipfile.ZIP_STORED) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", method) as made, warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of names that are there twice
        for name, data in members:
            made.writestr(name, data)
    return out.getvalue()


def npy(array: np.ndarray, *changes: tuple[bytes, bytes]) -> bytes:
    out = io.BytesIO()
    np.save(out, array)
    data = out.getvalue()
    for old, new in changes:
        assert len(old) == len(new)
        data = data.replace(old, new)
    return data


FIVE = npy(np.arange(5.0))


@pytest.mark.parametrize(
    ("members", "match"),
    [
        (
            [("a.npy", npy(np.arange(5.0), (b"(5,)", b"(9,)")))],
            r"claims the shape \(9,\) of float64",
        ),
        ([("a.npy", npy(np.arange(5.0), (b"(5,)", b"(4,)")))], r"in 40 bytes"),
        ([("a.npy", npy(np.zeros((5, 0)), (b"(5, 0)", b"(-1,0)")))], r"claims the shape"),
        ([("a.npy", npy(np.arange(5.0), (b"'<f8'", b"'|O8'")))], "Python objects|valid dtype"),
        ([("a.npy", npy(np.array(["ab"]))[:-1] + b"\x7f")], "holds texts that are no Unicode"),
        ([("a.npy", npy(np.array(["a"]))[:-4] + b"\x00\xd8\x00\x00")], "texts that are no Unicode"),
        ([("a.npy", FIVE), ("a.npy", FIVE)], "holds an array twice"),
        ([("a.npy", FIVE), ("a", FIVE)], "holds an array twice"),
        ([("a.txt", b"words of a text")], "magic string is not correct"),
        ([("a.npy", FIVE[:6] + b"\x03" + FIVE[7:])], r"version \(3, 0\)"),
        ([("a.npy", FIVE[:-1])], "claims the shape"),
        ([("a.npy", b"")], "magic string"),
    ],
)
def test_what_would_do_harm(members: list[tuple[str, bytes]], match: str) -> None:
    with pytest.raises(DataError, match=f"{match}.*; expected a whole .npz file of plain arrays"):
        parse_arrays(archive(*members))


def test_an_archive_that_unpacks_to_too_much() -> None:
    content = archive(
        *((f"{i}.npy", bytes(60_000_000)) for i in range(5)), method=zipfile.ZIP_DEFLATED
    )
    assert len(content) < 1_000_000
    with pytest.raises(DataError, match="an archive that unpacks to 5 files of 300000000 bytes"):
        parse_arrays(content)


def test_compressions_that_numpy_does_not_write() -> None:
    with pytest.raises(DataError, match="has a compression that numpy does not write"):
        parse_arrays(archive(("a.npy", FIVE), method=zipfile.ZIP_LZMA))


def test_files_name_themselves(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    path.write_bytes(b"PK")
    with pytest.raises(
        DataError, match=r"cannot read .*a\.npz: File is not a zip file; expected a whole"
    ):
        read_arrays(path)
    np.savez(path, a=np.arange(3))
    assert read_arrays(str(path))["a"].tolist() == [0, 1, 2]
