"""Choice of the few pieces of line that tell most about a camera's pose: near and far, all over the picture."""

import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array


def most_telling(jacobian: Array, patch: NDArray[np.intp], prior: Array, count: int) -> NDArray[np.intp]:
    """Return indices, rising, of up to `count` of N pieces that leave least open of a pose (D-optimal, greedily).

    `jacobian` (N, 6): how far each moves, in its own standard deviation, per unit of the pose; `patch` (N,): pieces of
    one err together, so each further one of a patch counts for less; `prior` (6, 6): information without any piece.
    """
    covariance = np.asarray(np.linalg.inv(prior), float)
    share = np.ones(len(jacobian))
    chosen: list[int] = []
    for _ in range(min(count, len(jacobian))):
        reach = jacobian @ covariance
        gain = share**2 * np.einsum("nj,nj->n", reach, jacobian)
        gain[chosen] = -np.inf
        best = int(np.argmax(gain))
        covariance -= np.outer(reach[best], reach[best]) * share[best] ** 2 / (1 + gain[best])
        chosen.append(best)
        alike = np.flatnonzero(patch == patch[best])
        share[alike] = 1 / (1 + np.count_nonzero(np.isin(chosen, alike)))
    return np.sort(np.array(chosen, dtype=np.intp))
