"""Pictures of scans and classifiers."""

from types import SimpleNamespace

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Wedge

from andabata.report.plots import perception
from traversability.grid import PolarGrid
from traversability.labels import CellState


def test_cells_are_drawn_in_their_sector_ring_and_colour():
    """Sector 0 begins at -180 degrees; a blocked cell is red between its ring's edges."""
    grid = PolarGrid(n_sectors=4)
    cells = np.full((4, grid.n_rings), CellState.EMPTY, dtype=np.uint8)
    cells[1, 2] = CellState.NON_TRAVERSABLE
    axes = Figure().add_subplot()
    perception._draw_cells(axes, cells, grid, 1.0)
    free, blocked, empty = axes.collections
    assert (len(empty.get_paths()), len(free.get_paths())) == (4 * grid.n_rings - 1, 0)
    (path,) = blocked.get_paths()
    edges = grid.ring_edges
    wedge = Wedge((0, 0), edges[3], -90, 0, width=edges[3] - edges[2])
    expected = wedge.get_transform().transform_path(wedge.get_path())
    np.testing.assert_allclose(path.vertices, expected.vertices)
    red, green, blue, _ = blocked.get_facecolor()[0]
    assert red > max(green, blue)


def test_a_confusion_matrix_has_truth_by_row():
    """Rows are the truth, columns the classifier's answer; red is positive."""
    confusion = {"tn": 1, "fp": 2, "fn": 3, "tp": 4}
    figure = perception.confusions_figure({"ours": confusion})
    (axes,) = figure.axes
    texts = {text.get_position(): text.get_text() for text in axes.texts}
    shown = {(0, 0): "1\n33%", (1, 0): "2\n67%", (0, 1): "3\n43%", (1, 1): "4\n57%"}
    assert texts == shown
    assert [label.get_text() for label in axes.get_yticklabels()] == ["free", "blocked"]
    assert axes.get_title() == "ours"


def test_the_most_important_feature_is_on_top():
    """Bars stand by importance, at most as many as asked."""
    figure = perception.importance_figure({"a": 3.0, "b": 2.0, "c": 1.0}, most=2)
    (axes,) = figure.axes
    assert [label.get_text() for label in axes.get_yticklabels()] == ["b", "a"]
    assert [bar.get_width() for bar in axes.patches] == [2.0, 3.0]


def test_a_scan_shows_points_near_and_low():
    """Points beyond the grid or above the robot are not drawn."""
    grid = PolarGrid(n_sectors=4)
    points = np.array([[1, 2, 0], [1, 2, 3], [90, 0, 0]], dtype=np.float32)
    cells = np.zeros((4, grid.n_rings), dtype=np.uint8)
    scan = SimpleNamespace(ranges=np.full(4, np.inf, dtype=np.float32))
    figure = perception.scan_figure(
        SimpleNamespace(cloud=SimpleNamespace(points=points), grid=grid, cells=cells, scan=scan),
        "name",
    )
    left = figure.axes[0]
    np.testing.assert_allclose(left.collections[0].get_offsets(), [[1, 2]])


def test_the_legend_of_a_scan_has_the_states_that_are_there():
    """In the glossary's words: free, blocked, unknown; no title or legend is cut."""
    grid = PolarGrid(n_sectors=4)
    cells = np.full((4, grid.n_rings), CellState.TRAVERSABLE, dtype=np.uint8)
    cells[1, 2] = CellState.NON_TRAVERSABLE
    ranges = np.array([np.inf, 3.0, np.inf, np.inf], dtype=np.float32)
    cloud = SimpleNamespace(points=np.zeros((1, 3), dtype=np.float32))
    for state, more in (
        (CellState.TRAVERSABLE, []),
        (CellState.EMPTY, ["unknown: too few points"]),
    ):
        cells[2] = state
        scan = SimpleNamespace(ranges=ranges)
        scanned = SimpleNamespace(cloud=cloud, grid=grid, cells=cells, scan=scan)
        figure = perception.scan_figure(scanned, "cloud.npz")
        texts = [text.get_text() for text in figure.legends[0].get_texts()]
        assert texts == ["free", "blocked", *more, "virtual scan: free up to here"]
    FigureCanvasAgg(figure).draw()
    for text in [*figure.legends, *(each.title for each in figure.axes)]:
        box = text.get_window_extent()
        assert min(box.x0, box.y0) >= 0
        assert box.x1 <= figure.bbox.x1
        assert box.y1 <= figure.bbox.y1
