"""The shipped classifiers and policies; ``README.md`` here gives the commands that made them."""

from functools import cache
from importlib.resources import files

from rl.policy import Policy
from traversability.forest import Forest
from traversability.square_forest import SquareForest


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


@cache
def shipped_squares_file() -> bytes:
    """Return the bytes of the classifier of squares that comes with the package."""
    return files(__name__).joinpath("squares.npz").read_bytes()


@cache
def shipped_squares() -> SquareForest:
    """Return the classifier of squares that comes with the package."""
    return SquareForest.from_bytes(shipped_squares_file())
