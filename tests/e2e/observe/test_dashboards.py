"""The dashboard and the alarms ask for figures that exist, in queries that Prometheus understands."""

import json
import re
import shutil
import subprocess
from itertools import pairwise
from pathlib import Path

import pytest
import yaml

from testbed.running import venue
from tests.e2e.observe.figures import families

ROOT = Path(__file__).parents[3]
ALERTS = ROOT / "docker" / "prometheus" / "alerts.yaml"
DASHBOARD = json.loads((ROOT / "docker" / "grafana" / "esc.json").read_text())
PANELS = [panel for panel in DASHBOARD["panels"] if panel["type"] != "row"]
RULES = [rule for group in yaml.safe_load(ALERTS.read_text())["groups"] for rule in group["rules"]]
QUERIES = [target["expr"] for panel in PANELS for target in panel["targets"]] + [rule["expr"] for rule in RULES]
METRIC = re.compile(r"\b(?:esc|process)_[a-z0-9_]+")
# Prometheus makes it of every target.
MADE_BY_PROMETHEUS = {"up"}
LABELS = re.compile(r"(?:by|without) \(([a-z_, ]*)\)|\{([^}]*)\}")


@pytest.fixture
def promtool(missing):
    return shutil.which("promtool") or missing("promtool")


@pytest.fixture
def moved(service, name):
    """A venue that was calibrated, and has an alarm that rings."""
    service.http.put(f"/venues/{name}", json=venue(name) | {"alarms": {"moved_since_last_px": 0.001}})
    service.calibrated(name)
    yield
    service.http.delete(f"/venues/{name}").raise_for_status()


def test_every_figure_and_every_label_that_is_asked_for_is_there(service, moved):
    samples = [sample for family in families(service).values() for sample in family.samples]
    figures = {metric for query in QUERIES for metric in METRIC.findall(query)}
    assert len(figures) > 20
    assert figures - {sample.name for sample in samples} - MADE_BY_PROMETHEUS == set()
    labels = set()
    for query in QUERIES:
        for groups, matchers in LABELS.findall(query):
            labels |= {label.strip() for label in groups.split(",")} | set(re.findall(r"([a-z0-9_]+)(?:=|!)", matchers))
    assert labels - {""} - {label for sample in samples for label in sample.labels} - {"job", "instance"} == set()


def test_what_is_told_once_per_api_process_is_not_added_up(service):
    """Figures from the database are the same from each: their sum would grow with the number of processes."""
    for query in QUERIES:
        for metric in set(METRIC.findall(query)) - {"esc_http_requests_total"}:
            if metric.startswith(("esc_http", "process_")):
                continue
            first = re.search(r"([a-z_]+)(?: by \([^)]*\))? ?\((?:[a-z_]+\()?" + metric, query)
            assert first, query
            assert first[1] in ("max", "min", "count", "increase", "rate"), query
            if first[1] in ("increase", "rate"):
                assert re.search(r"max(?: by \([^)]*\))? ?\((?:increase|rate)\(" + metric, query), query


def test_the_dashboard_is_one_that_grafana_imports():
    assert DASHBOARD["schemaVersion"] >= 36
    assert len({panel["id"] for panel in DASHBOARD["panels"]}) == len(DASHBOARD["panels"])
    for panel in PANELS:
        assert panel["type"] in ("stat", "timeseries", "table")
        assert panel["datasource"] == {"type": "prometheus", "uid": "${datasource}"}
        assert all(target["expr"] and target["refId"] for target in panel["targets"])
    placed = sorted((p["gridPos"]["y"], p["gridPos"]["x"], p["gridPos"]["w"]) for p in PANELS)
    for (row, left, width), (next_row, next_left, _) in pairwise(placed):
        assert row != next_row or left + width <= next_left
    assert all(left + width <= 24 for _, left, width in placed)


def test_the_page_says_what_to_do_about_every_alarm():
    page = (ROOT / "docker" / "README.md").read_text()
    assert [rule["alert"] for rule in RULES if f"`{rule['alert']}`" not in page] == []
    assert all(rule["labels"]["severity"] in ("page", "ticket") for rule in RULES)


def test_prometheus_understands_the_queries_of_the_dashboard(promtool, tmp_path):
    plain = [query.replace("$__rate_interval", "5m") for query in QUERIES]
    rules = [{"record": f"query:{number}", "expr": query} for number, query in enumerate(plain)]
    (tmp_path / "rules.yaml").write_text(yaml.safe_dump({"groups": [{"name": "queries", "rules": rules}]}))
    subprocess.run([promtool, "check", "rules", tmp_path / "rules.yaml"], check=True, capture_output=True)


def test_the_alarms_ring_when_they_should(promtool, tmp_path):
    shutil.copy(ALERTS, tmp_path)
    shutil.copy(ROOT / "tests" / "service" / "alerts.yaml", tmp_path / "test.yaml")
    tested = subprocess.run([promtool, "test", "rules", "test.yaml"], cwd=tmp_path, capture_output=True, text=True)
    assert tested.returncode == 0, tested.stdout + tested.stderr


def test_the_metrics_are_well_formed(promtool, service):
    checked = subprocess.run(
        [promtool, "check", "metrics"], input=service.http.get("/metrics").text, capture_output=True, text=True
    )
    assert checked.returncode == 0, checked.stdout + checked.stderr
