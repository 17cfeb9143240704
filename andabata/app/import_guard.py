"""A guard against other distributions that use our import names."""

from importlib.util import find_spec
from pathlib import Path

SIBLINGS = ("terrain", "worlds", "traversability", "rl")


class OriginError(ValueError):
    """A sibling package that is not ours."""


def check_origins() -> dict[str, str]:
    """Return where each package lies, without importing it.

    Raises:
        OriginError: If a sibling is missing or lies elsewhere than beside ``andabata``: its name is
            generic, and pip lets two distributions share it silently.
    """
    home = Path(__file__).resolve().parents[2]
    found = {"andabata": str(home / "andabata")}
    for name in SIBLINGS:
        spec = find_spec(name)
        origin = Path(spec.origin).resolve().parent if spec is not None and spec.origin else None
        if origin != home / name:
            raise OriginError(
                f"package {name}: expected {home / name}, got {origin}; uninstall the other "
                "distribution of that name and install andabata again"
            )
        found[name] = str(origin)
    return found
