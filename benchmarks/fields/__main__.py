"""`make bench-fields`: what is seen and what is found on every kind of field, and what must not be.

    python -m benchmarks.fields --only real --starts 3 --turn 2.1 --shift 16.2
    python -m benchmarks.fields --only rendered --fields tennis padel --views 2 --pictures out

Sections: `real` (frames with known cameras, where they are), `rendered` (every template on grounds and in colours of
all kinds, from the paper's Start errors), `views` (pictures that cannot be used or show something else: none may be
accepted). Every run is written to a file and not run again, so that long ones can be continued; another model is run
anew, and after a change of the engine or of the renderer the file has to be removed. Times are the worker's only with
OPENBLAS_NUM_THREADS=1, as `make` sets it.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2

from benchmarks.fields import real, rendered, views
from benchmarks.fields.engine import THREADS, Engine
from benchmarks.printing import print_sections
from benchmarks.rows import Rows
from benchmarks.scenes import FOLDER as RUNS
from fields.template import NAMES
from models import MODEL_PATH

SECTIONS: dict[str, Callable[[argparse.Namespace, Engine], Iterator[str]]] = {
    "real": real.section,
    "rendered": rendered.section,
    "views": views.section,
}


def main() -> None:
    """Run what is asked for and print it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=SECTIONS, default=list(SECTIONS), help="sections")
    parser.add_argument("--folder", type=Path, default=real.FOLDER, help="of real frames, with cases.json")
    parser.add_argument("--cases", nargs="+", help="real ones with one of these in their names")
    parser.add_argument("--starts", type=int, default=3, help="of each real case")
    parser.add_argument("--turn", type=float, default=1.0, help="degrees that real starts are off")
    parser.add_argument("--shift", type=float, default=10.0, help="centimetres that real starts are off")
    parser.add_argument("--fields", nargs="+", choices=NAMES, default=list(NAMES), help="templates to render")
    parser.add_argument("--views", type=int, default=20, help="rendered, of each template")
    parser.add_argument("--spoiled", type=int, default=1, help="rendered views of each template to be spoiled each way")
    parser.add_argument("--model", type=Path, default=MODEL_PATH, help="the network")
    parser.add_argument("--rows", type=Path, default=RUNS / "fields.jsonl", help="the file of what has been run")
    parser.add_argument("--pictures", type=Path, help="folder for the frames that are rendered or spoiled")
    options = parser.parse_args()
    if options.pictures:
        options.pictures.mkdir(parents=True, exist_ok=True)
    cv2.setNumThreads(THREADS)
    engine = Engine(options.model, Rows(options.rows))
    print_sections(options.only, SECTIONS, options, engine)


if __name__ == "__main__":
    main()
