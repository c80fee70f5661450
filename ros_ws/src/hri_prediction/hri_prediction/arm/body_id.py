"""Names of bodies: each becomes part of the names of topics."""

from __future__ import annotations

import re

BODY_ID_RULE = (
    "letters, digits and _, not beginning with a digit, at most 64: it becomes part of topics"
)
_BODY_ID = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,63}")


def valid_body_id(name: str) -> bool:
    """Whether a body can have this name."""
    return _BODY_ID.fullmatch(name) is not None
