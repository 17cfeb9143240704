"""Paths of all fields of a configuration, and the one that a wrong path most likely means."""

from collections.abc import Iterator
from difflib import get_close_matches
from types import UnionType
from typing import Any, Union, get_args, get_origin

from pydantic import BaseModel


def models_in(annotation: Any) -> Iterator[type[BaseModel]]:  # noqa: ANN401 - any type.
    """Yield the models in a type."""
    if isinstance(annotation, type) and not get_args(annotation):
        if issubclass(annotation, BaseModel):
            yield annotation
        return
    for part in get_args(annotation):
        yield from models_in(part)


def setting_paths(kind: type[BaseModel], head: str = "") -> Iterator[str]:
    """Yield the path of each field of a model, such as ``robot.mass``, groups before their fields.

    Fields of models in a dict or a tuple are left out: their paths have names or numbers that are
    not known here.
    """
    for name, info in kind.model_fields.items():
        yield head + name
        if get_origin(info.annotation) in (None, Union, UnionType):
            for model in models_in(info.annotation):
                yield from setting_paths(model, f"{head}{name}.")


def names_beside(kind: type[BaseModel], path: str) -> list[str]:
    """Return the names of the fields in the group of a wrong path, none if there is no such group.

    Args:
        kind: Model of the whole configuration.
        path: Path of the wrong field.
    """
    group = path.rpartition(".")[0]
    parts = dict.fromkeys(one.rpartition(".")[::2] for one in setting_paths(kind))
    return [name for head, name in parts if head == group]


def likely_path(kind: type[BaseModel], path: str) -> str | None:
    """Return the field that a wrong path most likely means, None if nothing is near.

    A field of that name elsewhere comes first, the one with the shortest path of several, then
    the path that is spelt most alike.
    """
    paths = list(dict.fromkeys(setting_paths(kind)))
    namesakes = [one for one in paths if one.rpartition(".")[2] == path.rpartition(".")[2]]
    if namesakes:
        return min(namesakes, key=lambda one: one.count("."))
    return next(iter(get_close_matches(path, paths, n=1, cutoff=0.8)), None)
