"""Settings: files, overrides, and errors that name the field."""

import pytest
from pydantic import BaseModel, ConfigDict, Field, field_validator

from andabata.configuration.settings import SettingsError, resolve


class Inner(BaseModel):
    """Group of fields."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    radius: float = Field(default=1.0, gt=0)


class Outer(BaseModel):
    """Configuration with a group."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    inner: Inner = Field(default_factory=Inner)
    name: str = "a"
    presets: tuple[str, ...] = ("x",)


def test_overrides_win_over_the_file_and_the_file_over_the_defaults(tmp_path):
    """Overrides come over the file, and the file over the defaults."""
    file = tmp_path / "c.toml"
    file.write_text('name = "b"\n[inner]\nradius = 2.0\n')
    found = resolve(Outer, file, ["inner.radius=3", "presets=['y', 'z']"])
    assert found == Outer(inner=Inner(radius=3.0), name="b", presets=("y", "z"))


def test_a_message_that_says_what_came_does_not_say_it_twice():
    """A model's own message that ends with the value stays as it is."""

    class Named(BaseModel):
        name: str = "a"

        @field_validator("name")
        @classmethod
        def _check(cls, name: str) -> str:
            raise ValueError(f"expected 'a', got {name!r}")

    with pytest.raises(SettingsError, match=r"^name: expected 'a', got 'b'$"):
        resolve(Named, overrides=["name=b"])


def test_a_plain_word_is_a_text():
    """A value that is not TOML is taken as text."""
    assert resolve(Outer, overrides=["name=kinematic"]).name == "kinematic"


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("inner.radius=-1", r"inner\.radius: input should be greater than 0, got -1"),
        ("inner.radios=1", r"inner\.radios: expected a known field"),
        ("inner", r"--set: expected a\.b=value, got 'inner'"),
        ("name.x=1", r"--set name\.x: expected a group of fields at 'name'"),
    ],
)
def test_errors_name_the_field_and_the_value(override, message):
    """An error names the field, the expectation and the value."""
    with pytest.raises(SettingsError, match=message):
        resolve(Outer, overrides=["name=b", override])


@pytest.mark.parametrize("text", ["name = ", "name = 1 = 2", "\x00"])
def test_a_file_that_is_not_toml_is_named(tmp_path, text):
    """A file that is not TOML is an error with its name."""
    file = tmp_path / "c.toml"
    file.write_text(text)
    with pytest.raises(SettingsError, match=r"c\.toml: expected TOML"):
        resolve(Outer, file)


def test_a_missing_file_is_named(tmp_path):
    """A missing file is an error with its name."""
    with pytest.raises(SettingsError, match="missing"):
        resolve(Outer, tmp_path / "missing.toml")


def test_an_unknown_field_is_answered_with_the_one_that_is_meant():
    """A field that is elsewhere is named with its path."""
    with pytest.raises(SettingsError, match=r"radius: .* did you mean inner\.radius\?"):
        resolve(Outer, overrides=["radius=2"])


def test_an_unknown_field_that_is_like_none_is_answered_with_those_of_its_group():
    """The names that are known in its place."""
    known = ", ".join(type(Outer().inner).model_fields)
    with pytest.raises(SettingsError, match=rf"inner\.zzz: .*; known there: {known}$"):
        resolve(Outer, overrides=["inner.zzz=2"])


@pytest.mark.parametrize("value", ["inf", "-inf", "nan", "1e999", "Infinity"])
def test_numbers_are_finite(tmp_path, value):
    """Infinity passes a lower bound, and is refused with the field's name all the same."""
    with pytest.raises(SettingsError, match=r"inner\.radius: .*(finite|greater than 0)"):
        resolve(Outer, None, [f"inner.radius={value}"])


def test_oversized_numbers_and_depth_are_errors_of_the_file(tmp_path):
    """Numbers that no float holds, or that Python does not read, and nesting without end."""
    with pytest.raises(SettingsError, match=r"inner\.radius: expected a number of 64 bits"):
        resolve(Outer, None, [f"inner.radius={10**400}"])
    assert resolve(Outer, None, ["presets=['y']", f"inner.radius={2**64 - 1}"]).inner.radius > 1e19
    file = tmp_path / "c.toml"
    for text in (f"x = {'9' * 5000}", f"x = {'[' * 5000}{']' * 5000}"):
        file.write_text(text)
        with pytest.raises(SettingsError, match=r"c\.toml: expected TOML"):
            resolve(Outer, file)
