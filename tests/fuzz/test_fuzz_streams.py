"""What comes over the network from a motion capture server, altered in any way."""

from __future__ import annotations

from pathlib import Path

import fuzz_readers
import fuzz_samples
import pytest
from fuzz_bytes import BYTES, TEXT, altered
from fuzz_run import LIMIT, fuzz
from fuzz_streams import layouts, streams
from hypothesis import strategies as st

pytestmark = LIMIT


def test_packets(sandbox, tmp_path: Path) -> None:
    pytest.importorskip("qtm_rt")
    files = fuzz_samples.qtm_streams()
    contents = st.one_of(streams(files), altered(files))
    fuzz(sandbox, fuzz_readers.qtm_stream, contents, tmp_path / "stream", files)


def test_settings_of_the_server(sandbox, tmp_path: Path) -> None:
    files = fuzz_samples.qtm_layouts()
    contents = st.one_of(layouts(), altered(files, (*BYTES, *TEXT)))
    fuzz(sandbox, fuzz_readers.qtm_layout, contents, tmp_path / "layout.xml", files)
