"""Live view of a drive in simulation: people watch, take the wheel, and choose goals."""

from collections.abc import Callable

from andabata.assembly.controllers import CONTROLLERS, make_steering
from andabata.assembly.simulated_robot import SimulatedRobot
from andabata.models import Models
from andabata.navigation.controller import Steering
from andabata.report.drive_frames import FrameSource
from andabata.viewer.drive_view import DriveView
from andabata.viewer.options import ViewConfig


class SimulatedDriveView(DriveView):
    """View of a drive in a world."""

    def __init__(
        self,
        config: ViewConfig,
        controller: str,
        models: Models,
        status: Callable[[str], None],
    ) -> None:
        """Begin to serve.

        Args:
            config: Choices of who watches.
            controller: Name of the controller that drives.
            models: Classifiers and policy, for others that take over.
            status: Function that prints a line for the user.

        Raises:
            ViewerError: If viser is not installed.
        """
        super().__init__(config, "andabata drive", status)
        self._controller, self._models = controller, models

    def watch_robot(self, robot: SimulatedRobot) -> None:
        """Watch a robot that was put together and has not driven yet; wait for a page, if asked."""
        source = FrameSource(
            robot.navigator, robot.localizer, robot.perception, robot.simulator.walkers
        )
        world, config = robot.scene.world, robot.config

        def steering(name: str) -> Steering:
            return make_steering(name, world, config, self._models)

        # Without a planner at the start perception keeps no layers for one.
        has_layers = robot.perception.layers is not None
        names = [name for name in CONTROLLERS if has_layers or not name.endswith("planner")]
        self.watch(robot.navigator, source, config, world, steering, names, self._controller)
        if self._config.waits:
            self._status("the drive begins when the page is open; Ctrl-C ends it")
            self.server.wait_for_a_viewer()
