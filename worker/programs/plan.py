"""Plan of cameras before they are mounted, in a process of its own: `PlanRequest` in, `PlanAnswer` out, as JSON.

`python -m worker.programs.plan`.
"""

import sys
from base64 import b64encode

from service import child_process
from service.schemas.plan import PlanAnswer, PlanRequest
from worker.jobs import planning


def main() -> None:
    """Read the site, write its plan."""
    child_process.begin_decoder()
    request = PlanRequest.model_validate_json(sys.stdin.buffer.read())
    sys.stdout.write(answer(request).model_dump_json())


def answer(request: PlanRequest) -> PlanAnswer:
    """Return the plan of a site, its maps in numbers, and the maps of the whole field as pictures."""
    solution = planning.solve(request.site, request.lines, request.hidden)
    pictures = planning.draw_field_maps(solution.plan)
    return PlanAnswer(
        plan=solution.result,
        maps=solution.maps,
        pictures={name: b64encode(picture).decode() for name, picture in pictures.items()},
    )


if __name__ == "__main__":
    main()
