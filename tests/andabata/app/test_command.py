"""Commands from functions: groups spread into options, help laid out."""

from dataclasses import dataclass
from typing import Annotated

import pytest
import typer

from andabata.app.command import (
    Given,
    OptionGroups,
    command,
    examples,
    help_text,
    typed_options,
)

Number = Annotated[int, typer.Option("--number", help="A number.")]


@dataclass(frozen=True)
class Numbers:
    """Group of two options."""

    number: Number = 1
    word: Annotated[str, typer.Option(help="A word.")] = "a"


def run(function, *words):
    """Run a function as the only command of an app."""
    app = typer.Typer(add_completion=False)
    app.command()(command(function))
    app(list(words), standalone_mode=False)


def test_a_group_becomes_options_and_comes_back_as_a_value():
    """Options of a group reach the function as one value; others reach it as they are."""
    found = []

    def act(*, first: bool = False, group: Numbers, last: int = 9) -> None:
        found.append((first, group, last))

    run(act)
    run(act, "--number", "5", "--word", "b", "--first", "--last", "3")
    assert found == [(False, Numbers(1, "a"), 9), (True, Numbers(5, "b"), 3)]


def test_a_parameter_may_have_the_name_of_a_field_of_its_group():
    """A group named like one of its fields does not shadow the field."""
    found = []

    def act(*, number: Numbers) -> None:
        found.append(number)

    run(act, "--number", "7")
    assert found == [Numbers(7, "a")]


@dataclass(frozen=True)
class Letters:
    """Group of one option."""

    letter: Annotated[str, typer.Option(help="A letter.")] = "x"


def test_one_parameter_may_stand_for_several_groups():
    """It is given the values of all, which are found by their groups."""
    found = []

    def act(*, own: Annotated[Given, OptionGroups((Numbers, Letters))], last: int = 9) -> None:
        found.append((own(Numbers), own(Letters), last))

    run(act, "--letter", "y", "--number", "5", "--last", "3")
    assert found == [(Numbers(5, "a"), Letters("y"), 3)]


def test_groups_are_found_by_those_that_they_are_part_of():
    """A larger group stands for the smaller one; one that is not there is an error."""

    @dataclass(frozen=True)
    class More(Letters):
        """Larger group."""

    both = Given(Numbers()) | Given(More("z"))
    assert both(Letters) == More("z")
    assert both(Numbers) == Numbers()
    with pytest.raises(KeyError, match="Letters"):
        Given(Numbers())(Letters)


def test_options_stand_in_the_order_of_the_function():
    """The fields of a group stand in the help where the group stands in the function."""

    def act(*, first: bool = False, group: Numbers, last: int = 9) -> None:
        """Act."""

    app = typer.Typer(add_completion=False)
    app.command()(command(act))
    names = [each.name for each in typer.main.get_command(app).params]
    assert names == ["first", "number", "word", "last"]


def test_arguments_keep_their_places():
    """Positional arguments keep their order, beside options with and without defaults."""
    found = []

    def act(
        *,
        one: Annotated[str, typer.Argument()],
        two: Annotated[str, typer.Argument()],
        group: Numbers,
        needed: Annotated[int, typer.Option()],
    ) -> None:
        found.append((one, two, group.number, needed))

    run(act, "x", "--needed", "4", "y")
    assert found == [("x", "y", 1, 4)]


def test_running_text_is_unwrapped_and_examples_keep_their_lines():
    """Paragraphs become one line each; examples stay apart and can be read back."""
    text = help_text("Act.\n\nOne\ntwo.\n\nExamples:\n    andabata a\n    andabata b --c 1")
    assert text.split("\n\n")[:2] == ["Act.", "One two."]
    assert examples(text) == ["andabata a", "andabata b --c 1"]
    assert [line.strip("\b") for line in text.splitlines()[-2:]] == [
        "    andabata a",
        "    andabata b --c 1",
    ]


def test_help_without_examples_has_none():
    """A docstring without a block of examples is shown as it is."""
    assert help_text("Act.") == "Act."
    assert examples("Act.") == []


def test_options_that_were_typed_are_told_from_defaults():
    """Also one that is typed with its default."""
    found = []

    def act(*, context: typer.Context, group: Numbers) -> None:
        found.append(typed_options(context))

    run(act)
    run(act, "--number", "1")
    run(act, "--word", "b", "--number", "5")
    assert found == [frozenset(), {"number"}, {"number", "word"}]
