"""A method for the bench that needs nothing of ESC: it answers that nothing has moved.

    python answer.py CASES ANSWERS

Replace `pose_of` by a method: it gets one frame of one camera, and says where the camera stands and whether it is sure.
"""

import json
import sys
from pathlib import Path


def pose_of(field, lines, camera, frame):
    """Return the answer for one camera, or None to refuse.

    `field`: template, length_m, width_m, line_width_m. `lines`: polylines [[x, y], ...] along the middle of the paint,
    metres. `camera`: image_size, and where they are known, intrinsics and the stored pose. `frame`: path of the JPEG.
    """
    if "pose" not in camera:
        return None
    return {"id": camera["id"], "accepted": True, "pose": camera["pose"]}


def main(cases, answers):
    """Answer all cases."""
    answers.mkdir(parents=True, exist_ok=True)
    for file in sorted(cases.glob("*/case.json")):
        case = json.loads(file.read_text())
        site, moments = case["site"], []
        for frames in case["moments"]:
            said = [
                pose_of(site["field"], case["lines"], one, file.parent / frames[one["id"]]) for one in site["cameras"]
            ]
            moments.append({"cameras": [one for one in said if one is not None]})
        (answers / f"{file.parent.name}.json").write_text(json.dumps({"moments": moments}))


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
