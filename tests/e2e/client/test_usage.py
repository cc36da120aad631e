"""Wrong arguments and settings: told in words, with exit code 2, before a service is asked or anything computed."""

import json

import pytest

from testbed.running import png, venue
from tests.e2e.commands import esc_here

NO_CHOICE = "name a CAMERA, or a number of the field with --field and --job, or --found JOB"


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("job list --limit 0", "'--limit': expected 1 or more, came '0'"),
        ("job list --status asleep", "'--status': 'asleep' is not one of 'queued', "),
        ("job get 01ABC", "26 capital letters"),
        ("venue get A", "64 small letters"),
        ("venue restore main first", "'revision': expected a whole number, came 'first'"),
        ("venue list --url 127.0.0.1:8000", "no address such as http://"),
        ("venue list --url ftp://127.0.0.1", "no address such as http://"),
        ("venue list --url=", "no address such as http://"),
        ("venue trend main --since yesterday", "such as 2026-11-03"),
        ("venue set main name", "'name' is not PART=VALUE"),
        ("venue set main =x", "'=x' is not PART=VALUE"),
        ("venue set main a..b=1", "'a..b=1' is not PART=VALUE"),
        ("venue put left.png", "left.png: Invalid JSON"),
        ("venue adopt main", NO_CHOICE),
        ("venue adopt main left --field length_m", NO_CHOICE),
        ("venue adopt main --field length_m", NO_CHOICE),
        (f"venue adopt main left --job {'0' * 26}", NO_CHOICE),
        (f"venue adopt main left --found {'0' * 26}", NO_CHOICE),
        ("venue adopt main left --candidate left=2", NO_CHOICE),
        (f"venue adopt main --found {'0' * 26} --candidate left", "'left' is not CAMERA=NUMBER"),
        ("venue adopt main --job 7", "26 capital letters"),
        ("venue find main left=left.png --sport quidditch", "--sport: field.template: quidditch is none of"),
        ("venue find main left=left.png --sport tennis --site left.png", "give --sport or --site, not both"),
        ("venue find main left=left.png --site left.png", "left.png: Invalid JSON"),
        ('venue find main left=left.png --options {"dry_run":true}', "--options: dry_run is not known"),
        ("calibrate main left", "'left' is not CAMERA=FILE"),
        ("calibrate main =x", "'=x' is not CAMERA=FILE"),
        ("calibrate main left=nowhere.png", "There is no file nowhere.png (camera left)"),
        ("calibrate main left=left.png --options {", "--options: Invalid JSON"),
        ("pose left.png left.png left=left.png -o first.json", "left.png: Invalid JSON"),
        ("pose --points quidditch", "there are american-football, "),
        ("serve --port http", "'--port': expected a whole number, came 'http'"),
        ("serve --port 99999", "--port: expected 65535 or less, came 99999"),
        ("serve --port 0 --host nowhere.invalid", "Cannot listen on nowhere.invalid:0: no such host."),
        ("live venue.json --json --interface 300.1.1.1", "'--interface': expected an IPv4 address"),
        ("live main left=rtsp://10.1.0.7/main --hold", "--hold sends stored poses alone"),
        ("live main --recover", "--recover has the service calibrate a venue of its own whose cameras are tracked"),
        ("live main --rate 0", "--rate 0: samples a second"),
        ("live main --freed 10.1.0.20", "--freed 10.1.0.20: expected HOST:PORT"),
        ("live main --opentrackio 10.1.0.20:70000", "expected HOST:PORT"),
        ("live main --zoom left=5", "--zoom and --focus are sent by FreeD alone"),
        ("live main --freed 10.1.0.20:40000 --focus left=16777216", "--focus left=16777216: expected a count from 0"),
        ("live venue.json middle=rtsp://10.1.0.7/main", "The venue has no camera middle; it has left, right"),
        ("stitch Venue.json left=l.mp4 -o pano.mp4", "There is no file Venue.json"),
        ("stitch venue.json left=l.mp4 left=l.mp4 -o pano.mp4", "camera left is given twice"),
        ("stitch venue.json l.mp4 -o pano.mp4", "'l.mp4' is not CAMERA=CLIP"),
        ("stitch venue.json left=l.mp4 -o pano.mp4 --width 321", "are even numbers"),
        ("stitch venue.json left=l.mp4 -o pano.mp4 --height 99", "are even numbers"),
        ("stitch venue.json left=l.mp4 -o pano.mp4 --height high", "--height: 'high' is no number"),
        ("stitch venue.json left=l.mp4 -o pano.mp4 --field-of-view 400", "--field-of-view 400: from 5 to 340, or auto"),
        ("stitch venue.json left=l.mp4 -o pano.mp4 --projection fisheye", "Invalid value for '--projection'"),
        ("stitch venue.json left=l.mp4 -o pano.mp4 --rate 0", "--rate 0: pictures a second"),
        ("stitch venue.json left=l.mp4 -o pano.mp4 --from 1:xx", "'xx' is no number"),
        ("stitch venue.json left=l.mp4 -o pano.mp4 --offset right=soon", "--offset right=soon: 'soon' is no number"),
        ("field fit venue.json left=left.png -o no/venue.json", "'--output': there is no folder no"),
    ],
)
def test_an_argument_that_is_wrong_is_told_in_words(tmp_path, command, words):
    (tmp_path / "venue.json").write_text(json.dumps(venue("v")))
    (tmp_path / "left.png").write_bytes(png())
    answer = esc_here(tmp_path, *command.split(), COLUMNS="200", ESC_URL="http://127.0.0.1:9")
    assert (answer.returncode, answer.stdout) == (2, "")
    assert words in " ".join(answer.stderr.replace("│", " ").split()), answer.stderr


@pytest.mark.parametrize(
    ("command", "setting", "value", "line"),
    [
        ("serve", "ESC_QUEUE_LIMIT", "many", "ESC_QUEUE_LIMIT: expected a whole number, came 'many'\n"),
        ("serve", "ESC_DRAIN_S", "-1", "ESC_DRAIN_S: expected 0 s or more, came '-1'\n"),
        ("serve", "ESC_DATABASE_URL", "mysql://x", "ESC_DATABASE_URL: expected is "),
        ("serve", "ESC_SOURCES", "127.0.0.1", 'ESC_SOURCES: expected a list in JSON, for instance ["127.0.0.1"]\n'),
        *(
            (command, "ESC_DRAINS", "2", "unknown setting ESC_DRAINS: did you mean ESC_DRAIN_S?\n")
            for command in ("serve", "up", "worker", "key list")
        ),
    ],
)
def test_a_setting_that_is_wrong_is_told_in_a_line(tmp_path, command, setting, value, line):
    answer = esc_here(tmp_path, *command.split(), **{setting: value})
    assert (answer.returncode, answer.stdout) == (2, "")
    assert answer.stderr.startswith(line)
