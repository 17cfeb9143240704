"""Views of what was kept: recordings, drives, and evaluations in rooms."""

import json
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Protocol

from andabata.app.console import Console
from andabata.app.run_kinds import known_kind
from andabata.configuration.usage import UsageError
from andabata.evaluation.barn import BarnEvaluationConfig
from andabata.records.containers.opening import is_recording
from andabata.replay.options import ReplayOptions
from andabata.replay.replay import replay_bag
from andabata.report.folder import RunFolderError
from andabata.report.room_folder import RoomFolder
from andabata.viewer.options import ViewConfig
from andabata.viewer.recorded_drive import RecordedDriveView, RecordedPath
from andabata.viewer.replayed import ReplayPage, ReplayView
from andabata.viewer.room_choices import BarnChoices, CellChoices, DriveChoices
from andabata.viewer.room_view import RoomView


class Playing(Protocol):
    """View of something that was kept whole."""

    def run(self) -> None:
        """Play until Ctrl-C."""

    def write(self, path: Path) -> None:
        """Write a page that plays by itself."""

    def close(self) -> None:
        """Close the page."""


def view_recording(
    path: Path, options: ReplayOptions, config: ViewConfig, out: Path | None, console: Console
) -> dict[str, Any]:
    """Replay a recording before viewers, or onto a page; return the replay's result.

    Args:
        path: The recording.
        options: Choices for the replay.
        config: Choices of who watches.
        out: HTML file to write; None to serve.
        console: Console for progress and the address.

    Raises:
        BagError: If the recording lacks a sensor that the robot needs, or is damaged.
        FrameError: If the mounting of a sensor is unknown or contradicted.
        ViewerError: If viser is not installed.
    """
    if out is not None:
        with ReplayPage(out) as page, console.progress("recorded seconds", None) as step:
            return replay_bag(path, options, lambda: step(1), page)
    with ReplayView(config, console.status) as view:
        with console.progress("recorded seconds", None) as step:
            data = replay_bag(path, options, lambda: step(1), view)
        view.finish(f"{data['scans']} virtual scans.")
        return data


def view_folder(
    folder: Path,
    config: ViewConfig,
    first: Mapping[str, str],
    out: Path | None,
    console: Console,
) -> None:
    """Play what a run folder has kept, until Ctrl-C, or onto a page.

    Args:
        folder: Folder of ``drive``, of ``evaluate`` in rooms, or of ``lidar-study``.
        config: Choices of who watches.
        first: Choice of the first drive of an evaluation.
        out: HTML file to write; None to serve.
        console: Console for the address.

    Raises:
        RunFolderError: If the folder is of another kind, incomplete or of another version.
        UsageError: If there is no such drive to begin with.
        ViewerError: If viser is not installed.
    """
    view = _view_of(folder, config, first, console)
    try:
        if out is not None:
            view.write(out)
            return
        # This is how a view that is served ends; it is no error.
        with suppress(KeyboardInterrupt):
            view.run()
    finally:
        view.close()


def _view_of(
    folder: Path, config: ViewConfig, first: Mapping[str, str], console: Console
) -> Playing:
    """Return the view of a run folder."""
    about = _about(folder)
    kind = known_kind(about)
    if kind is None or not kind.view:
        raise RunFolderError(
            f"{folder}: expected a run of drive, evaluate --task spn, td3 or barn, or "
            f"lidar-study, got one of {about.get('verb')}; `andabata report` shows training runs"
        )
    view: Playing = kind.function("view")(folder, config, first, console)
    return view


def drive_view(
    folder: Path, config: ViewConfig, first: Mapping[str, str], console: Console
) -> Playing:
    """Return the view of a drive; see ``view_folder`` for the arguments."""
    # A single drive leaves nothing to choose: whatever --first asks for is refused.
    _choose(first, {})
    return RecordedDriveView(RecordedPath.read(folder), config, console.status)


def room_view(
    folder: Path, config: ViewConfig, first: Mapping[str, str], console: Console
) -> Playing:
    """Return the view of an evaluation in rooms; see ``view_folder`` for the arguments."""
    return _driven_again(folder, lambda: CellChoices(RoomFolder(folder)), config, first, console)


def barn_view(
    folder: Path, config: ViewConfig, first: Mapping[str, str], console: Console
) -> Playing:
    """Return the view of an evaluation in fields; see ``view_folder`` for the arguments."""
    settings = _about(folder).get("config", {})

    def choices() -> DriveChoices:
        return BarnChoices(BarnEvaluationConfig.model_validate(settings))

    return _driven_again(folder, choices, config, first, console)


def _driven_again(
    folder: Path,
    load: Callable[[], DriveChoices],
    config: ViewConfig,
    first: Mapping[str, str],
    console: Console,
) -> Playing:
    """Return the view of drives that are driven again."""
    try:
        # Scans are not kept: the same seeds make them again, as the robot had them.
        choices = load()
        chosen = _choose(first, choices.choices)
        console.status("driving it again ...")
        return RoomView(choices, config, chosen, console.status)
    except (OSError, KeyError) as error:
        raise RunFolderError(f"{folder}: expected a finished evaluation, got {error}") from error


def _about(folder: Path) -> dict[str, Any]:
    """Return how a run was made.

    Raises:
        RunFolderError: If the folder does not say.
    """
    try:
        about: dict[str, Any] = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise RunFolderError(
            f"{folder}: expected a recording, or a run folder with run.json, got {error}"
        ) from error
    return about


def _choose(first: Mapping[str, str], choices: Mapping[str, Any]) -> Mapping[str, str]:
    """Return what the first drive is chosen by.

    Raises:
        UsageError: If there is no such choice.
    """
    for name, value in first.items():
        known = choices.get(name, ())
        if value not in known:
            what = ", ".join(known) if known else f"one of {', '.join(choices) or 'no choices'}"
            raise UsageError(f"--first: expected {name} of {what}, got {name}={value}")
    return first


def is_run_folder(path: Path) -> bool:
    """Return True for a folder of a run, False for a recording.

    Raises:
        UsageError: If there is nothing of that name, or it is neither.
    """
    if not path.exists():
        raise UsageError(f"RUN_OR_BAG: expected a run folder or a recording, got no {path}")
    if path.is_dir():
        # rosbag2 keeps a recording as a folder, which this file describes.
        return not (path / "metadata.yaml").exists()
    if not is_recording(path):
        raise UsageError(f"RUN_OR_BAG: expected a run folder or a recording, got {path}")
    return False
