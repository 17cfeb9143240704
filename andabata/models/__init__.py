"""The shipped forest and policies; ``README.md`` here gives the commands that made them."""

from functools import cache
from importlib.resources import files

from rl.policy import Policy
from traversability.forest import Forest


@cache
def shipped_forest_file() -> bytes:
    """Return the bytes of the cell classifier that comes with the package."""
    return files(__name__).joinpath("forest.npz").read_bytes()


@cache
def shipped_forest() -> Forest:
    """Return the cell classifier that comes with the package."""
    return Forest.from_bytes(shipped_forest_file())


@cache
def shipped_policy(name: str = "policy") -> Policy:
    """Return an actor that comes with the package: ``policy`` or ``actor-critic``."""
    return Policy.from_bytes(files(__name__).joinpath(f"{name}.safetensors").read_bytes())
