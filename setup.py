"""What pyproject.toml cannot say: a wheel that is built in a clone carries the commit it was built from.

Without git, as in a container build, SOURCE_COMMIT says it; from a source that knows neither, the wheel has no commit.
"""

import os
import subprocess
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py

ROOT = Path(__file__).parent


class BuildWithCommit(build_py):
    """Build the packages, and beside `service/build.py` the file that it reads the commit from."""

    def run(self) -> None:
        """Build; an editable installation stays in its clone, which says the commit itself."""
        super().run()
        commit = _commit()
        if commit and not self.editable_mode:
            (Path(self.build_lib) / "service" / "commit.txt").write_text(f"{commit}\n")


def _commit() -> str:
    if not (ROOT / ".git").exists():
        return os.environ.get("SOURCE_COMMIT", "")
    asked = subprocess.run(["git", "-C", ROOT, "rev-parse", "HEAD"], capture_output=True, text=True, check=False)
    return asked.stdout.strip()


setup(cmdclass={"build_py": BuildWithCommit})
