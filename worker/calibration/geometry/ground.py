"""Ground: heights above the field's surface that the refinement estimates along with the poses.

A pitch swells by centimetres, over metres, and from a low camera that moves a far line by decimetres. All lines on a
swell move alike, in all cameras, so no number of measurements averages it out: it has to be an unknown of its own.
Heights are a Gaussian process with a Matérn covariance (Rasmussen and Williams, 2006, section 4.2), held at the nodes
of a grid and bilinear between them.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array
from worker.calibration.geometry.field import LinePoints


@dataclass(frozen=True)
class Belief:
    """Prior of a ground's unevenness: its standard deviation, and the number of nodes of evidence it is worth."""

    uneven_m: float
    nodes: float


@dataclass(frozen=True)
class Ground:
    """Heights at the K nodes of a grid under the markings.

    `node` (N, 4) and `share` (N, 4): between which nodes each line point lies, and what it takes of each; `precision`
    (K, K): the inverse covariance of heights that have a standard deviation of 1; `usual_m`: what that is on a ground
    of this kind.
    """

    node: NDArray[np.intp]
    share: Array
    precision: Array
    usual_m: float

    @classmethod
    def under(cls, lines: LinePoints) -> "Ground":
        """Return the ground under line points."""
        node_m = 7.0
        at = lines.position[:, :2] / node_m
        low = np.floor(at).astype(int)
        right, up = (at - low).T
        corners = np.stack([low, low + [1, 0], low + [0, 1], low + [1, 1]], axis=1)
        share = np.stack([(1 - right) * (1 - up), right * (1 - up), (1 - right) * up, right * up], axis=1)
        nodes, node = np.unique(corners.reshape(-1, 2), axis=0, return_inverse=True)
        # Heights correlate over 10 m.
        apart = np.sqrt(3) * node_m * np.linalg.norm(nodes[:, None] - nodes[None], axis=-1) / 10.0
        covariance = (1 + apart) * np.exp(-apart) + 1e-6 * np.eye(len(nodes))
        return cls(node.reshape(-1, 4), share, np.linalg.inv(covariance), lines.uneven_m)

    def __len__(self) -> int:
        return len(self.precision)

    @property
    def most_m(self) -> float:
        """Largest unevenness (m) that this ground is taken to have."""
        # A ground that may do anything explains any pose.
        return self.usual_m * (4 / 3)

    @property
    def even(self) -> Belief:
        """Prior for finding poses: a flat ground is preferred to swells where both explain the lines."""
        return Belief(uneven_m=self.usual_m * (4 / 15), nodes=2.0)

    @property
    def ordinary(self) -> Belief:
        """Prior for uncertainties: a few lines that fit a flat ground do not show that it has not sunk as a whole."""
        return Belief(uneven_m=self.usual_m, nodes=8.0)

    def under_points(self, heights: Array, point: NDArray[np.intp]) -> Array:
        """Return the heights (M,) under line points (M,), interpolated from those of the nodes (K,)."""
        return np.asarray(np.sum(self.share[point] * heights[self.node[point]], axis=1))

    def unevenness(self, heights: Array, covariance: Array, believed: float, before: Belief) -> float:
        """Return the standard deviation (m) of heights (K,) with covariance (K, K), estimated under a `believed` one.

        MacKay's evidence update (Bayesian Interpolation, 1992): heights count as far as the data determined them.
        `before`: the prior.
        """
        determined = len(self) - np.sum(self.precision * covariance) / believed**2
        power = heights @ self.precision @ heights
        uneven = np.sqrt((power + before.nodes * before.uneven_m**2) / (max(determined, 0.0) + before.nodes))
        return float(uneven)
