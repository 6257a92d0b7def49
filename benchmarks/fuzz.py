"""Every reader on files that a fuzzer grows: coverage-guided by atheris, for a time or a number.

    python benchmarks/fuzz.py [SECONDS | --same] [READER ...]

With ``--same`` each reader gets a fixed number of files, the same ones in every run on a system
that can start a process at the same addresses: what has passed passes again. With seconds, files
are as many as there is time for.

A reader may raise an error of ours, with a sentence of one line, or read the file. Anything else is
a finding: another exception, 10 s without an answer, over 2 GB of memory, the end of the process.
Findings are written to the folder ``fuzz-findings`` and end the command with exit code 1. Readers
share the time; as many are fuzzed at once as there are cores. Writes benchmarks/fuzz.md where it
has 600 s or more.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import os
import re
import subprocess
import sys
import tempfile
import traceback
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path

HERE = Path(__file__).resolve().parent
FINDINGS = Path("fuzz-findings")
sys.path[:0] = [str(HERE.parent / "tests"), str(HERE.parent)]


def fuzz_one(name: str, limit: str, corpus: Path) -> None:
    """Fuzz one reader in this process, which libFuzzer ends at an option of its own, `limit`."""
    import logging
    import warnings

    import atheris

    # Only those two readers go on into trimesh, which takes long to instrument.
    libraries = ["trimesh"] if name.startswith(("GLB", "PLY")) else []
    with atheris.instrument_imports(include=["fabfold", "tomllib", *libraries]):
        import trimesh.exchange.gltf  # noqa: F401
        from fuzz_readers import READERS

        from fabfold.errors import FabfoldError
        from fabfold.solid import read_binary, read_step, read_stl, read_text  # noqa: F401
    logging.disable(logging.CRITICAL)
    warnings.simplefilter("ignore")
    reader = READERS[name]
    folder = Path(tempfile.mkdtemp(dir="/dev/shm" if Path("/dev/shm").is_dir() else None))
    FINDINGS.mkdir(exist_ok=True)
    findings = FINDINGS.resolve()
    # The name of the folder is another one in each run, and the fuzzer learns from what it reads.
    os.chdir(folder)
    path = Path(reader.file)
    path.parent.mkdir(exist_ok=True)
    for number, seed in enumerate(reader.seeds):
        (corpus / f"seed-{number}").write_bytes(seed)
    known: set[str] = set()

    def run(data: bytes) -> None:
        path.write_bytes(reader.wrap(data))
        try:
            with contextlib.redirect_stdout(io.StringIO()):
                reader.read(path)
        except FabfoldError as error:
            text = str(error)
            if "that cannot be told" in text:
                cause = traceback.extract_tb(error.__cause__.__traceback__)
                ours = [f for f in cause if "/fabfold/" in f.filename]
                at = f"{Path(ours[-1].filename).name}:{ours[-1].lineno}"
                finding(data, f"no reader's sentence at {at}: {text}")
            elif "\n" in text.strip() and reader.file.startswith("x."):
                finding(data, f"a message of several lines: {text!r}")
        except Exception as error:
            frames = traceback.extract_tb(error.__traceback__)
            ours = [f for f in frames if "/fabfold/" in f.filename] or frames
            at = f"{Path(ours[-1].filename).name}:{ours[-1].lineno}"
            finding(data, f"{type(error).__name__} at {at}: {str(error)[:120]}")

    def finding(data: bytes, what: str) -> None:
        key = what.split(": ", maxsplit=1)[0]
        if key in known:
            return
        known.add(key)
        digest = hashlib.sha256(data).hexdigest()[:12]
        (findings / f"{digest}-{Path(reader.file).name}").write_bytes(reader.wrap(data))
        print(f"FINDING {name}: {what} ({digest})", file=sys.stderr, flush=True)

    words = corpus.parent / "words.txt"
    words.write_text("".join(f'"{_escaped(word)}"\n' for word in (*reader.words, "0", "-1")))
    options = [
        limit,
        "-timeout=10",
        "-rss_limit_mb=2048",
        "-max_len=4096",
        "-print_final_stats=1",
        "-seed=1",
        f"-artifact_prefix={findings}/",
        f"-dict={words}",
        str(corpus),
    ]
    atheris.Setup([sys.argv[0], *options], run)
    atheris.Fuzz()


def _escaped(word: str) -> str:
    return word.replace("\\", "\\\\").replace('"', '\\"')


def _number(pattern: str, text: str) -> int:
    found = re.findall(pattern, text)
    return int(found[-1]) if found else 0


@cache
def _still() -> tuple[str, ...]:
    """What starts a process at the same addresses each time, which the fuzzer learns from too."""
    start = ("setarch", "-R")
    try:
        tried = subprocess.run([*start, "true"], capture_output=True, check=False)
    except FileNotFoundError:
        return ()
    return start if tried.returncode == 0 else ()


def _fuzzed(name: str, limit: str) -> tuple[str, list[str]]:
    """Fuzz a reader in a process of its own; its row of the table, and what was found."""
    with tempfile.TemporaryDirectory() as folder:
        corpus = Path(folder) / "corpus"
        corpus.mkdir()
        done = subprocess.run(
            [*_still(), sys.executable, __file__, "--one", name, limit, str(corpus)],
            env=os.environ | {"PYTHONHASHSEED": "0"},
            capture_output=True,
            text=True,
            errors="replace",
            check=False,
        )
    text = done.stderr
    runs = _number(r"stat::number_of_executed_units:\s*(\d+)", text)
    slowest = _number(r"stat::slowest_unit_time_sec:\s*(\d+)", text)
    memory = _number(r"stat::peak_rss_mb:\s*(\d+)", text)
    paths = _number(r"cov: (\d+)", text)
    found = [line[8:] for line in text.splitlines() if line.startswith("FINDING ")]
    if done.returncode:
        found.append(f"{name}: ended with {done.returncode}: {text.strip()[-400:]}")
    row = f"| {name} | {runs:,} | {paths:,} | {slowest} | {memory:,} | {len(found)} |"
    print(row, *found, sep="\n", flush=True)
    return row, found


def main() -> int:
    from fuzz_readers import READERS

    same = sys.argv[1:2] == ["--same"]
    seconds = int(sys.argv[1]) if len(sys.argv) > 1 and not same else 1800
    names = sys.argv[2:] or list(READERS)
    share = max(2, seconds // len(names))

    def limit(name: str) -> str:
        return f"-runs={READERS[name].files}" if same else f"-max_total_time={share}"

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        done = list(pool.map(lambda name: _fuzzed(name, limit(name)), names))
    rows = [row for row, _ in done]
    faults = [fault for _, found in done for fault in found]
    lines = [
        "# Readers on files that a fuzzer grew",
        "",
        f"Written by `python benchmarks/fuzz.py {seconds}`: atheris (libFuzzer), {share} s a",
        "reader, from small files of each kind. A finding is anything but a result or an error of",
        "ours.",
        "",
        "| reader | files | places reached | slowest, s | memory, MB | findings |",
        "|---|--:|--:|--:|--:|--:|",
        *rows,
    ]
    if not same and seconds >= 600 and len(names) == len(READERS):
        (HERE / "fuzz.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
    if not any(FINDINGS.glob("*")) and FINDINGS.is_dir():
        FINDINGS.rmdir()
    return 1 if faults else 0


if __name__ == "__main__":
    if sys.argv[1:2] == ["--one"]:
        fuzz_one(sys.argv[2], sys.argv[3], Path(sys.argv[4]))
    else:
        sys.exit(main())
