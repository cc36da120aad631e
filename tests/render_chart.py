"""Lint and render a chart by Helm's own library, and validate what comes of it by the schemas of Kubernetes.

Run by the Python of `make charts`, with the folder of the chart as argument and a JSON list of values on standard
input. Prints a JSON list: for each values the messages of lint that are more than advice, and the documents, or why
Helm refuses the values.
"""

import json
import sys

import helm_python
import kubernetes_validate
import yaml

KUBERNETES = "1.37"
ADVICE = 1


def rendered(chart, values):
    try:
        files = chart.render(values, name="field", namespace="esc")
    except helm_python.HelmError as error:
        return {"refused": str(error)}
    found = [one for name in sorted(files) if name.endswith(".yaml") for one in yaml.safe_load_all(files[name]) if one]
    for document in found:
        # KEDA's kinds are not of Kubernetes.
        if not document["apiVersion"].startswith("keda.sh/"):
            kubernetes_validate.validate(document, KUBERNETES, strict=True)
    messages = helm_python.lint(sys.argv[1], values)["messages"]
    return {"lint": [one["error"] for one in messages if one["severity"] > ADVICE], "documents": found}


with helm_python.Chart.load(sys.argv[1]) as opened:
    json.dump([rendered(opened, values) for values in json.load(sys.stdin)], sys.stdout)
