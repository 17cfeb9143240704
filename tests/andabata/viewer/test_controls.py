"""Controls of the page: what they do with values that no page sends."""

from types import SimpleNamespace

from andabata.viewer.controls import on_choice


def test_only_choices_of_a_dropdown_do_something():
    """A page's message may hold any text; one that is no choice ends no drive."""
    handlers, taken = [], []
    dropdown = SimpleNamespace(options=("a", "b"), value="a", on_update=handlers.append)
    on_choice(dropdown, taken.append)
    for value in ("b", "c", "a"):
        dropdown.value = value
        handlers[0](None)
    assert taken == ["b", "a"]
