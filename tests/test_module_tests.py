"""Every module has a test of its own name, or a line here that names the test of its law."""

import ast
from pathlib import Path

import pytest

from tests.support.documents import ROOT

PACKAGES = ("andabata", "rl", "terrain", "traversability", "worlds")
LEAST_LINES = 30
"""Number of lines of code from which on a module needs a test."""

APP, BENCH, REPLAY = "tests/andabata/app/", "tests/andabata/bench/", "tests/andabata/replay/"
CONTAINERS, REPORT = "tests/andabata/records/containers/", "tests/andabata/report/"
BROWSER = "tests/andabata/viewer/test_browser.py"

TESTED_BY = {
    # Commands, by what they do.
    "andabata/app/barn_tables": f"{APP}jobs/test_barn.py",
    "andabata/app/live": "tests/andabata/ros/test_navigator_node.py",
    "andabata/app/verbs/bag": f"{APP}test_bag_exports.py",
    "andabata/app/verbs/classifier": "tests/andabata/evaluation/test_classifier.py",
    "andabata/app/verbs/clouds": "tests/andabata/datasets/test_generate.py",
    "andabata/app/verbs/doctor": f"{APP}doctor/test_self_test.py",
    "andabata/app/verbs/drive": f"{APP}jobs/test_drive.py",
    "andabata/app/verbs/evaluate": f"{APP}jobs/test_offroad.py",
    "andabata/app/verbs/lidar_study": f"{APP}jobs/test_rooms.py",
    "andabata/app/verbs/policy": f"{APP}test_distillation_command.py",
    "andabata/app/verbs/report": f"{APP}test_reports.py",
    "andabata/app/verbs/ros": "tests/andabata/ros/test_navigator_node.py",
    "andabata/app/verbs/ros2": "tests/andabata/ros/test_ros2_graph.py",
    "andabata/app/verbs/scan": f"{APP}test_scan_files.py",
    "andabata/app/verbs/train": f"{APP}jobs/test_training.py",
    "andabata/app/verbs/view": f"{APP}test_viewing.py",
    "andabata/app/verbs/world": f"{APP}test_cli.py",
    # Benchmarks, and what they compare with.
    "andabata/bench/chromium": BROWSER,
    "andabata/bench/perception_peers": f"{BENCH}test_perception.py",
    "andabata/bench/robot_speed_cases": f"{BENCH}test_speed.py",
    "andabata/bench/speed_cases": f"{BENCH}test_speed.py",
    "andabata/bench/speed_peers": f"{BENCH}test_speed.py",
    "andabata/bench/studies/engines": f"{BENCH}studies/test_cluster.py",
    "andabata/bench/studies/raylets": f"{BENCH}studies/test_cluster.py",
    "andabata/bench/studies/rclpy_peer": f"{BENCH}studies/test_ros2_link.py",
    "andabata/bench/studies/ros_graph": "tests/andabata/ros/test_ros1_graph.py",
    "andabata/bench/studies/soak/good_files": f"{BENCH}studies/soak/test_readers.py",
    "andabata/bench/studies/vehicle_rates": f"{BENCH}test_vehicle.py",
    # Parts that show in what uses them.
    "andabata/ros/dds_discovery": "tests/andabata/ros/test_ros2_graph.py",
    "andabata/ros/dds_subscription": "tests/andabata/ros/test_ros2_graph.py",
    "andabata/exports/csv_table": "tests/andabata/exports/test_topics.py",
    "andabata/exports/geojson": "tests/andabata/exports/test_track_file.py",
    "andabata/localization/plausibility_period": "tests/andabata/localization/test_plausibility.py",
    "andabata/localization/sigma_points": "tests/andabata/localization/test_process_model.py",
    "andabata/localization/ukf_config": "tests/andabata/localization/test_ukf_localizer.py",
    "andabata/machine/fault_signals": "tests/andabata/machine/test_fault_injector.py",
    "andabata/machine/planar/motion": "tests/andabata/machine/planar/test_vehicle.py",
    "andabata/navigation/planning/rollout_inputs": (
        "tests/andabata/navigation/planning/test_rollout_prices.py"
    ),
    "andabata/navigation/planar/catalogue": "tests/andabata/navigation/planar/test_navigators.py",
    "andabata/records/containers/container": f"{CONTAINERS}test_rosbag1_file.py",
    "andabata/records/containers/mcap_copy": "tests/andabata/records/test_salvage.py",
    "andabata/records/containers/mcap_records": f"{CONTAINERS}test_mcap_file.py",
    "andabata/records/containers/opening": f"{CONTAINERS}test_ros2_folder.py",
    "andabata/records/containers/ros2_metadata": f"{CONTAINERS}test_ros2_folder.py",
    "andabata/records/containers/rosbag1_copy": "tests/andabata/records/test_salvage.py",
    "andabata/records/containers/rosbag1_records": f"{CONTAINERS}test_rosbag1_file.py",
    "andabata/records/containers/sqlite_copy": "tests/andabata/records/test_salvage.py",
    "andabata/records/frames/remarks": "tests/andabata/records/frames/test_extrinsics.py",
    "andabata/replay/mounting_monitor": f"{REPLAY}test_mounted_replays.py",
    "andabata/replay/recorded_drive": f"{REPLAY}test_replay.py",
    "andabata/training/expert_labels": "tests/andabata/training/test_distillation.py",
    "rl/curriculum_config": "tests/rl/test_curriculum.py",
    "rl/policies/crop_prices": "tests/rl/test_crop_actor.py",
    "rl/policies/point_features": "tests/rl/policies/test_point_set.py",
    "traversability/cells/columns": "tests/traversability/cells/test_shape.py",
    "worlds/rays/geometry": "tests/worlds/rays/test_ground.py",
    # Pages and pictures.
    "andabata/report/about": f"{REPORT}test_pages.py",
    "andabata/report/barn": f"{REPORT}test_pages.py",
    "andabata/report/class_colours": "tests/andabata/viewer/test_cloud_drawing.py",
    "andabata/report/clouds": f"{REPORT}test_pages.py",
    "andabata/report/drive": f"{REPORT}test_pages.py",
    "andabata/report/drive_frames": f"{REPORT}plots/test_drive_picture.py",
    "andabata/report/plots/bench": f"{BENCH}test_speed.py",
    "andabata/report/plots/svg": f"{REPORT}test_page.py",
    "andabata/report/rooms": f"{REPORT}test_pages.py",
    "andabata/report/training_page": f"{REPORT}test_training.py",
    "andabata/report/run_folders": f"{APP}jobs/test_drive.py",
    # The live view, which a browser shows.
    "andabata/viewer/controls": BROWSER,
    "andabata/viewer/keyboard": BROWSER,
    "andabata/viewer/offroad_scene": BROWSER,
    "andabata/viewer/robot_drawing": BROWSER,
    "andabata/viewer/replayed": BROWSER,
    "andabata/viewer/room_choices": f"{APP}test_viewing.py",
    "andabata/viewer/room_scene": f"{APP}test_viewing.py",
    "andabata/viewer/room_view": f"{APP}test_viewing.py",
    "andabata/viewer/simulated": BROWSER,
}
"""Modules whose law a test of another name checks, without ``.py``."""


def code_lines(text):
    """Return the number of lines that are neither empty nor comments nor docstrings."""
    lines = text.splitlines()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Module | ast.FunctionDef | ast.ClassDef) and (
            ast.get_docstring(node)
        ):
            words = node.body[0]
            lines[words.lineno - 1 : words.end_lineno] = [""] * (
                words.end_lineno - words.lineno + 1
            )
    return sum(bool(line.strip()) and line.strip()[0] != "#" for line in lines)


def own_tests(module):
    """Return the tests of a module's name, and those that are named after it and a part of it."""
    folder, stem = Path("tests") / module.parent, module.stem
    return [*(ROOT / folder).glob(f"test_{stem}.py"), *(ROOT / folder).glob(f"test_{stem}_*.py")]


def modules():
    """Return the modules that need a test, relative to the root."""
    found = [path for name in PACKAGES for path in sorted((ROOT / name).rglob("*.py"))]
    named = [path for path in found if not path.name.startswith("__")]
    large = [path for path in named if code_lines(path.read_text("utf-8")) >= LEAST_LINES]
    return [path.relative_to(ROOT) for path in large]


def test_lines_of_code_are_counted_without_words():
    """Docstrings, comments and empty lines are none."""
    text = '"""One.\n\nTwo.\n"""\n\nx = 1  # Three.\n\n\ndef f():\n    """Four."""\n    # Five.\n'
    assert code_lines(text + "    return (\n        x\n    )\n") == 5


def test_every_module_has_a_test():
    """A module of some size has a test of its name, or a line that names another."""
    lacking = [
        str(module)
        for module in modules()
        if not own_tests(module) and str(module.with_suffix("")) not in TESTED_BY
    ]
    assert lacking == [], "expected a test of the module's name, or a line in TESTED_BY"


@pytest.mark.parametrize("module", TESTED_BY)
def test_the_lines_name_modules_and_tests_that_exist(module):
    """A module that is gone needs no line."""
    path = Path(f"{module}.py")
    assert (ROOT / path).is_file(), f"{path}: expected a module; drop its line"
    assert (ROOT / TESTED_BY[module]).is_file(), f"{TESTED_BY[module]}: expected a test"
