"""Text of ``--faults``: several, files, what is refused; the matrix of typical ones."""

import pytest

from andabata.app.options.faults import FaultMatrixOptions, FaultOptions, read_faults
from andabata.configuration.usage import UsageError
from andabata.machine.faults import KINDS, SENSES, Fault


def test_several_are_separated_by_commas():
    """In their order; none without the option."""
    found = FaultOptions("gnss:stuck@20, laser:off@20+10").read()
    assert found == (Fault.parse("gnss:stuck@20"), Fault.parse("laser:off@20+10"))
    assert FaultOptions().read() == ()


def test_a_file_may_stand_among_them(tmp_path):
    """It has texts, or tables."""
    path = tmp_path / "faults.toml"
    path.write_text('faults = ["imu:off@5", {sense = "gnss", kind = "jump", value = 9}]\n')
    found = read_faults(f"laser:off,{path}")
    assert [str(fault) for fault in found] == ["laser:off", "imu:off@5", "gnss:jump=9"]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "expected a readable file, got No such file"),
        ("faults = [", "expected TOML, got"),
        ("", r'expected faults = \["gnss:stuck@20", ...\] alone, got nothing$'),
        ('faults = "imu:off"', "alone, got faults$"),
        ("faults = []\nrobot = 1", "alone, got faults, robot$"),
        ('faults = ["imu:of"]', "fault: expected a kind of off"),
    ],
)
def test_what_is_no_file_of_faults_is_refused(tmp_path, content, message):
    """The option and the file are named."""
    path = tmp_path / "faults.toml"
    if content is not None:
        path.write_text(content)
    with pytest.raises(UsageError, match=f"^--faults {path}: .*{message}"):
        read_faults(str(path))


def test_what_is_no_fault_is_refused():
    """The option is named."""
    with pytest.raises(UsageError, match=r"^--faults: fault: expected SENSE:KIND.*, got ''"):
        read_faults("gnss:off,")
    with pytest.raises(UsageError, match=r"^--faults: expected each fault once, got imu:off twice"):
        read_faults("imu:off,gnss:off,imu:off@0")
    with pytest.raises(UsageError, match=r"^--faults: gnss:jump: expected a number"):
        read_faults("gnss:jump")


def test_the_matrix_has_a_typical_fault_of_each_sense_and_kind():
    """All by default; some, each once, with the times that are asked for."""
    found = read_faults(FaultMatrixOptions().text())
    assert [(each.sense, each.kind) for each in found] == [(s, k) for s in SENSES for k in KINDS]
    assert {each.onset for each in found} == {20.0}
    some = FaultMatrixOptions("gnss,imu,gnss", "off", 5.0, 2.0).text()
    assert some == "gnss:off@5+2,imu:off@5+2"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (FaultMatrixOptions(senses="gps"), "^--senses: expected some of laser, gnss"),
        (FaultMatrixOptions(kinds="frozen"), "^--kinds: expected some of off, stuck"),
        (FaultMatrixOptions(onset=float("nan")), "expected an onset of 0 s or more, got nan"),
    ],
)
def test_unknown_words_of_the_matrix_are_refused(options, message):
    """They name the option or the time."""
    with pytest.raises(UsageError, match=message):
        options.text()
