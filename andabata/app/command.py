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
"""

import inspect
from collections.abc import Callable
from dataclasses import is_dataclass
from functools import wraps
from typing import Any

EXAMPLES = "Examples:"
"""First line of the block of a docstring that shows command lines, one a line."""


def command(function: Callable[..., None]) -> Callable[..., None]:
    """Return a function that typer can take: groups spread into options, help laid out.

    Args:
        function: Command whose parameters are options, arguments or groups of options.
    """
    groups = {
        name: group
        for name, group in inspect.get_annotations(function).items()
        if isinstance(group, type) and is_dataclass(group)
    }
    parameters: list[inspect.Parameter] = []
    for parameter in inspect.signature(function).parameters.values():
        group = groups.get(parameter.name)
        parameters += _parameters(group) if group else [parameter]

    @wraps(function)
    def run(**values: Any) -> None:  # noqa: ANN401 - options are of any type.
        built = {
            name: group(**{each.name: values.pop(each.name) for each in _parameters(group)})
            for name, group in groups.items()
        }
        function(**values, **built)

    # Options are named, so their order is free of Python's rule on defaults.
    parameters = [each.replace(kind=inspect.Parameter.KEYWORD_ONLY) for each in parameters]
    run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    run.__annotations__ = {each.name: each.annotation for each in parameters}
    run.__doc__ = help_text(inspect.getdoc(function) or "")
    return run


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


def _parameters(group: type) -> list[inspect.Parameter]:
    """Return the fields of a group as parameters with their annotations and defaults."""
    return list(inspect.signature(group).parameters.values())
