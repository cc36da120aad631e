"""The Helm chart: rendered by Helm's library and checked against the schemas of Kubernetes (`make charts`)."""

import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import yaml

from service.settings import Settings

pytestmark = pytest.mark.long

ROOT = Path(__file__).parents[1]
CHART = ROOT / "docker" / "helm"
LEAST = {"image": {"repository": "registry.example/esc"}, "secret": "esc", "blobUrl": "s3://esc"}
SCALED = LEAST | {"keda": {"enabled": True}, "worker": {"replicas": 2}, "api": {"replicas": 3}}
WHOLE = LEAST | {
    "image": {"repository": "registry.example/esc", "tag": "next", "pullSecrets": ["registry"]},
    "settings": {"ESC_SOURCES": '["10.0.0.0/8"]', "ESC_DRAIN_S": 20, "ESC_CALLBACK_ALLOW_HTTP": True},
    "ingress": {"host": "esc.example.com", "className": "nginx", "tlsSecret": "esc-tls"},
    "networkPolicy": {
        "from": [{"namespaceSelector": {"matchLabels": {"name": "ingress"}}}],
        "egress": [{"to": [{"ipBlock": {"cidr": "10.0.0.0/8"}}]}],
    },
}
REFUSED = {
    "/image/repository": {},
    "/blobUrl": LEAST | {"blobUrl": "file:///data"},
    # Workers also run schedules, alarms and callbacks.
    "/worker/replicas": LEAST | {"worker": {"replicas": 0}},
    "additional properties 'replicas'": LEAST | {"replicas": 2},
    "invalid propertyName 'ESC-SOURCES'": LEAST | {"settings": {"ESC-SOURCES": "[]"}},
}


@pytest.fixture(scope="module")
def rendered(missing):
    """What Helm makes of each set of values."""
    python = Path(sys.prefix) / "charts" / "bin" / "python"
    if not python.exists():
        missing("helm")
    values = json.dumps([LEAST, SCALED, WHOLE, *REFUSED.values()])
    command = [python, Path(__file__).with_name("render_chart.py"), CHART]
    said = subprocess.run(command, input=values, capture_output=True, text=True)
    assert said.returncode == 0, said.stderr
    return json.loads(said.stdout)


def by_name(one):
    assert one["lint"] == []
    return {(document["kind"], document["metadata"]["name"]): document for document in one["documents"]}


def pods(documents):
    return [
        documents[kind]["spec"]["template"] for kind in (("Deployment", "field-api"), ("StatefulSet", "field-worker"))
    ]


def test_the_least_values_make_an_api_and_a_worker_that_nobody_reaches(rendered):
    documents = by_name(rendered[0])
    assert sorted(documents) == [
        ("Deployment", "field-api"),
        ("NetworkPolicy", "field-api"),
        ("NetworkPolicy", "field-worker"),
        ("PodDisruptionBudget", "field-api"),
        ("PodDisruptionBudget", "field-worker"),
        ("Service", "field-api"),
        ("StatefulSet", "field-worker"),
    ]
    api, worker = pods(documents)
    assert [pod["spec"]["containers"][0]["args"] for pod in (api, worker)] == [["serve"], ["worker"]]
    assert documents["NetworkPolicy", "field-worker"]["spec"]["policyTypes"] == ["Ingress"]
    assert "ingress" not in documents["NetworkPolicy", "field-worker"]["spec"]
    for (kind, name), document in documents.items():
        labels = (api if name == "field-api" else worker)["metadata"]["labels"]
        spec = document["spec"]
        selector = spec["selector"] if "selector" in spec else spec["podSelector"]
        assert selector.get("matchLabels", selector) == labels, (kind, name)


def test_pods_run_as_any_user_but_root_and_write_to_two_folders(rendered):
    for pod in pods(by_name(rendered[0])):
        (container,) = pod["spec"]["containers"]
        # OpenShift gives each project users of its own.
        assert pod["spec"]["securityContext"] == {"runAsNonRoot": True, "seccompProfile": {"type": "RuntimeDefault"}}
        assert container["securityContext"] == {
            "allowPrivilegeEscalation": False,
            "readOnlyRootFilesystem": True,
            "capabilities": {"drop": ["ALL"]},
        }
        assert [mount["mountPath"] for mount in container["volumeMounts"]] == ["/data", "/tmp"]
        assert {mount["name"] for mount in container["volumeMounts"]} == {one["name"] for one in pod["spec"]["volumes"]}
        assert pod["spec"]["terminationGracePeriodSeconds"] > Settings.model_fields["drain_s"].default
        assert not pod["spec"]["automountServiceAccountToken"]
        assert container["envFrom"] == [{"secretRef": {"name": "esc"}}]
        assert container["resources"]["limits"]["memory"]


def test_workers_are_scaled_by_what_the_service_counts(rendered):
    documents = by_name(rendered[1])
    spec = documents["ScaledObject", "field-worker"]["spec"]
    assert "replicas" not in documents["StatefulSet", "field-worker"]["spec"]
    assert documents["Deployment", "field-api"]["spec"]["replicas"] == 3
    assert spec["scaleTargetRef"] == {"kind": "StatefulSet", "name": "field-worker"}
    assert (spec["minReplicaCount"], spec["maxReplicaCount"]) == (2, 4)
    (trigger,) = spec["triggers"]
    metrics = re.findall(r"\besc_\w+", trigger["metadata"]["query"])
    source = (ROOT / "service" / "observability" / "metrics.py").read_text()
    assert metrics == ["esc_queue_jobs", "esc_jobs_running"]
    assert all(f'"{metric}"' in source for metric in metrics)
    assert all(isinstance(value, str) for value in trigger["metadata"].values())


def test_what_is_set_arrives(rendered):
    documents = by_name(rendered[2])
    for pod in pods(documents):
        (container,) = pod["spec"]["containers"]
        environment = {one["name"]: one["value"] for one in container["env"]}
        assert environment == {
            "ESC_BLOB_URL": "s3://esc",
            "ESC_SOURCES": '["10.0.0.0/8"]',
            "ESC_DRAIN_S": "20",
            "ESC_CALLBACK_ALLOW_HTTP": "true",
        }
        assert container["image"] == "registry.example/esc:next"
        assert pod["spec"]["imagePullSecrets"] == [{"name": "registry"}]
    (rule,) = documents["Ingress", "field-api"]["spec"]["rules"]
    assert rule["host"] == "esc.example.com"
    assert documents["NetworkPolicy", "field-api"]["spec"]["ingress"][0]["from"] == WHOLE["networkPolicy"]["from"]
    assert documents["NetworkPolicy", "field-worker"]["spec"]["policyTypes"] == ["Ingress", "Egress"]


def test_values_that_make_no_service_are_refused(rendered):
    assert [words in one.get("refused", "") for words, one in zip(REFUSED, rendered[3:], strict=True)] == [True] * 5


def test_the_chart_is_of_the_version_that_it_installs():
    chart = yaml.safe_load((CHART / "Chart.yaml").read_text())
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    assert chart["version"] == chart["appVersion"] == version
