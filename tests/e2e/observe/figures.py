"""Metrics of a service, parsed as Prometheus does."""

from prometheus_client.parser import text_string_to_metric_families


def families(service):
    answer = service.http.get("/metrics")
    assert answer.status_code == 200
    return {family.name: family for family in text_string_to_metric_families(answer.text)}


def figures(service):
    """Every sample: its name and its labels, and its value."""
    return {
        (sample.name, *sorted(sample.labels.items())): sample.value
        for family in families(service).values()
        for sample in family.samples
    }
