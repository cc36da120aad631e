"""Makes of what schemathesis invents something that gets further: real frames, and one id in address and body."""

import schemathesis
from schemathesis.generation import GenerationMode
from schemathesis.openapi.checks import IgnoredAuth

from tests.e2e.running import png


@schemathesis.hook
def map_case(context, case):
    if case.meta is None or case.meta.generation.mode is not GenerationMode.POSITIVE or not isinstance(case.body, dict):
        return case
    match case.operation.label:
        case "PUT /venues/{venue_id}":
            case.body["id"] = case.path_parameters["venue_id"]
        case "POST /venues/{venue_id}/calibrate":
            options = {name: part for name, part in case.body.items() if name == "options"}
            case.body = options | {camera: png(shade=len(str(options)) % 256) for camera in ("left", "right")}
    return case


@schemathesis.hook
def filter_failure(context, failure, case, response):
    """Let guessed keys be refused with 429 as well as with 401: that many guesses are one guesser."""
    return not (isinstance(failure, IgnoredAuth) and "got `429" in failure.message)


@schemathesis.deserializer("application/yaml")
def opencv_yaml(context, response):
    """Take OpenCV's YAML for text: its head, `%YAML:1.0`, is one that no other reader takes."""
    return response.text if isinstance(response.text, str) else response.content.decode()
