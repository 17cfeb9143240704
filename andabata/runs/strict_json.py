"""JSON as RFC 8259 has it: Python's own writer also writes NaN and Infinity, which others refuse.

Numbers that are not finite become null, in files as in the output of ``--json``. What reads a file
of ours takes null for a figure that is unknown.
"""

import json
import math
from collections.abc import Mapping
from typing import Any


def finite(value: Any) -> Any:  # noqa: ANN401 - any JSON value.
    """Return data for JSON with null in place of numbers that are not finite."""
    if isinstance(value, Mapping):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def dumps(value: Any, **options: Any) -> str:  # noqa: ANN401 - any JSON value; options of json.
    """Return data as text of strict JSON; see ``json.dumps`` for the options."""
    return json.dumps(finite(value), allow_nan=False, **options)
