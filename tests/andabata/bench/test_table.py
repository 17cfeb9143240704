"""Rows and Markdown tables of benchmarks."""

from andabata.bench.table import benchmark_row, markdown_table


def test_a_benchmark_row_has_the_keys_that_scripts_rely_on():
    """The keys of ``bench --json``, in their order."""
    assert benchmark_row("n", "s", 2.0, "m", 3, 0.5) == {
        "name": "n",
        "subject": "s",
        "value": 2.0,
        "unit": "m",
        "ratio_to_ours": 0.5,
        "runs": 3,
    }
    assert benchmark_row("n", "s", 2.0, "m", 3)["ratio_to_ours"] is None


def test_a_markdown_table_has_the_columns_of_the_first_row():
    """Floats have four digits; what is missing is a dash."""
    rows = [{"a": 1.23456, "b": "x"}, {"b": 1_000_000, "c": 0}]
    assert markdown_table(rows) == "| a | b |\n| --- | --- |\n| 1.235 | x |\n| - | 1000000 |\n"


def test_no_rows_make_no_table():
    """An empty table is an empty text."""
    assert markdown_table([]) == ""
