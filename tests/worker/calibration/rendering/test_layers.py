"""Layers lie where what they show is in the picture below them, at its scale, and hide nothing else."""

import cv2
import numpy as np

from testbed.synthetic import CROWNED, pair
from worker.calibration.rendering.layers import mask_layer, new_layer, seam_layer, stored_layer
from worker.calibration.rendering.stitched_pictures import stitched
from worker.calibration.stitching.views import ViewChoice, chosen_view

LEFT, RIGHT = pair()
SMALL = (LEFT.intrinsics.size[0] // 2, LEFT.intrinsics.size[1] // 2)


def opacity(layer):
    return layer[..., 3]


def places(camera, size):
    """Where the halfway line is seen, in a picture of this size."""
    line = CROWNED.lift(np.stack([np.zeros(40), np.linspace(-20, 20, 40)], axis=-1))
    return np.rint((camera.project(line) + 0.5) * np.array(size) / camera.intrinsics.size - 0.5).astype(int)


def test_the_stored_pose_hits_the_middle_of_a_line_and_the_new_one_frames_it():
    size = LEFT.intrinsics.size
    stored, new = opacity(stored_layer(CROWNED, LEFT, size)), opacity(new_layer(CROWNED, LEFT, size))
    inside = [(x, y) for x, y in places(LEFT, size) if 0 <= x < size[0] and 0 <= y < size[1]]
    assert len(inside) > 5
    assert all(stored[y, x] > 100 for x, y in inside)
    # But where other lines cross it.
    assert np.mean([new[y, x] < 100 for x, y in inside]) > 0.8
    assert all(new[y - 4 : y + 5, x - 4 : x + 5].max() > 100 for x, y in inside)


def test_a_layer_for_a_smaller_picture_is_the_same_at_its_scale():
    layer = opacity(stored_layer(CROWNED, LEFT, SMALL))
    assert layer.shape == SMALL[::-1]
    inside = [(x, y) for x, y in places(LEFT, SMALL) if 1 <= x < SMALL[0] - 1 and 1 <= y < SMALL[1] - 1]
    assert all(layer[y - 1 : y + 2, x - 1 : x + 2].max() > 100 for x, y in inside)
    assert (layer > 0).mean() < 0.2


def test_a_thin_line_of_the_network_survives_in_a_smaller_picture_and_doubt_is_not_shown():
    response = np.full((400, 400), 20, np.uint8)
    response[201] = 255
    shown = opacity(mask_layer(response, (100, 100)))
    assert shown[50].min() > 60
    assert (np.delete(shown, (49, 50, 51), axis=0) == 0).all()


def test_the_seam_is_where_one_camera_hands_over_and_not_where_nobody_sees():
    owner = np.full((200, 300), -1, np.int8)
    owner[50:, :150], owner[50:, 150:] = 0, 1
    rows, columns = np.nonzero(opacity(seam_layer(owner)))
    assert set(columns) <= set(range(147, 153))
    assert rows.min() >= 47
    # Dashed: about half of it.
    assert 0.3 < len(set(rows)) / 150 < 0.8


def test_two_sets_of_poses_are_stitched_from_one_place():
    frames = {camera.id: np.full((*camera.intrinsics.size[::-1], 3), 90, np.uint8) for camera in (LEFT, RIGHT)}
    view = chosen_view(CROWNED, [LEFT, RIGHT], ViewChoice(width=480))
    whole, alone = (stitched(CROWNED, view, cameras, frames) for cameras in ([LEFT, RIGHT], [LEFT]))
    assert whole.picture.shape == alone.picture.shape == (*view.size[::-1], 3)
    assert set(np.unique(whole.owner)) >= {0, 1}
    assert (
        (alone.owner == -1) == (cv2.absdiff(alone.picture, np.full_like(alone.picture, 90)).max(axis=-1) > 30)
    ).mean() > 0.98
