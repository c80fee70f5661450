"""What to do, in plain words, about everything that nodes say is wrong.

Found by the words of a trouble first, where these tell more, then by the key of the fault. A test looks
through the sources: every fault that a node notes has an advice.
"""

from __future__ import annotations

import re

from hri_sim.health.advice_table import TABLE

UNKNOWN = "The node's terminal, or log/<node>.log in the folder of the run, says more."


def known(key: str) -> bool:
    """Whether there is an advice for a key, whatever is said."""
    return any(advice.is_for(key) for advice in TABLE)


def advise(key: str, text: str) -> str:
    """What to do about a trouble.

    Args:
        key: Key of the fault; empty where only the words are known.
        text: What is said of it.

    Returns:
        Plain words; :data:`UNKNOWN` when there is no better advice.
    """
    for advice in TABLE:
        if advice.words and re.search(advice.words, text):
            return advice.do
    return next((advice.do for advice in TABLE if advice.is_for(key)), UNKNOWN)
