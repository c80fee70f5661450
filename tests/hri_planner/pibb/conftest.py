"""Makes this folder's helpers importable, and a session on disk."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from sessions import PERSON, advanced

from hri_planner.pibb.storage import save_session


@pytest.fixture
def saved(tmp_path: Path) -> Path:
    """The folder of a session in the middle of its second update."""
    save_session(tmp_path, advanced(6 + 12 + 5), **PERSON)
    return tmp_path
