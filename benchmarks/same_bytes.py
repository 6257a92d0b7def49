"""One recipe, run in other circumstances, and which files of the kit have other bytes.

    python benchmarks/same_bytes.py [--quick] [MODEL]

Exports MODEL (``sample:car`` unless one is given) with ``--effort quick``, and once more in each
circumstance, and compares the digests of all files, those of the stages too. ``--quick`` changes
everything at once that may not matter, in two runs of a small model side by side, and leaves the
processor alone.
Ends with 1 where bytes differ. Without ``--quick`` writes benchmarks/same_bytes.md.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import trimesh
from runs import digests

HERE = Path(__file__).resolve().parent
#: What may not matter: name, environment, workers, whether the folder is another.
CIRCUMSTANCES: tuple[tuple[str, dict[str, str], int, bool], ...] = (
    ("again", {}, 2, False),
    ("one worker", {}, 1, False),
    ("in another folder, from another one", {}, 2, True),
    ("another locale", {"LC_ALL": "C", "LANG": "C"}, 2, False),
    ("another time zone", {"TZ": "Pacific/Kiritimati"}, 2, False),
    ("another hash seed", {"PYTHONHASHSEED": "12345"}, 2, False),
    (
        "one thread for BLAS and OpenMP",
        dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1"),
        2,
        False,
    ),
)
#: Other processors, as far as libraries let them be chosen.
PROCESSORS: tuple[tuple[str, dict[str, str], int, bool], ...] = (
    (
        "kernels compiled for a processor without AVX and FMA",
        {"NUMBA_CPU_NAME": "x86-64"},
        2,
        False,
    ),
    (
        "NumPy without AVX2, FMA and AVX-512",
        {"NPY_DISABLE_CPU_FEATURES": "AVX2 FMA3 AVX512F AVX512CD AVX512_SKX"},
        2,
        False,
    ),
    ("BLAS for a processor without AVX", {"OPENBLAS_CORETYPE": "Nehalem"}, 2, False),
    (
        "the C library without AVX2 and FMA (sine, cosine)",
        {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-AVX2_Usable,-FMA_Usable,-AVX512F"},
        2,
        False,
    ),
)


def start(
    model: str,
    folder: Path,
    environment: dict[str, str],
    workers: int,
    elsewhere: bool,
    more: tuple[str, ...] = (),
) -> tuple[Path, subprocess.Popen[bytes]]:
    """Begin an export; the kit's folder has one name, wherever it lies."""
    kit = folder / ("deeper/still" if elsewhere else "") / "kit"
    kit.parent.mkdir(parents=True, exist_ok=True)
    variables = {**os.environ, **environment}
    if "NUMBA_CPU_NAME" in environment:
        variables["NUMBA_CACHE_DIR"] = str(folder / "kernels")
    run = subprocess.Popen(
        [
            *(sys.executable, "-m", "fabfold", "export", model, "-o", str(kit)),
            *("-j", str(workers), "--effort", "quick", "-q", *more),
        ],
        cwd=kit.parent if elsewhere else None,
        env=variables,
    )
    return kit, run


def differing(one: dict[str, str], other: dict[str, str]) -> list[str]:
    return sorted(name for name in {*one, *other} if one.get(name) != other.get(name))


def main() -> int:
    quick = "--quick" in sys.argv
    given = [arg for arg in sys.argv[1:] if not arg.startswith("-")]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        model, more = (given[0] if given else "sample:car"), ()
        if quick and not given:
            model, more = str(folder / "bar.stl"), ("-t", "box-2x2x2")
            trimesh.creation.box((80.0, 9.6, 9.6)).export(model)
        if quick:
            every = {key: value for _, more, _, _ in CIRCUMSTANCES for key, value in more.items()}
            runs = [
                start(model, folder / "1", {}, 2, False, more),
                start(model, folder / "2", every, 1, True, more),
            ]
            codes = [run.wait() for _, run in runs]
            one, other = (digests(kit) for kit, _ in runs)
            found = differing(one, other)
            print(f"{len(one)} files of two runs: {', '.join(found) or 'the same bytes in each'}")
            return 1 if any(codes) or found or not one else 0
        kit, run = start(model, folder / "first", {}, 2, False)
        run.wait()
        want = digests(kit)
        rows = []
        for number, (label, environment, workers, elsewhere) in enumerate(
            CIRCUMSTANCES + PROCESSORS
        ):
            kit, run = start(model, folder / str(number), environment, workers, elsewhere)
            code = run.wait()
            found = differing(want, digests(kit))
            text = f"exit code {code}" if code else ", ".join(found[:6]) or "none"
            rows.append(f"| {label} | {len(found)} | {text} |")
            print(rows[-1], flush=True)
    lines = [
        "# The same recipe in other circumstances",
        "",
        f"Written by `python benchmarks/same_bytes.py`: `{model}`, `--effort quick`,",
        f"{len(want)} files, each compared with the first run by SHA-256.",
        "",
        "| circumstance | files that differ | which |",
        "|---|--:|---|",
        *rows,
    ]
    (HERE / "same_bytes.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
