"""The verb without a command: its help ends with examples that parse."""

import shlex

from andabata.app.command import examples
from tests.support.documents import complaint, verbs

HELP = dict(verbs())["bench"].help


def test_help_of_the_group_ends_with_examples():
    """They are calls of the verb itself with options that it has."""
    lines = examples(HELP)
    assert 2 <= len(lines) <= 5
    for line in lines:
        words = shlex.split(line)
        assert words[:2] == ["andabata", "bench"]
        assert all(word.startswith("--") for word in words[2:3])
        assert complaint(line) is None
        assert len(line) <= 74
