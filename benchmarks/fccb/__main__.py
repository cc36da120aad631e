"""Fixed Camera Calibration Bench: make a set, answer it, score the answers.

    python -m benchmarks.fccb make SET --seed 1
    python -m benchmarks.fccb import SET left=left.jpg --name arena --sport basketball --calibration cameras.toml
    python -m benchmarks.fccb import-dataset SET synloc data/SpiideoSynLoc --field 101.6x65.9
    python -m benchmarks.fccb answer SET ANSWERS --method esc
    python -m benchmarks.fccb answer SET ANSWERS --command "docker run --rm --network none -v {cases}:/cases:ro ..."
    python -m benchmarks.fccb score SET ANSWERS [ANSWERS ...]
    python -m benchmarks.fccb table SET --answers FOLDER

`make` writes the same set for the same seed, `import` adds your own frames to one, `import-dataset` those of a dataset.
`answer` runs a baseline, or any program: {cases} and {answers} in its command line become the two folders. `score`
prints a table per folder of answers, `table` answers by all baselines first. What is answered already is not answered
again.
"""

from __future__ import annotations

import argparse
import shlex
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import cv2

from benchmarks.fccb.datasets import DATASETS
from benchmarks.fccb.importing import import_dataset, import_frames
from benchmarks.fccb.making import make_set
from benchmarks.fccb.methods import BASELINES, THREADS, answer_all
from benchmarks.fccb.scoring import COLUMNS, AnswersError, overall, score
from benchmarks.fccb.sets import TASKS, CaseSet
from benchmarks.printing import table_head
from service.cli.arguments import parse_field, parse_frame_files

PUBLIC = {"keep": 28, "find": 28, "nights": 6, "rigs": 10}
"""Cases of the public set; seed 1."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Do what the command line says."""
    asked = _parser().parse_args(arguments)
    cv2.setNumThreads(THREADS)
    cases = CaseSet(asked.set)
    match asked.what:
        case "make":
            make_set(cases, asked.seed, {task: getattr(asked, task) for task in TASKS})
        case "import":
            field = parse_field(asked.sport, asked.field)
            frames = {camera: files[0] for camera, files in parse_frame_files(asked.frames).items()}
            import_frames(cases, asked.name, field, asked.calibration, frames)
        case "import-dataset":
            dataset = DATASETS[asked.dataset]
            if asked.field is None and not dataset.fixed_size:
                raise SystemExit(
                    f"--field: expected LENGTHxWIDTH in metres, as {asked.dataset} does not say it; got none"
                )
            field = parse_field(dataset.sport, asked.field)
            number = import_dataset(cases, asked.dataset, field, asked.folder, asked.most)
            print(f"{number} frames of {asked.dataset}, two cases each")
        case "answer" if asked.command:
            asked.answers.mkdir(parents=True, exist_ok=True)
            folders = {"cases": (asked.set / "cases").resolve(), "answers": asked.answers.resolve()}
            return subprocess.run([part.format(**folders) for part in shlex.split(asked.command)]).returncode
        case "answer":
            if why := BASELINES[asked.method].cannot_run():
                print(f"{asked.method}: {why}", file=sys.stderr)
                return 1
            answer_all(cases, asked.method, asked.answers)
        case "score":
            _print_table(cases, asked.answers)
        case "table":
            runnable = [name for name, baseline in BASELINES.items() if baseline.cannot_run() is None]
            for name in runnable:
                answer_all(cases, name, asked.answers / name)
            _print_table(cases, [asked.answers / name for name in runnable])
            for name, baseline in BASELINES.items():
                if why := baseline.cannot_run():
                    print(f"\n{name}: {why}")
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="what", required=True)
    make = commands.add_parser("make", help="write a set")
    make.add_argument("--seed", type=int, default=1)
    for task in TASKS:
        make.add_argument(f"--{task}", type=int, default=PUBLIC[task], help="cases of this task")
    own = commands.add_parser("import", help="add your own frames to a set")
    own.add_argument("--name", required=True, help="a word for the place")
    own.add_argument("--sport", required=True, help="template of the field")
    own.add_argument("--field", help="its size, as 105x68; the template's unless said")
    own.add_argument("--calibration", type=Path, nargs="+", required=True, help="files of any format ESC reads")
    published = commands.add_parser("import-dataset", help="add frames of a published dataset to a set")
    published.add_argument("--field", help="size of the fields in the folder, as 105x68; the template's unless said")
    published.add_argument("--most", type=int, default=PUBLIC["keep"], help="frames, evenly out of all")
    answer = commands.add_parser("answer", help="answer the cases of a set")
    by = answer.add_mutually_exclusive_group(required=True)
    by.add_argument("--method", choices=BASELINES)
    by.add_argument("--command", help="program that reads {cases} and writes {answers}")
    scored = commands.add_parser("score", help="print the score of answers")
    table = commands.add_parser("table", help="answer by all baselines and print their scores")
    table.add_argument("--answers", type=Path, default=Path("runs/fccb/answers"))
    for command in (make, own, published, answer, scored, table):
        command.add_argument("set", type=Path, help="folder of the set")
    own.add_argument("frames", nargs="+", metavar="CAMERA=FRAME")
    published.add_argument("dataset", choices=DATASETS)
    published.add_argument("folder", type=Path, help="its folder, as it is unpacked")
    answer.add_argument("answers", type=Path, help="folder of the answers")
    scored.add_argument("answers", type=Path, nargs="+", help="folders of answers, one for each method")
    return parser


def _print_table(cases: CaseSet, answers: Sequence[Path]) -> None:
    """Print a row per method and task, the best method first."""
    try:
        scores = {folder.name: score(cases, folder) for folder in answers}
    except AnswersError as error:
        raise SystemExit(str(error)) from error
    print(table_head(f"method | task | {COLUMNS}"))
    for name in sorted(scores, key=lambda name: -overall(scores[name])):
        print(f"| {name} | all | {overall(scores[name]):.0f} | | | | | |")
        for task, of_task in scores[name].items():
            print(f"| | {task} | {of_task.row()} |")


if __name__ == "__main__":
    sys.exit(main())
