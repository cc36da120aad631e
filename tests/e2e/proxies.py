"""A real nginx and a real Caddy in front of a service, by the samples that operators copy."""

import os
import shutil
import ssl
import subprocess
from pathlib import Path

import httpx

from testbed.ports import free_port
from testbed.running import DEADLINE_S, Service, wait_for
from tests.worker.certificates import certificate

SAMPLES = Path(__file__).parents[2] / "docker" / "proxy"
NAME = "localhost"
STALL_S = 3


class Proxy:
    """A proxy by a sample in which only names, ports and the certificate are others, and the path where one is given.

    `root_path`: below which the service is shown, as docker/README.md has it.
    """

    def __init__(self, folder: Path, service: Service, root_path: str = "") -> None:
        self.folder = folder
        self.root_path = root_path
        self.upstream = service.url.removeprefix("http://")
        certificate(folder, NAME)
        self.http_port, self.https_port = free_port(), free_port()
        self.url = f"https://{NAME}:{self.https_port}{root_path}"
        with (folder / "log").open("wb") as log:
            self.process = subprocess.Popen(self.command(), cwd=folder, stdout=log, stderr=log, env=self.environment())
        self.trusted = ssl.create_default_context(cafile=folder / "certificate.pem")
        wait_for(self.answers)

    def answers(self) -> bool:
        assert self.process.poll() is None, (self.folder / "log").read_text()
        with self.client() as client:
            return client.get("/livez").status_code == 200

    def client(self, key: str | None = None, address: str = "127.0.0.1", **headers: str) -> httpx.Client:
        """Somebody at an address of this machine."""
        if key:
            headers["Authorization"] = f"Bearer {key}"
        transport = httpx.HTTPTransport(verify=self.trusted, local_address=address)
        return httpx.Client(base_url=self.url, transport=transport, headers=headers, timeout=DEADLINE_S)

    def changed(self, text: str, changes: dict[str, str]) -> str:
        for old, new in changes.items():
            assert old in text, old
            text = text.replace(old, new)
        return text

    def command(self) -> list:
        raise NotImplementedError

    def environment(self) -> dict[str, str]:
        return os.environ | {"HOME": str(self.folder), "XDG_DATA_HOME": str(self.folder)}

    def stop(self) -> None:
        self.process.terminate()
        self.process.wait(DEADLINE_S)


class Nginx(Proxy):
    program = "nginx"
    addresses = ("127.0.0.5", "127.0.0.6")

    def command(self) -> list:
        site = self.changed(
            (SAMPLES / "nginx.conf").read_text(),
            {
                "127.0.0.1:8000": self.upstream,
                "listen 80;": f"listen 127.0.0.1:{self.http_port};",
                "listen 443 ssl http2;": f"listen 127.0.0.1:{self.https_port} ssl http2;",
                "/etc/letsencrypt/live/esc.example.com/fullchain.pem": f"{self.folder}/certificate.pem",
                "/etc/letsencrypt/live/esc.example.com/privkey.pem": f"{self.folder}/key.pem",
                "esc.example.com": NAME,
                "location / {": f"location {self.root_path}/ {{",
            },
        )
        kinds = ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")
        places = "".join(f"{kind}_temp_path {self.folder}/{kind};\n" for kind in kinds)
        main = f"daemon off; pid {self.folder}/pid; error_log stderr; user root;\nevents {{}}\n"
        whole = f"{main}http {{\naccess_log off;\n{places}{site}}}\n"
        (self.folder / "nginx.conf").write_text(whole if os.geteuid() == 0 else whole.replace("user root;", ""))
        return [shutil.which(self.program), "-p", self.folder, "-c", self.folder / "nginx.conf"]


class Caddy(Proxy):
    program = "caddy"
    addresses = ("127.0.0.7", "127.0.0.8")

    def command(self) -> list:
        site = self.changed(
            (SAMPLES / "Caddyfile").read_text(),
            {
                "127.0.0.1:8000": self.upstream,
                "read_body 10m": f"read_body {STALL_S}s",
                "{\n\tservers": f"{{\n\tadmin off\n\thttp_port {self.http_port}\n\thttps_port {self.https_port}\n"
                "\tskip_install_trust\n\tservers",
                "\nesc.example.com {": f"\n{NAME} {{\n\ttls {self.folder}/certificate.pem {self.folder}/key.pem",
            }
            | self.below(),
        )
        (self.folder / "Caddyfile").write_text(site)
        return [shutil.which(self.program), "run", "--config", "Caddyfile", "--adapter", "caddyfile"]

    def below(self) -> dict[str, str]:
        """Takes the path off, where nginx leaves it on."""
        proxied = f"\treverse_proxy {self.upstream}"
        return {proxied: f"\thandle_path {self.root_path}/* {{\n\t{proxied}\n\t}}"} if self.root_path else {}


class SignInProxy(Caddy):
    """Caddy with the sample by which people sign in, in front of what stands in for oauth2-proxy at `sign_in`."""

    def __init__(self, folder: Path, service: Service, sign_in: str, key: str) -> None:
        self.sign_in, self.key = sign_in, key
        super().__init__(folder, service)

    def command(self) -> list:
        command = super().command()
        file = self.folder / "Caddyfile"
        site = self.changed(
            (SAMPLES / "Caddyfile.oidc").read_text(),
            {
                "127.0.0.1:8000": self.upstream,
                "127.0.0.1:4180": self.sign_in,
                "\nesc.example.com {": f"\n{NAME} {{\n\ttls {self.folder}/certificate.pem {self.folder}/key.pem",
            },
        )
        options = file.read_text()
        file.write_text(options[: options.index(f"\n{NAME} {{")] + site)
        return command

    def client(self, key: str | None = None, address: str = "127.0.0.1", **headers: str) -> httpx.Client:
        """A program with the key of the proxy, unless it is somebody who signs in (`Cookie`) or has another key."""
        return super().client(key or (None if "Cookie" in headers else self.key), address, **headers)

    def environment(self) -> dict[str, str]:
        return super().environment() | {"ESC_API_KEY": self.key}
