"""Poses as numbers, and back."""

import numpy as np

from testbed.synthetic import pair
from worker.calibration.search.genome import genome_of, with_genome


def test_poses_come_back_from_their_genome():
    cameras = pair()
    for before, after in zip(cameras, with_genome(cameras, genome_of(cameras)), strict=True):
        np.testing.assert_array_equal(before.pose.rotation, after.pose.rotation)
        np.testing.assert_array_equal(before.pose.position, after.pose.position)
