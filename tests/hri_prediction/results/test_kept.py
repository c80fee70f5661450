"""Parts of long work that are kept."""

from __future__ import annotations

from pathlib import Path

from hri_prediction.results.kept import kept

WORK, PACKAGES = "hri_prediction.results.kept", ("numpy",)


def test_what_was_done_is_not_done_again(tmp_path: Path) -> None:
    made: list[int] = []

    def make() -> dict[str, float | None]:
        made.append(1)
        return {"a": 1.5, "b": None}

    for _ in range(2):
        assert kept(tmp_path, WORK, PACKAGES, "a part", make) == {"a": 1.5, "b": None}
    assert len(made) == 1
    for file in tmp_path.iterdir():
        file.write_text("{")  # broken off
    assert kept(tmp_path, WORK, PACKAGES, "a part", make)["a"] == 1.5
    assert len(made) == 2
    kept(tmp_path, WORK, PACKAGES, "another part", make)
    assert len(made) == 3
    # Other versions, other sources: another result.
    kept(tmp_path, WORK, ("numpy", "scipy"), "a part", make)
    kept(tmp_path, "hri_prediction.results.folder", PACKAGES, "a part", make)
    assert len(made) == 5
