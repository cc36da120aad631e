"""Hosts of cameras: which are taken to be silent, and for how long."""

from worker.duties.reachability import LATE_TO_BE_SILENT, HostReachability

SOURCES = ["http://10.1.0.7/left.jpg", "http://10.1.0.7/right.jpg"]


def test_a_host_is_silent_whose_fetches_were_late_several_times_in_a_row():
    hosts = HostReachability([])
    for _ in range(LATE_TO_BE_SILENT):
        assert not hosts.is_silent(SOURCES)
        hosts.note_late(SOURCES[0])
    assert hosts.is_silent([SOURCES[1]])
    assert not hosts.is_silent(["http://10.1.0.7:8080/left.jpg"])
    hosts.note_answers(SOURCES)
    assert not hosts.is_silent(SOURCES)


def test_a_host_that_is_late_now_and_then_is_not_silent():
    hosts = HostReachability([])
    for _ in range(3 * LATE_TO_BE_SILENT):
        hosts.note_late(SOURCES[0])
        assert not hosts.is_silent(SOURCES)
        hosts.note_answers(SOURCES)
