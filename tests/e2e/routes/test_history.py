"""The history of a venue on the command line, and the ways back."""


def test_the_command_line_goes_back_too(service, esc, name):
    job = service.calibrated(service.venue(name, "reject"))["id"]
    assert f'"id": "{job}"' in esc("job", "accept", job).stdout
    newest, oldest = (line.split("\t") for line in esc("venue", "history", name).stdout.splitlines())
    assert (newest[0], newest[2:4]) == ("2", ["accepted", job])
    assert (oldest[0], oldest[2:]) == (
        "1",
        ["put", "-", "left:-/0.0 right:-/0.0", "anyone from 127.0.0.1"],
    )
    assert f'"id": "{name}"' in esc("venue", "restore", name, "1").stdout
    assert [camera["pose"]["position"][0] for camera in service.http.get(f"/venues/{name}").json()["cameras"]] == [
        -1.0,
        -1.0,
    ]
    assert len(esc("venue", "history", name, "--limit", "2").stdout.splitlines()) == 2
    late = esc("job", "reject", job)
    assert (late.returncode, "revision 3 (restored)" in late.stderr) == (1, True)
