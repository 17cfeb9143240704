"""Markdown tables."""

from andabata.reference.tables import prose, table


def test_a_table_has_one_line_a_row():
    """Bars and line breaks of a text do not end its cell."""
    assert table(("a", "b"), [("1|2", "x\ny")]) == "| a | b |\n| --- | --- |\n| 1\\|2 | x y |\n"


def test_prose_marks_code_alone():
    """What Markdown would take for emphasis, a link or a tag is escaped, but not in code."""
    assert prose("Share of ``a_b*`` in\n  c_d, <e> [m].") == r"Share of `a_b*` in c\_d, \<e> \[m]."
