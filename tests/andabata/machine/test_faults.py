"""Faults as values: their text and file forms, what is refused, and when they are active."""

import pytest
from pydantic import BaseModel, ValidationError

from andabata.configuration.settings import SettingsError, resolve
from andabata.machine.faults import (
    JUMPS,
    KINDS,
    SENSES,
    Fault,
    FaultSetting,
    as_fault,
    typical_faults,
    typical_value,
)


class Robot(BaseModel):
    """Settings with faults."""

    faults: tuple[FaultSetting, ...] = ()


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("laser:off", Fault("laser", "off")),
        ("gnss:stuck@20", Fault("gnss", "stuck", onset=20.0)),
        ("laser:off@20+10", Fault("laser", "off", None, 20.0, 10.0)),
        ("gnss:jump=500@20+15", Fault("gnss", "jump", 500.0, 20.0, 15.0)),
        ("wheels:scale=-1@0.5", Fault("wheels", "scale", -1.0, 0.5)),
        ("imu:delayed=0.5@0+2.5", Fault("imu", "delayed", 0.5, 0.0, 2.5)),
        ("gnss:scale=1.0001", Fault("gnss", "scale", 1.0001)),
        ("imu:scale=1e-07@3", Fault("imu", "scale", 1e-7, 3.0)),
    ],
)
def test_a_text_and_its_fault_are_one(text, fault):
    """Parsing a text gives the fault, whose text it is; spaces do not count."""
    assert Fault.parse(text) == fault
    assert str(fault) == text
    assert Fault.parse(f" {text.replace('@', ' @ ')}") == fault


def test_large_numbers_come_back():
    """The plus sign of an exponent is no duration."""
    fault = Fault("gnss", "jump", 1e6, 1e17, 1e18)
    assert Fault.parse(str(fault)) == fault


def test_garbage_alone_has_a_default():
    """Half of the values, which its text says."""
    assert Fault.parse("compass:garbage@20") == Fault("compass", "garbage", 0.5, 20.0)
    assert str(Fault("compass", "garbage")) == "compass:garbage=0.5"
    assert [name for name, kind in KINDS.items() if kind.default is not None] == ["garbage"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("gnss", r"^fault: expected SENSE:KIND.*, got 'gnss'; `andabata faults --list` has"),
        ("", r"got ''"),
        ("gps:off", r"^fault: expected a sense of laser, gnss, .*, got 'gps'; `andabata faults"),
        ("gnss:frozen", r"^fault: expected a kind of off, .*, got 'frozen'"),
        ("gnss:jump@20", r"^gnss:jump: expected a number, metres to the north, got none; write "),
        ("imu:slow", r"^imu:slow: expected a number, share, got none; write imu:slow=0.1$"),
        ("laser:off=3", r"^laser:off: expected no number, got 3; leave out =3$"),
        ("laser:off@-1", r"^laser:off: expected an onset of 0 s or more, got -1; count it from"),
        ("laser:off@1+0", r"expected a duration of more than 0 s, got 0; leave it out for"),
        ("laser:off@soon", r"^fault laser:off@soon: expected .* with numbers, got 'soon'$"),
        ("laser:off@nan", r"got 'nan'$"),
        ("imu:jump=", r"got ''$"),
        ("imu:slow=1", r"expected share above 0 and up to 1 other than 1, got 1$"),
        ("imu:slow=0", r"expected share above 0 .*, got 0$"),
        ("imu:garbage=1.5", r"expected share of the values above 0 and up to 1, got 1.5$"),
        ("gnss:scale=1", r"expected factor .* other than 1, got 1$"),
        ("gnss:jump=0", r"expected metres to the north .* other than 0, got 0$"),
        ("gnss:delayed=-1", r"expected seconds above 0 and up to 600, got -1$"),
        ("gnss:intermittent=0.1", r"expected seconds of a period from 0.2 to 600, got 0.1$"),
    ],
)
def test_what_is_no_fault_is_refused_on_one_line(text, message):
    """Unknown words, missing or meaningless numbers and negative times say what was expected."""
    with pytest.raises(ValueError, match=message) as raised:
        Fault.parse(text)
    assert "\n" not in str(raised.value)


def test_the_step_that_a_missing_number_advises_works():
    """Each kind with a number names a text that is a fault."""
    for sense in SENSES:
        for kind, about in KINDS.items():
            if not about.parameter or about.default is not None:
                continue
            with pytest.raises(ValueError, match="; write ") as raised:
                Fault(sense, kind)
            Fault.parse(str(raised.value).partition("; write ")[2])


def test_bounds_belong_to_the_numbers():
    """The shortest period, all values, the largest factor; an onset that never comes does not."""
    for text in ("gnss:intermittent=0.2", "imu:garbage=1", "imu:scale=-1e9", "gnss:delayed=600"):
        Fault.parse(text)
    with pytest.raises(ValueError, match="expected an onset of 0 s or more, got inf"):
        Fault("laser", "off", onset=float("inf"))


def test_files_have_texts_or_tables():
    """Both give the same faults; JSON has texts, which settings take back."""
    table = {"sense": "gnss", "kind": "jump", "value": 500, "onset": 20}
    robot = Robot(faults=("laser:off@20+10", table))
    assert robot.faults == (Fault.parse("laser:off@20+10"), Fault.parse("gnss:jump=500@20"))
    assert robot.model_dump(mode="json") == {"faults": ["laser:off@20+10", "gnss:jump=500@20"]}
    assert resolve(Robot, base=robot) == robot
    assert resolve(Robot, overrides=['faults=["imu:off"]']).faults == (Fault("imu", "off"),)
    assert as_fault(robot.faults[0]) is robot.faults[0]


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ({"sense": "gnss"}, "expected a text SENSE:KIND.* or a table with sense, kind"),
        ({"sense": "gnss", "kind": "off", "start": 3}, "got {'sense'"),
        (7, "got 7$"),
        ({"sense": "gnss", "kind": "off", "onset": "20"}, "fault.onset: expected a number, got "),
        ({"sense": "gnss", "kind": "off", "onset": True}, "fault.onset: expected a number, got "),
    ],
)
def test_other_entries_of_a_file_are_refused(data, message):
    """A table without a kind, with an unknown field, or with a word for a number."""
    with pytest.raises(ValueError, match=message):
        as_fault(data)


def test_an_error_in_settings_names_the_field():
    """The path of the entry comes first."""
    with pytest.raises(SettingsError, match=r"^faults\.0: fault: expected a sense of laser"):
        resolve(Robot, overrides=['faults=["gps:off"]'])
    with pytest.raises(ValidationError):
        Robot(faults=("gnss:jump",))


def test_a_fault_is_active_from_its_onset_until_before_its_end():
    """Both ends are exact where sums of decimal numbers are not; without a duration it stays."""
    fault = Fault("laser", "off", None, 0.1 + 0.2, 0.3)
    stamps = [k / 10 for k in range(9)]
    assert [fault.is_active(stamp) for stamp in stamps] == [False] * 3 + [True] * 3 + [False] * 3
    assert Fault("laser", "off", None, 20.0).is_active(1e6)


def test_there_is_a_typical_fault_of_each_sense_and_kind():
    """Senses first, in the given order, with the given times; no two are the same."""
    found = typical_faults(SENSES, tuple(KINDS), 20.0, 5.0)
    assert [(each.sense, each.kind) for each in found] == [(s, k) for s in SENSES for k in KINDS]
    assert {(each.onset, each.duration) for each in found} == {(20.0, 5.0)}
    assert set(JUMPS) == set(SENSES)
    assert typical_value("gnss", "jump") != typical_value("laser", "jump")
    assert typical_value("gnss", "off") is None
    with pytest.raises(ValueError, match="expected a kind"):
        typical_faults(("gnss",), ("frozen",), 0.0)
