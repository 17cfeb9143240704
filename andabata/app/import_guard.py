"""Guard against other distributions with our import names."""

from importlib.util import find_spec
from pathlib import Path

SIBLINGS = ("terrain", "worlds", "traversability", "rl")


class OriginError(ValueError):
    """A sibling package of another distribution."""


def check_origins() -> dict[str, str]:
    """Return the folder of each package, without importing it.

    Raises:
        OriginError: If a sibling is missing or is not beside ``andabata``. The names are generic,
            and pip installs two distributions of one name over each other without a word.
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
