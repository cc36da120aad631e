"""Reading pictures between pixels."""

import numpy as np
import pytest

from worker.calibration.detection.sampling import MOST_ROWS, bilinear, bilinear_planes

SLOPE = np.add.outer(10.0 * np.arange(20), np.arange(30)).astype(np.float32)


def test_a_slope_is_read_between_pixels_and_nothing_outside():
    pixels = np.array([[4.5, 3.25], [29.5, 3.0], [np.nan, 3.0]])
    np.testing.assert_allclose(bilinear(SLOPE, pixels, outside=np.nan), [37.0, np.nan, np.nan], rtol=1e-6)


@pytest.mark.parametrize("rows", [0, 1, MOST_ROWS, MOST_ROWS + 1, 3 * MOST_ROWS])
def test_however_many_rows_are_read_at_once(rows):
    column, row = np.full((rows, 2), 4.5), np.full((rows, 2), 3.25)
    np.testing.assert_array_equal(bilinear_planes(SLOPE, column, row), np.full((rows, 2), 37.0))
