"""Certificates for servers of the tests."""

import shutil
import subprocess

import pytest


def certificate(folder, name):
    """A certificate for a name, signed by itself, with its key."""
    openssl = shutil.which("openssl") or pytest.skip("openssl is not installed")
    file = folder / "certificate.pem"
    kind = ["-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days", "2"]
    subject = ["-subj", f"/CN={name}", "-addext", f"subjectAltName=DNS:{name}"]
    command = [openssl, "req", *kind, *subject, "-keyout", folder / "key.pem", "-out", file]
    subprocess.run(command, check=True, capture_output=True)
    file.write_bytes(file.read_bytes() + (folder / "key.pem").read_bytes())
    return file
