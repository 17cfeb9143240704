"""The perception in plain numpy, slow and obvious: what the compiled kernels have to equal."""

import numpy as np

from traversability.features import ALL_FEATURES, CONTEXT, OWN_FEATURES, SHARED

OWN = len(OWN_FEATURES)


def bin_points(points, grid):
    """Return half sector and half ring of each point, -1 where it is on none."""
    x, y, z = points.astype(np.float64).T
    halves = np.empty(2 * grid.n_rings + 1)
    halves[::2] = grid.ring_edges
    halves[1::2] = np.sqrt(grid.ring_edges[:-1] * grid.ring_edges[1:])
    with np.errstate(invalid="ignore", over="ignore"):
        square = x * x + y * y
        ring = np.searchsorted(halves**2, square, side="right") - 1
        turn = (np.arctan2(y, x) + np.pi) / (2 * np.pi) * 2 * grid.n_sectors
        turn = np.where(np.isfinite(turn), turn, 0)
        keep = np.isfinite(points).all(axis=1) & (np.abs(z) < 1e3)
    keep &= (ring >= 0) & (ring < 2 * grid.n_rings)
    sector = np.minimum(turn.astype(int), 2 * grid.n_sectors - 1)
    return np.where(keep, sector, -1), np.where(keep, ring, -1)


def members(points, grid):
    """Return half sector and half ring of the points below the cut."""
    sector, ring = bin_points(points, grid)
    cuts = np.full((grid.n_sectors, grid.n_rings), grid.max_height)
    if grid.cut == "ground":
        middles = (grid.ring_edges[1:] + grid.ring_edges[:-1]) / 2
        for s in range(grid.n_sectors):
            ground, last = 0.0, 0.0
            for r in range(grid.n_rings):
                inside = (sector // 2 == s) & (ring // 2 == r)
                lowest = points[inside, 2].min(initial=np.inf)
                if lowest <= ground + 0.3 + 0.75 * (middles[r] - last):
                    ground, last = float(lowest), middles[r]
                cuts[s, r] = ground + grid.max_height
    low = (sector >= 0) & (points[:, 2] <= cuts[sector // 2, ring // 2])
    return np.where(low, sector, -1), np.where(low, ring, -1)


def describe(points, grid):
    """Return the features of each cell and the number of its points."""
    sector, ring = members(points, grid)
    points = points.astype(np.float64)
    shape = (grid.n_sectors, grid.n_rings)
    quarters = {}
    order = np.lexsort((ring, sector))
    for place in np.split(order, np.flatnonzero(np.diff(sector[order] * 1000 + ring[order])) + 1):
        if sector[place[0]] >= 0:
            quarters[sector[place[0]], ring[place[0]]] = points[place]
    counts = np.zeros(shape, dtype=int)
    for (i, j), inside in quarters.items():
        counts[i // 2, j // 2] += len(inside)
    values = np.zeros((*shape, len(ALL_FEATURES)))
    for s, r in np.argwhere(counts >= 3):
        cell = np.concatenate(
            [quarters[k] for k in _four(s, r) if k in quarters],
        )
        values[s, r, :8] = _axes(cell, [quarters[k] for k in _four(s, r) if k in quarters])
        values[s, r, 8:17] = _shape(quarters, s, r, grid)
        values[s, r, 17:24] = _outwards(quarters, counts, s, r, grid)
        values[s, r, 24:27] = _bumps(quarters, s, r, grid)
        values[s, r, 29] = _depth(quarters, s, r)
    _compare_with_ring(values, counts)
    _heights(quarters, counts, values, grid)
    for s, r in np.argwhere(counts >= 3):
        values[s, r, OWN:] = _neighbours(values, counts, s, r)
    return values, counts


def _gradients(quarters, counts, grid):
    """Return gradient and place of the plane of every quarter of a described cell."""
    found = {}
    for s, r in np.argwhere(counts >= 3):
        planes, last = _planes(quarters, s, r, grid), None
        for place in _four(s, r):
            last = planes.get(place, last)
            if place in quarters:
                found[place] = last[:2]
    return found


def _levels(quarters, scatter, grid):
    """Return the lower envelope of cones of a slope of 0.3 over the low points of quarters."""
    levels = np.full((2 * grid.n_sectors, 2 * grid.n_rings), np.inf)
    for place, spread in scatter.items():
        z = quarters[place][:, 2]
        if len(z) >= 2:
            levels[place] = max(z.min(), z.mean() - 1.5 * spread)
    halves = np.empty(2 * grid.n_rings + 1)
    halves[::2] = grid.ring_edges
    halves[1::2] = np.sqrt(grid.ring_edges[:-1] * grid.ring_edges[1:])
    middles = (halves[:-1] + halves[1:]) / 2
    aside = 0.3 * middles * 2 * np.pi / len(levels)
    outwards = 0.3 * np.diff(middles)
    while True:  # Relaxed until nothing changes.
        lower = np.minimum(levels, np.roll(levels, 1, axis=0) + aside)
        lower = np.minimum(lower, np.roll(levels, -1, axis=0) + aside)
        lower[:, 1:] = np.minimum(lower[:, 1:], levels[:, :-1] + outwards)
        lower[:, :-1] = np.minimum(lower[:, :-1], levels[:, 1:] + outwards)
        if (lower == levels).all():
            return levels
        levels = lower


def _heights(quarters, counts, values, grid):
    """Write scatter, smooth steps and heights over the local ground; see ``heights``."""
    limit = grid.max_traversable_vegetation
    planes = _gradients(quarters, counts, grid)
    scatter = {}
    for place, (gradient, _) in planes.items():
        rise = quarters[place][:, :2] @ gradient
        scatter[place] = (quarters[place][:, 2] - rise).std()
    levels = _levels(quarters, scatter, grid)
    first = len(OWN_FEATURES) - 14

    def off(place, plane):
        """Return how far a quarter's mean lies over a plane."""
        mean = quarters[place].mean(axis=0)
        gradient, middle = plane
        return mean[2] - middle[2] - gradient @ (mean[:2] - middle[:2])

    for s, r in np.argwhere(counts >= 3):
        inside = [place for place in _four(s, r) if place in quarters]
        n = np.array([len(quarters[place]) for place in inside])
        spreads = np.array([scatter[place] for place in inside])
        step = 0.0
        for i, j in inside:
            for other in ((i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)):
                other = (other[0] % (2 * grid.n_sectors), other[1])
                if other in quarters and len(quarters[other]) >= 3:
                    plane = planes[i, j]
                    apart = abs(off((i, j), plane) - off(other, plane))
                    # A neighbour in a cell that is not described has no scatter.
                    step = max(step, apart - scatter[i, j] - scatter.get(other, 0.0))
        layers = np.zeros(32)
        for place in inside:
            points = quarters[place]
            mean, gradient = points.mean(axis=0), planes[place][0]
            over = mean[2] - levels[place]
            if over + 2 * scatter[place] > 0.4 * limit:
                rise = (points[:, :2] - mean[:2]) @ gradient
                height = points[:, 2] - rise - levels[place]
            else:
                height = np.full(len(points), over)
            index = np.clip(np.floor(height / limit * 3).astype(int) + 2, 0, 31)
            np.add.at(layers, index, 1)
        edges = np.concatenate([[0.0], np.cumsum(layers)])
        covers = [1 - edges[2 + k] / n.sum() for k in (2, 3, 4, 6, 9)]
        quantiles = []
        for share in (0.25, 0.5, 0.9):
            k = int(np.searchsorted(edges[1:], share * n.sum()))
            quantiles.append(k + (share * n.sum() - edges[k]) / layers[k])
        above = n.sum() - np.interp(quantiles[0] + 3, np.arange(33), edges)
        values[s, r, first : first + 12] = (
            np.sqrt((n * spreads**2).sum() / n.sum()),
            spreads.min(),
            step,
            *covers,
            above / n.sum(),
            *((np.array(quantiles) - 2) / 3),
        )
    for s in range(grid.n_sectors):
        ground = at = slope = 0.0
        for r in np.flatnonzero(counts[s] >= 3):
            inside = [place for place in _four(s, r) if place in quarters]
            x, y, z = np.concatenate([quarters[place] for place in inside]).mean(axis=0)
            n = [len(quarters[place]) for place in inside]
            low = np.average([levels[place] for place in inside], weights=n)
            run = max(np.hypot(x, y) - at, 0.1)
            expected = ground + slope * run
            values[s, r, first + 12] = np.clip(z - expected, -2, 2)
            values[s, r, first + 13] = np.clip(low - expected, -2, 2)
            smooth = values[s, r, first] <= 0.3 * limit
            if low - expected <= (0.05 + 0.12 * run if smooth else 0.03):
                slope = np.clip(0.5 * slope + 0.5 * (low - ground) / run, -0.36, 0.36)
                ground, at = low, np.hypot(x, y)


def _four(s, r):
    """Return the four quarters of a cell."""
    return [(2 * s + a, 2 * r + b) for a in range(2) for b in range(2)]


def _axes(cell, parts):
    """Return the features of a principal component analysis of a cell."""
    covariance = np.cov(cell.T, bias=True)
    eigenvalues, vectors = np.linalg.eigh(covariance)
    l3, l2, l1 = np.maximum(eigenvalues, 0)
    z = cell[:, 2]
    gradient = _gradient(covariance, 1e-3)
    return (
        np.sqrt(l3),
        abs(vectors[2, 0]),
        (l2 - l3) / l1,
        z.min(),
        np.ptp(z),
        z.mean() - z.min(),
        max(np.ptp(part[:, 2]) for part in parts),
        min(np.hypot(*gradient), 3.0),
    )


def _gradient(covariance, noise):
    """Return the plane's slope; a direction whose variance is well under the noise is level."""
    variances, axes = np.linalg.eigh(covariance[:2, :2])
    return axes @ (axes.T @ covariance[:2, 2] * variances / (variances**2 + noise**2))


def _depth(quarters, s, r):
    """Return the extent of a cell's points outwards."""
    cell = np.concatenate([quarters[k] for k in _four(s, r) if k in quarters])
    return np.ptp(np.hypot(cell[:, 0], cell[:, 1]))


def _compare_with_ring(values, counts):
    """Subtract the medians of each ring."""
    for r in range(counts.shape[1]):
        here = counts[:, r] >= 3
        if here.any():
            median = np.sort(values[here, r, 17:20], axis=0)[here.sum() // 2]
            values[here, r, 17:20] -= median
            values[here, r, 27] = median[1]
            values[here, r, 28] = (counts[:, r + 1 :] >= 3).any(axis=1).mean()


def _planes(quarters, s, r, grid):
    """Return gradient and place of the plane of each quarter that has one of its own."""
    small = (grid.ring_edges[r] + grid.ring_edges[r + 1]) / 2 * 2 * np.pi / grid.n_sectors < 0.3
    found = {}
    for i, j in _four(s, r):
        if (i, j) not in quarters or (small and (i % 2 != j % 2) and found):
            continue
        here = quarters[i, j].mean(axis=0)
        window = _window(quarters, i, j, grid)
        means = np.array([part.mean(axis=0) for part in window]) - here
        weights = np.minimum([len(part) for part in window], 4.0)
        covariance = np.cov(means.T, bias=True, aweights=weights)
        gradient = _gradient(covariance, 2e-3)
        middle = np.average(means, axis=0, weights=weights)
        level = here[2] + middle[2] - gradient @ middle[:2]
        found[i, j] = gradient, np.array([*here[:2], level]), window, means
    return found


def _bumps(quarters, s, r, grid):
    """Return height, third height and number of points of a cell's bumps."""
    if (grid.ring_edges[r] + grid.ring_edges[r + 1]) / 2 >= 3.2:
        return 0.0, 0.0, 0.0
    planes, last, tops = _planes(quarters, s, r, grid), None, [(0.0, 0.0, 0.0)]
    for place in _four(s, r):
        last = planes.get(place, last)
        if place not in quarters or np.ptp(quarters[place][:, 2]) < 0.03:
            continue
        gradient, middle = last[:2]
        off = quarters[place] - middle
        rise = np.sort(off[:, 2] - off[:, :2] @ gradient)[::-1]
        third = rise[2] if len(rise) > 2 else 0.0
        tops.append((rise[0], third, (rise > 0.04).sum()))
    first, third, many = np.array(tops).T
    return first.max(), third.max(), many.sum()


def _shape(quarters, s, r, grid):
    """Return the shape of the ground around a cell's quarters."""
    found = []
    for (i, j), (gradient, middle, window, means) in _planes(quarters, s, r, grid).items():
        own, level = quarters[i, j], middle[2]
        off = means[:, 2] - means[:, :2] @ gradient
        z = np.concatenate([part[:, 2] for part in window])
        low, high = own[:, 2].min(), own[:, 2].max()
        found.append(
            (
                min(np.hypot(*gradient), 3.0),
                np.ptp(off),
                high - level,
                level - low,
                low - z.min(),
                z.max() - low,
            )
        )
    slope, step, above, below, sunk, risen = np.array(found).T
    second = np.sort(step)[-2] if len(step) > 1 else 0.0
    return (
        slope.max(),
        slope.mean(),
        step.max(),
        second,
        step.mean(),
        max(above.max(), 0.0),
        max(below.max(), 0.0),
        sunk.max(),
        risen.max(),
    )


def _window(quarters, i, j, grid):
    """Return the points of all quarters within reach of one."""
    sectors, rings = 2 * grid.n_sectors, 2 * grid.n_rings
    x, y, _ = quarters[i, j].mean(axis=0)
    radius = np.hypot(x, y)
    side = max(1, int(0.3 / (radius * 2 * np.pi / sectors)))
    reach = [
        np.hypot(*quarters[i, k][:, :2].T) if (i, k) in quarters else np.zeros(0)
        for k in range(rings)
    ]
    first, last = max(j - 1, 0), min(j + 1, rings - 1)
    while first > 0 and len(reach[first]) and reach[first].max() > max(radius - 0.3, 0.0):
        first -= 1
    while last < rings - 1 and len(reach[last]) and reach[last].min() < radius + 0.3:
        last += 1
    stride = 1 + side // 3
    side -= side % stride
    columns = [(i + k) % sectors for k in range(-side, side + 1, stride)]
    places = [(column, k) for column in columns for k in range(first, last + 1)]
    return [quarters[place] for place in places if place in quarters]


def _outwards(quarters, counts, s, r, grid):
    """Return gaps, bends and rises along the sector."""
    middles = (grid.ring_edges[1:] + grid.ring_edges[:-1]) / 2
    after, before = [], []
    for i in (2 * s, 2 * s + 1):
        column = {
            j: np.hypot(*quarters[i, j][:, :2].T)
            for j in range(2 * grid.n_rings)
            if (i, j) in quarters
        }
        mine = [column[j] for j in (2 * r, 2 * r + 1) if j in column]
        if not mine:
            continue
        near, far = np.concatenate(mine).min(), np.concatenate(mine).max()
        later = [j for j in column if j > 2 * r + 1]
        earlier = [j for j in column if j < 2 * r]
        gap = (column[min(later)].min() - far) / far if later else 3.0
        if len(mine) == 2:
            gap = max(gap, (mine[1].min() - mine[0].max()) / far)
        after.append(gap)
        begin = column[max(earlier)].max() if earlier else middles[0]
        before.append(max(near - begin, 0.0) / near)

    def mean(ring):
        """Return distance and height of a cell's mean point."""
        cell = np.concatenate([quarters[k] for k in _four(s, ring) if k in quarters])
        x, y, z = cell.mean(axis=0)
        return np.hypot(x, y), z

    r0, z0 = mean(r)
    bend = rise_before = rise_after = 0.0
    earlier = np.flatnonzero(counts[s, :r] >= 3)
    later = np.flatnonzero(counts[s, r + 1 :] >= 3)
    if len(earlier):
        r1, z1 = mean(earlier[-1])
        rise_before = np.clip((z0 - z1) / max(r0 - r1, 0.02), -3, 3)
        if earlier[-1] > 0 and counts[s, earlier[-1] - 1] >= 3:
            r2, z2 = mean(earlier[-1] - 1)
            slope = np.clip((z1 - z2) / max(r1 - r2, 0.02), -1, 1)
            bend = z0 - z1 - slope * (r0 - r1)
    if len(later):
        r1, z1 = mean(r + 1 + later[0])
        rise_after = np.clip((z1 - z0) / max(r1 - r0, 0.02), -3, 3)
    return (
        max(*after, 0.0),
        np.mean(after),
        np.mean(before),
        bend,
        rise_before,
        rise_after,
        middles[r],
    )


def _neighbours(values, counts, s, r):
    """Return the features that a cell takes over from its neighbours."""
    sectors, rings = counts.shape

    def shared(sector, ring):
        """Return the shared features of a cell, None without one."""
        sector %= sectors
        if not 0 <= ring < rings or counts[sector, ring] < 3:
            return None
        return values[sector, ring, list(SHARED)]

    nothing = np.full(len(SHARED), -1.0)
    out = []
    for offset in (-2, -1, 1, 2):
        there = shared(s, r + offset)
        out.append(nothing if there is None else there)
    for offset in (0, -1, 1):
        both = [v for v in (shared(s + 1, r + offset), shared(s - 1, r + offset)) if v is not None]
        out += [np.min(both, axis=0), np.max(both, axis=0)] if both else [nothing, nothing]
    both = [v for v in (shared(s + 2, r), shared(s - 2, r)) if v is not None]
    out.append(np.max(both, axis=0) if both else nothing)
    assert len(out) == len(CONTEXT)
    return np.concatenate(out)
