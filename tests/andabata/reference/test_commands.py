"""Command reference: every command with every option."""

import re

from andabata.reference.commands import commands_page, walk

PAGE = commands_page()
SECTIONS = {
    part.partition("\n")[0]: part for part in re.split(r"^## ", PAGE, flags=re.MULTILINE)[1:]
}


def test_every_command_has_a_section_with_all_its_options():
    """Groups have none of their own; arguments are in capitals."""
    single = {f"andabata {path}": each for path, each in walk() if not hasattr(each, "commands")}
    assert set(SECTIONS) == set(single)
    for name, command in single.items():
        for parameter in command.params:
            for option in (*parameter.opts, *parameter.secondary_opts):
                shown = option if option.startswith("-") else option.upper()
                assert f"`{shown}`" in SECTIONS[name]


def test_a_row_has_value_default_and_meaning():
    """Bounds, switches, repeated options and files are told apart."""
    drive = SECTIONS["andabata drive"]
    assert "| `--time-limit` | number from 1 | `300.0` | Longest drive" in drive
    assert "| `--clouds`, `--no-clouds` |  | `--clouds` | Record" in drive
    assert "| `--goal` | `X,Y`, repeatable |  | Goal" in drive
    assert "| `--out` | path | `data/runs/drive` |" in drive
    assert "| `--quiet` |  |  | Print nothing but the result. |" in drive
    assert "| `--namespace` | `/NAME` |  | Prefix" in SECTIONS["andabata ros2 robot"]
    assert "| `--seed` | integer from 0 | `7300` | Seed of everything random, and of the" in drive
    assert "| `NAME` | text | to be given | Preset" in SECTIONS["andabata world show"]


def test_examples_are_a_block_of_code():
    """Each example is on an indented line of its own."""
    assert "\n\n    andabata drive\n    andabata drive --" in SECTIONS["andabata drive"]


def test_commands_come_in_the_order_of_the_help():
    """The first one checks the installation, the last one is the demonstration."""
    assert next(iter(SECTIONS)) == "andabata doctor"
    assert list(SECTIONS)[-1] == "andabata demo"
