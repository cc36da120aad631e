"""What pyproject.toml cannot say: a wheel carries the commit it was built from, and in a release a bill of materials.

A clone says its commit itself. Without git, as in a container build, SOURCE_COMMIT says it; from a source that knows
neither, the wheel has no commit. `tools/release.py` puts both files into the tree that it builds from.
"""

import os
import shutil
import subprocess
from pathlib import Path

from setuptools import setup
from setuptools.command.bdist_wheel import bdist_wheel
from setuptools.command.build_py import build_py

ROOT = Path(__file__).parent
BILL_OF_MATERIALS = ROOT / "sbom.cdx.json"


class BuildWithCommit(build_py):
    """Build the packages, and beside `service/build.py` the file that it reads the commit from."""

    def run(self) -> None:
        """Build; an editable installation stays in its clone, which says the commit itself."""
        super().run()
        commit = _commit()
        if commit and not self.editable_mode:
            (Path(self.build_lib) / "service" / "commit.txt").write_text(f"{commit}\n")


class WheelWithBillOfMaterials(bdist_wheel):
    """Put the bill of materials where PEP 770 has scanners look for it."""

    def egg2dist(self, egginfo_path: str, distinfo_path: str) -> None:
        """Write the metadata of the wheel."""
        super().egg2dist(egginfo_path, distinfo_path)
        if BILL_OF_MATERIALS.is_file():
            folder = Path(distinfo_path) / "sboms"
            folder.mkdir()
            shutil.copy(BILL_OF_MATERIALS, folder / f"{self.distribution.get_name()}.cdx.json")


def _commit() -> str:
    if not (ROOT / ".git").exists():
        return os.environ.get("SOURCE_COMMIT", "")
    asked = subprocess.run(["git", "-C", ROOT, "rev-parse", "HEAD"], capture_output=True, text=True, check=False)
    return asked.stdout.strip()


setup(cmdclass={"build_py": BuildWithCommit, "bdist_wheel": WheelWithBillOfMaterials})
