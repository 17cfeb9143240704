"""Notice of the first compilation: once, and only where one waits for it."""

import subprocess
import sys

from terrain.compilation import compilation_begins, on_first_compilation


def test_a_notice_is_given_once():
    """The first compilation gives it, the others do not."""
    said = []
    on_first_compilation(lambda: said.append("a"))
    assert said == []
    compilation_begins()
    compilation_begins()
    assert said == ["a"]


def test_a_later_notice_replaces_one_that_waits():
    """Of two commands in one process the second one speaks."""
    said = []
    on_first_compilation(lambda: said.append("a"))
    on_first_compilation(lambda: said.append("b"))
    compilation_begins()
    assert said == ["b"]


def test_to_ask_for_it_imports_no_compiler():
    """The command line answers at once."""
    code = "import sys, terrain.compilation; sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
