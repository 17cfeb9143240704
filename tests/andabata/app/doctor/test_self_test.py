"""The self-test passes here, and each check fails when what it checks is broken."""

import json

import numpy as np
import pytest

from andabata.app.cli import main
from andabata.app.doctor import installation, self_test
from andabata.app.doctor.import_guard import PackageOriginError
from andabata.app.doctor.self_test import CHECKS, Finding, self_test_text


def test_all_checks_pass_and_tell_their_figures(capsys, monkeypatch):
    """Every line has a figure; the command ends with 0."""
    monkeypatch.setattr(installation, "MODULES", ("numpy",))  # Others' imports take long.
    assert main(["doctor", "--self-test", "--json", "--quiet"]) == 0
    found = json.loads(capsys.readouterr().out)["self_test"]
    assert [check["name"] for check in found["checks"]] == list(CHECKS)
    assert all(check["passed"] and check["figure"] for check in found["checks"])
    numbers = {check["name"]: check["value"] for check in found["checks"]}
    assert 0.0 <= numbers["rays to a known plane"] < 1.0
    assert 0.0 <= numbers["filter against filterpy"] < 1e-9
    text = self_test_text(found)
    assert text.count("PASS") == len(CHECKS)
    assert f"all {len(CHECKS)} passed" in text


def test_a_failure_ends_with_1_and_the_others_go_on(capsys, monkeypatch):
    """A check that raises has failed with its error; the rest is still checked."""

    def broken():
        raise ImportError("libusb-1.0.so.0: cannot open\nshared object file")

    monkeypatch.setattr(installation, "MODULES", ("numpy",))
    checks = {"rays": broken, "policy": lambda: Finding(True, "fine")}
    monkeypatch.setattr(self_test, "CHECKS", checks)
    assert main(["doctor", "--self-test"]) == 1
    lines = capsys.readouterr().out.splitlines()
    wanted = "expected an answer, got ImportError: libusb-1.0.so.0: cannot open shared object file"
    assert any(line.startswith("FAIL  rays") and line.endswith(wanted) for line in lines)
    assert any(line.startswith("PASS  policy") for line in lines)
    assert any(line.startswith("1 of 2 failed") for line in lines)


def test_wrong_ranges_are_found(monkeypatch):
    """A ray caster that is off by a centimetre fails."""
    from worlds.rays.scene import RayScene

    cast = RayScene.cast
    monkeypatch.setattr(
        RayScene, "cast", lambda *given: (cast(*given)[0] + np.float32(0.01), cast(*given)[1])
    )
    finding = self_test.check_rays()
    assert not finding.passed
    assert finding.value == pytest.approx(10.0, abs=0.1)


def test_a_filter_that_is_not_filterpys_is_found(monkeypatch):
    """A fix that is not taken in makes a difference."""
    from andabata.localization import measurement_models

    monkeypatch.setattr(measurement_models, "correct_gnss", lambda *given: 0.0)
    assert not self_test.check_filter().passed


def test_a_scanner_without_the_wall_is_found(monkeypatch):
    """Level ground alone ends no range ahead."""
    cloud = self_test.wall_cloud()
    monkeypatch.setattr(self_test, "wall_cloud", lambda: cloud[cloud[:, 2] < 0.1])
    assert not self_test.check_scan().passed


def test_a_policy_that_turns_away_is_found(monkeypatch):
    """The goal on the left has to be on the left."""
    from andabata.machine.kinematics import Twist
    from andabata.navigation.policy_controller import PolicyController

    def away(controller, situation):
        return Twist(0.3, -situation.heading_error)

    monkeypatch.setattr(PolicyController, "act", away)
    assert not self_test.check_policy().passed


def test_a_recording_that_changes_its_messages_is_found(monkeypatch):
    """Another time of a message counts as another message."""
    from andabata.records.messages import MessageBuilder

    stamp_ns = MessageBuilder.stamp_ns
    calls = iter(range(10**6))
    monkeypatch.setattr(
        MessageBuilder,
        "stamp_ns",
        lambda builder, seconds: stamp_ns(builder, seconds) + next(calls),
    )
    finding = self_test.check_recording()
    assert not finding.passed


def test_a_cache_that_cannot_be_written_is_found(monkeypatch):
    """Without a folder, and without compiled code, the next step is told."""
    from traversability.cartesian import rolling_grid

    class Uncached:
        """Compiled function without a cache."""

        class stats:  # noqa: N801 - numba's name.
            cache_path = None

    monkeypatch.setattr(rolling_grid, "follow", Uncached)
    assert "set NUMBA_CACHE_DIR" in self_test.check_kernel_cache().figure
    monkeypatch.setattr(rolling_grid, "follow", lambda: None)
    finding = self_test.check_kernel_cache()
    assert (finding.passed, "NUMBA_DISABLE_JIT" in finding.figure) == (False, True)


def test_packages_of_another_distribution_are_found(monkeypatch):
    """The guard's error is the figure."""

    def guard():
        raise PackageOriginError(
            "package rl: expected /a, got /b; uninstall the other distribution"
        )

    monkeypatch.setattr(self_test, "check_origins", guard)
    monkeypatch.setattr(self_test, "CHECKS", {"packages": self_test.check_packages})
    found = self_test.self_test()
    assert not found["ok"]
    assert "uninstall the other distribution" in found["checks"][0]["figure"]
