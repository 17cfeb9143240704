"""Tables for people from the figures of reports: known rows and headings."""

from rich.console import Console

from andabata.app.report_tables import drives_table, goals_table, splits_table


def text_of(table):
    """Return what a terminal of 100 columns shows."""
    console = Console(width=100, record=True, file=None, quiet=False)
    with console.capture() as capture:
        console.print(table)
    return capture.get()


def test_a_row_of_figures_is_a_row_of_the_table():
    """Values stand under the headings of their keys."""
    text = text_of(splits_table({"splits": [{"split": "train", "clouds": 12}]}))
    assert "split" in text
    assert "train" in text
    assert "12" in text
    assert "Maze2D" in text_of(drives_table({"tests": [{"stage": "Maze2D", "reached": 3}]}))


def test_attempts_have_the_columns_that_a_terminal_has_room_for():
    """Others of their figures are left to ``--json``."""
    row = {"drive": "run", "goal": 1, "outcome": "goal", "time_s": 4.0, "distance_m": 2.0}
    text = text_of(goals_table({"goals": [{**row, "spl": 0.9, "steering_variation": 0.123}]}))
    assert "reached" in text
    assert "0.90" in text
    assert "0.123" not in text
