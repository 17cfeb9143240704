"""Commands from functions: groups of options, and help that ends with examples.

typer reads one option from each parameter of a function. A parameter of a *group*, a frozen
dataclass whose fields are options, stands for all of its fields::

    @dataclass(frozen=True)
    class ConsoleOptions:
        as_json: Json = False
        quiet: Quiet = False

    @app.command()
    @command
    def show(*, name: Name, output: ConsoleOptions) -> None: ...

The command has the options ``--json`` and ``--quiet``, and ``show`` is called with
``output=ConsoleOptions(as_json=..., quiet=...)``.

A parameter of ``Annotated[Given, OptionGroups(...)]`` stands for several groups, which a registry
names.
"""

import inspect
from collections.abc import Callable
from dataclasses import dataclass, is_dataclass
from functools import wraps
from typing import Any, TypeVar

import typer

EXAMPLES = "Examples:"
"""First line of the block of a docstring that shows command lines, one a line."""


Group = TypeVar("Group")


class Given:
    """Groups of options as they were given."""

    def __init__(self, *groups: object) -> None:
        """Take values of groups."""
        self._groups = groups

    def __call__(self, group: type[Group]) -> Group:
        """Return the value of a group, which may be that of one that holds it.

        Raises:
            KeyError: If the command has no such group.
        """
        for value in self._groups:
            if isinstance(value, group):
                return value
        raise KeyError(group.__name__)

    def __or__(self, others: "Given") -> "Given":
        """Return the groups of both."""
        return Given(*self._groups, *others._groups)


@dataclass(frozen=True)
class OptionGroups:
    """Groups that one parameter of a command stands for.

    Attributes:
        groups: Groups in the order of their options.
    """

    groups: tuple[type, ...]


def command(function: Callable[..., None]) -> Callable[..., None]:
    """Return a function that typer can take: groups spread into options, help laid out.

    Args:
        function: Command whose parameters are options, arguments or groups of options.
    """
    annotations = inspect.get_annotations(function)
    groups = {name: spread for name, each in annotations.items() if (spread := _groups(each))}
    parameters: list[inspect.Parameter] = []
    for parameter in inspect.signature(function).parameters.values():
        mine = groups.get(parameter.name, ())
        parameters += [each for group in mine for each in _parameters(group)] or [parameter]

    @wraps(function)
    def run(**values: Any) -> None:  # noqa: ANN401 - options are of any type.
        built = {name: [_built(group, values) for group in mine] for name, mine in groups.items()}
        for name, some in built.items():
            values[name] = some[0] if is_dataclass(annotations[name]) else Given(*some)
        function(**values)

    # Options are named, so their order is free of Python's rule on defaults.
    parameters = [each.replace(kind=inspect.Parameter.KEYWORD_ONLY) for each in parameters]
    run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    run.__annotations__ = {each.name: each.annotation for each in parameters}
    run.__doc__ = help_text(inspect.getdoc(function) or "")
    return run


def typed_options(context: typer.Context) -> frozenset[str]:
    """Return the names of the options on the command line, also of those at their defaults."""
    return frozenset(
        name
        for name in context.params
        if (source := context.get_parameter_source(name)) is not None
        and source.name == "COMMANDLINE"
    )


def examples(text: str) -> list[str]:
    """Return the command lines in the block of examples that ends a help text."""
    _, _, block = text.partition(EXAMPLES)
    return [line for line in (line.strip("\b ") for line in block.splitlines()) if line]


def help_text(docstring: str) -> str:
    """Return a docstring as typer shows it best: running text unwrapped, examples line by line."""
    text, heading, block = docstring.partition(f"\n{EXAMPLES}\n")
    paragraphs = [" ".join(paragraph.split()) for paragraph in text.strip().split("\n\n")]
    if heading:
        # A backspace, which is not shown, keeps line breaks and indents in all versions of typer.
        paragraphs.append("\n".join(f"\b{line}" for line in [EXAMPLES, *block.splitlines()]))
    return "\n\n".join(paragraphs)


def _groups(annotation: Any) -> tuple[type, ...]:  # noqa: ANN401 - any annotation.
    """Return the groups that a parameter stands for, none for an option."""
    if isinstance(annotation, type) and is_dataclass(annotation):
        return (annotation,)
    several = (each for each in getattr(annotation, "__metadata__", ()))
    return next((each.groups for each in several if isinstance(each, OptionGroups)), ())


def _built(group: type, values: dict[str, Any]) -> Any:  # noqa: ANN401 - a value of the group.
    """Return the value of a group, whose options are taken out of all values."""
    return group(**{each.name: values.pop(each.name) for each in _parameters(group)})


def _parameters(group: type) -> list[inspect.Parameter]:
    """Return the fields of a group as parameters with their annotations and defaults."""
    return list(inspect.signature(group).parameters.values())
