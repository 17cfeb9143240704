"""Configurations from TOML files and ``--set a.b=c``, with errors that name the field."""

import math
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from andabata.configuration.field_paths import likely_path, names_beside

Model = TypeVar("Model", bound=BaseModel)

_LARGEST = 2**64
"""Size from which a whole number is refused: seeds have 64 bits, and floats overflow later."""


class SettingsError(ValueError):
    """Settings with an unknown field, a value out of bounds, or a file that is not TOML."""


def resolve(
    kind: type[Model],
    file: Path | None = None,
    overrides: Sequence[str] = (),
    base: Model | None = None,
) -> Model:
    """Return a configuration: the base, the file over it, and the overrides over both.

    Args:
        kind: Model of the configuration.
        file: TOML file, or None.
        overrides: Texts of the form ``a.b=value``; the value is TOML, or a plain word.
        base: Configuration to begin with; None for the model's defaults.

    Raises:
        SettingsError: If a field is unknown or out of bounds, a number is not finite or has more
            than 64 bits, or the file is not TOML.
    """
    data: dict[str, Any] = base.model_dump() if base is not None else {}
    if file is not None:
        _merge(data, _read(file))
    for text in overrides:
        name, sign, value = text.partition("=")
        if not sign or not name.strip():
            raise SettingsError(f"--set: expected a.b=value, got {text!r}")
        place = data
        *path, last = name.strip().split(".")
        for part in path:
            place = place.setdefault(part, {})
            if not isinstance(place, dict):
                raise SettingsError(f"--set {name}: expected a group of fields at {part!r}")
        place[last] = _value(value)
    _check_numbers(data, ())
    try:
        settings = kind.model_validate(data)
    except ValidationError as error:
        raise SettingsError(explain(error, kind)) from error
    _check_numbers(settings.model_dump(), ())  # Words such as Infinity have become numbers.
    return settings


def with_parts(kind: type[Model], sensor: str, robot: str = "andabata") -> Model:
    """Return a configuration with the laser and the body of those names.

    Raises:
        UnknownSensorError: If there is no such laser.
        ValueError: If there is no such body.
    """
    from andabata.machine.lidar_models import sensor_settings
    from andabata.machine.robot import RobotModel

    return kind.model_validate({**sensor_settings(sensor), "robot": RobotModel.load(robot)})


def explain(error: ValidationError, kind: type[BaseModel] | None = None) -> str:
    """Return the first error on one line: the field, the expected value, the given one.

    Args:
        error: Error of a model.
        kind: Model of the whole configuration, to name the field that an unknown one means.
    """
    first = error.errors()[0]
    name = ".".join(str(part) for part in first["loc"]) or "configuration"
    if first["type"] == "extra_forbidden":
        likely = None if kind is None else likely_path(kind, name)
        beside = [] if kind is None else names_beside(kind, name)
        hint = f"known there: {', '.join(beside)}" if beside else "check its spelling"
        hint = hint if likely is None else f"did you mean {likely}?"
        return f"{name}: expected a known field, got this one; {hint}"
    message = first["msg"].removeprefix("Value error, ")
    got = first.get("input")
    says_it = isinstance(got, dict | BaseModel) or f"got {got!r}" in message
    shown = "" if says_it else f", got {got!r}"
    return f"{name}: {message[0].lower()}{message[1:]}{shown}"


def _read(file: Path) -> dict[str, Any]:
    """Return the content of a TOML file."""
    try:
        return tomllib.loads(file.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:  # Also numbers of 5,000 digits, and depth.
        raise SettingsError(f"{file}: expected TOML, got {error}") from error
    except OSError as error:
        raise SettingsError(f"{file}: expected a readable file, got {error.strerror}") from error


def _merge(data: dict[str, Any], other: dict[str, Any]) -> None:
    """Put fields over those of the data, in place, group by group."""
    for key, value in other.items():
        if isinstance(value, dict) and isinstance(data.get(key), dict):
            _merge(data[key], value)
        else:
            data[key] = value


def _value(text: str) -> Any:  # noqa: ANN401 - any TOML value.
    """Return a TOML value, or the text itself if it is not TOML."""
    try:
        return tomllib.loads(f"x = {text}")["x"]
    except (ValueError, RecursionError):
        return text.strip()


def _check_numbers(value: object, path: tuple[str, ...]) -> None:
    """Check that all numbers of a configuration are finite: infinity passes a lower bound.

    Raises:
        SettingsError: If one is not, or has more than 64 bits.
    """
    if isinstance(value, dict):
        for name, item in value.items():
            _check_numbers(item, (*path, str(name)))
    elif isinstance(value, list | tuple):
        for item in value:
            _check_numbers(item, path)
    elif isinstance(value, float) and not math.isfinite(value):
        raise SettingsError(f"{'.'.join(path)}: expected a finite number, got {value}")
    elif isinstance(value, int) and abs(value) >= _LARGEST:
        raise SettingsError(f"{'.'.join(path)}: expected a number of 64 bits, got a larger one")
