"""Labels exchanged by mistake: pairs of clicks that a pose explains better the other way round.

Before any fit, with the best pair of every proposed pose; after it, with every two doubted clicks that lie on each
other's points.
"""

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array
from worker.calibration.onboarding.clicks import Clicks
from worker.calibration.onboarding.point_fit import PointFit, fit


def best_exchanges(costs: Array) -> tuple[NDArray[np.intp], Array]:
    """Return the two labels (P, 2) whose exchange spares each of P poses most, and how much (P,), if positive.

    `costs` (P, N, N): what click i costs as the point of click j. To say which two are meant is paid for.
    """
    poses, clicks, _ = costs.shape
    own = np.diagonal(costs, axis1=1, axis2=2)
    spared = (own[:, :, None] + own[:, None, :] - costs - np.swapaxes(costs, 1, 2)).reshape(poses, -1)
    best = spared.argmax(axis=1)
    most = spared[np.arange(poses), best] - 2 * np.log(clicks)
    return np.stack(np.divmod(best, clicks), axis=1), most


def exchange_labels(found: PointFit) -> PointFit:
    """Return the fit after exchanging every two labels that explain each other's clicks."""
    for _ in range(len(found.clicks) // 2):
        pair = _exchangeable(found)
        if pair is None:
            return found
        swapped = fit(found.clicks.swapped(*pair), found.camera, found.free)
        if swapped.cost >= found.cost:
            return found
        found = swapped
    return found


def _exchangeable(found: PointFit) -> tuple[int, int] | None:
    """Return the two doubted clicks that are best exchanged, if that leaves neither doubted."""
    doubted = np.flatnonzero(found.doubted)
    pixels = found.camera.project(found.clicks.world)
    best, pair = np.inf, None
    for i, j in combinations(doubted, 2):
        apart = np.linalg.norm(pixels[[j, i]] - found.clicks.pixel[[i, j]], axis=1)
        if np.isfinite(apart).all() and apart.max() < min(best, found.believable_px):
            best, pair = float(apart.max()), (int(i), int(j))
    return pair


def with_other_labels(clicks: Clicks, found: PointFit) -> NDArray[np.bool_]:
    """True for clicks (N,) that a fit takes for another point than their own."""
    return np.asarray((found.clicks.world != clicks.world).any(axis=1))
