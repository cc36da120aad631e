"""`esc mqtt` between a service and a real Mosquitto, seen by a client of its own."""

import json
import os
import shutil
import signal
import subprocess
import sys
from contextlib import contextmanager
from functools import partial

import paho.mqtt.client as paho
import pytest

from testbed import warm
from testbed.ports import free_port
from testbed.running import venue, wait_for
from tests.e2e.conftest import FROM_HERE, shared
from tests.worker.certificates import certificate

USER, PASSWORD = "esc", "pass word"
PATH = f"{os.environ['PATH']}:/usr/sbin"


class Broker:
    """A Mosquitto that asks for a password, with a port of TLS."""

    def __init__(self, folder) -> None:
        self.folder, self.port, self.tls_port = folder, free_port(), free_port()
        certificate(folder, "localhost")
        passwords = folder / "passwords"
        subprocess.run(["mosquitto_passwd", "-c", "-b", passwords, USER, PASSWORD], check=True, capture_output=True)
        lines = [
            f"listener {self.port} 127.0.0.1",
            f"listener {self.tls_port} 127.0.0.1",
            f"certfile {folder}/certificate.pem",
            f"keyfile {folder}/key.pem",
            f"password_file {passwords}",
            "user root",
        ]
        (folder / "mosquitto.conf").write_text("\n".join(lines))
        self.start()

    def start(self) -> None:
        command = [shutil.which("mosquitto", path=PATH), "-c", self.folder / "mosquitto.conf"]
        self.process = subprocess.Popen(command, stderr=subprocess.DEVNULL)

    def stop(self) -> None:
        self.process.terminate()
        self.process.wait(30)


class Watcher:
    """A client that keeps the newest message of each topic, and of each whether the broker had kept it."""

    def __init__(self, broker) -> None:
        self.messages, self.connected = {}, False
        self.client = paho.Client(paho.CallbackAPIVersion.VERSION2)
        self.client.username_pw_set(USER, PASSWORD)
        self.client.on_connect = lambda client, *_: client.subscribe("#", 1)
        self.client.on_subscribe = lambda *_: setattr(self, "connected", True)
        self.client.on_message = lambda _, __, message: self.messages.update({message.topic: message})
        wait_for(partial(self.reach, broker))
        self.client.loop_start()
        wait_for(lambda: self.connected)

    def reach(self, broker) -> bool:
        try:
            return self.client.connect("127.0.0.1", broker.port) == 0
        except OSError:
            return False

    def publish(self, topic, payload, **options) -> None:
        self.client.publish(topic, payload, 1, **options).wait_for_publish(30)

    def text(self, topic):
        """The newest message of a topic, None if there is none."""
        message = self.messages.get(topic)
        return None if message is None else message.payload.decode()

    def document(self, topic):
        return json.loads(self.text(topic) or "null")

    def close(self) -> None:
        self.client.disconnect()
        self.client.loop_stop()


@pytest.fixture(scope="module")
def service(tmp_path_factory):
    """A service of their own: each command publishes all venues that a service has."""
    yield from shared(tmp_path_factory.mktemp("mqtt"), **FROM_HERE)


@pytest.fixture(scope="module")
def broker(missing, tmp_path_factory):
    if shutil.which("mosquitto", path=PATH) is None:
        missing("mosquitto")
    broker = Broker(tmp_path_factory.mktemp("mosquitto"))
    yield broker
    broker.stop()


@pytest.fixture
def watcher(broker):
    watcher = Watcher(broker)
    yield watcher
    watcher.close()


@contextmanager
def mqtt(service, url, *arguments, **environment):
    """The command, while it runs, with topics of its own."""
    command = [sys.executable, "-m", "service.cli", "mqtt", "--broker", url, *arguments]
    variables = service.environment | {"ESC_URL": service.url, "ESC_MQTT_PASSWORD": PASSWORD} | environment
    pipes = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
    with warm.Popen(command, env=os.environ | variables, text=True, **pipes) as process:
        try:
            yield process
        finally:
            process.kill()


@pytest.fixture
def bridge(service, broker, name):
    with mqtt(service, f"mqtt://{USER}@127.0.0.1:{broker.port}", "--topic", name) as process:
        yield process


def put(service, name, behaviour, **more):
    document = venue(name, behaviour) | more
    service.http.put(f"/venues/{name}", json=document).raise_for_status()
    return document


def config_topic(name):
    return f"homeassistant/device/{name}_{name}/config"


def test_an_alarm_of_a_venue_is_seen_and_cleared_and_a_deleted_venue_is_taken_back(service, name, bridge, watcher):
    state, config = f"{name}/{name}/state", config_topic(name)
    put(service, name, "reject", alarms={"rejected_in_a_row": 1})
    found = wait_for(lambda: watcher.document(config))
    parts = found["components"]
    assert found["device"]["name"] == "reject"
    assert found["availability_topic"] == f"{name}/status"
    assert watcher.text(f"{name}/status") == "online"
    assert {part["platform"] for part in parts.values()} == {"sensor", "binary_sensor", "button"}
    assert len({part.get("unique_id") for part in parts.values()}) == len(parts)
    # Without sources nothing can be calibrated by a button.
    assert parts["calibrate"] == {"platform": "button"}
    assert wait_for(lambda: watcher.document(state))["alarm"] == "OFF"
    assert watcher.document(state)["accepted_at"] is None

    service.calibrated(name)
    rings = wait_for(lambda: (said := watcher.document(state))["alarm"] == "ON" and said)
    assert "rejected" in rings["alarms"][0]
    assert rings["rejected_in_a_row"] == 1

    service.http.patch(f"/venues/{name}", json={"name": "accept"}).raise_for_status()
    job = service.calibrated(name, shade=1)
    calm = wait_for(lambda: (said := watcher.document(state))["alarm"] == "OFF" and said)
    assert calm["alarms"] == []
    assert calm["stitch_error_px"] == job["result"]["stitch_error_px"]
    assert calm["drift_px"] > 0
    assert calm["accepted_at"] is not None
    assert watcher.document(config)["device"]["name"] == "accept"

    service.http.delete(f"/venues/{name}").raise_for_status()
    wait_for(lambda: watcher.text(config) == watcher.text(state) == "")


def test_each_camera_has_a_topic_that_says_how_its_picture_moved(service, name, bridge, watcher):
    put(service, name, "accept")
    topics = {camera: f"{name}/{name}/cameras/{camera}/picture-motion" for camera in ("left", "right")}
    wait_for(lambda: watcher.document(config_topic(name)))
    assert [watcher.text(topic) for topic in topics.values()] == [None, None]
    service.calibrated(name)
    for camera, topic in topics.items():
        moved = wait_for(lambda topic=topic: watcher.document(topic))
        address = f"/venues/{name}/cameras/{camera}/picture-motion"
        assert moved == service.http.get(address, params={"since": 1}).json()
        assert (moved["since"], moved["revision"], len(moved["ground"])) == (1, 2, 3)
    service.http.delete(f"/venues/{name}").raise_for_status()
    wait_for(lambda: {watcher.text(topic) for topic in topics.values()} == {""})


def test_the_button_calibrates_by_the_sources_of_a_venue(service, name, bridge, watcher, camera):
    cameras = [one | {"source": camera.url("/ok")} for one in venue(name)["cameras"]]
    put(service, name, "accept", cameras=cameras)
    button = wait_for(lambda: watcher.document(config_topic(name)))["components"]["calibrate"]
    watcher.publish(button["command_topic"], "something else")
    watcher.publish(button["command_topic"], button["payload_press"])
    wait_for(lambda: (said := watcher.document(f"{name}/{name}/state")) and said["accepted_at"])
    assert [job["status"] for job in service.http.get("/jobs", params={"venue": name}).json()["jobs"]] == ["succeeded"]


def test_venues_are_published_again_after_the_broker_has_forgotten_them(service, name, broker, bridge, watcher):
    put(service, name, "accept")
    wait_for(lambda: watcher.document(config_topic(name)))
    broker.stop()
    broker.start()
    watcher.messages.clear()
    wait_for(lambda: watcher.document(config_topic(name)))
    wait_for(lambda: watcher.text(f"{name}/status") == "online")
    # Home Assistant says that it has started.
    watcher.messages.clear()
    watcher.publish("homeassistant/status", "online")
    wait_for(lambda: watcher.document(config_topic(name)))

    bridge.kill()
    wait_for(lambda: watcher.text(f"{name}/status") == "offline")


def test_what_was_deleted_meanwhile_is_taken_back_and_a_kept_command_is_not_obeyed(service, name, broker, watcher):
    put(service, name, "accept")
    motion, config = f"{name}/gone/cameras/left/picture-motion", f"homeassistant/device/{name}_gone/config"
    for topic, payload in ((f"{name}/gone/state", "{}"), (motion, "{}"), (config, "{}")):
        watcher.publish(topic, payload, retain=True)
    watcher.publish(f"{name}/{name}/calibrate", "PRESS", retain=True)
    url, secret = f"mqtts://{USER}@localhost:{broker.tls_port}", broker.folder / "secret"
    secret.write_text(f"{PASSWORD}\n")
    files = {"ESC_MQTT_PASSWORD": "", "ESC_MQTT_PASSWORD_FILE": str(secret)}
    trust = {"SSL_CERT_FILE": str(broker.folder / "certificate.pem")}
    with mqtt(service, url, "--topic", name, **files, **trust) as process:
        wait_for(lambda: watcher.text(config) == watcher.text(motion) == "")
        wait_for(lambda: watcher.document(config_topic(name)))
        assert watcher.text(f"{name}/gone/state") == ""
        process.send_signal(signal.SIGTERM)
        told = process.communicate(timeout=30)[1]
    assert process.returncode == 0
    assert "Stopped." in told
    assert "Calibrate" not in told
    assert watcher.text(f"{name}/status") == "offline"


def test_a_broker_that_refuses_is_named_once_and_asked_again(service, broker, name):
    url = f"mqtt://{USER}@127.0.0.1:{broker.port}"
    with mqtt(service, url, "--topic", name, ESC_MQTT_PASSWORD="wrong") as process:
        process.stderr.readline()
        assert "Not authorized" in process.stderr.readline()
        process.send_signal(signal.SIGTERM)
        assert "Not authorized" not in process.communicate(timeout=30)[1]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--broker", "http://127.0.0.1"], "expected mqtt://HOST"),
        (["--broker", "mqtt://127.0.0.1:x"], "the port is no number"),
        (["--broker", "mqtt://esc:hunter2@127.0.0.1"], "others can read a password there"),
        (["--broker", "mqtt://127.0.0.1", "--topic", "a/b"], "expected letters, digits"),
    ],
)
def test_what_is_wrong_with_the_options_is_said(esc, arguments, words):
    ended = esc("mqtt", *arguments)
    assert ended.returncode == 2
    assert words in ended.stderr
    assert "hunter2" not in ended.stderr
