"""What `esc ... --help` prints."""

import os
import subprocess
import sys


def test_the_form_of_a_lens_file_is_printed_whole_with_its_brackets():
    wide = os.environ | {"COLUMNS": "400"}
    said = subprocess.run(
        [sys.executable, "-m", "service.cli", "pose", "--help"], env=wide, capture_output=True, text=True, check=True
    )
    assert '"matrix": [[fx, 0, cx], [0, fy, cy], [0, 0, 1]], "distortion": [k1, k2, p1, p2, k3]' in said.stdout
