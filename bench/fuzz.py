# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench fuzz [KIND ...]`: files that are broken at random, read as a fit reads them.

Kinds: photos, masks, textures, grids, checkpoints, reconstructions. Small valid files of each kind
are made, mutated (bits, bytes, numbers, pieces left out, doubled or taken from another file;
checksums of PNG mended every other time) and read in a process of its own, with the native modules
built with the address and undefined-behaviour sanitizers, and with 1 GiB of memory. A case is read,
refused (a message for the user), or crashed: any other exception, a report of a sanitizer, too much
memory, or no end within a minute. The table tells the most memory that a kind took. Files that
crash are kept in build/fuzz-cases. Status 1 if there are any.

The state of a native fit is read by `_core`. It is built with sanitizers only with `--core`, which
takes long; without, the released one reads it.
"""

from __future__ import annotations

import argparse
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "bench")]

from fuzzing import seeds  # noqa: E402

BUILD = ROOT / "build" / "fuzz"
CASES = ROOT / "build" / "fuzz-cases"
MOST_MEGABYTES = 1024
#: Seconds for one case; the slowest valid ones take a few hundredths.
LONGEST = 60.0


def built(with_core: bool) -> list[Path]:
    """The modules with sanitizers, built where they are not."""
    targets = ["_image", "_core"] if with_core else ["_image"]
    if not (BUILD / "build.ninja").is_file():
        subprocess.check_call(["cmake", "--preset", "fuzz"], cwd=ROOT)
    subprocess.check_call(["cmake", "--build", "--preset", "fuzz", "--target", *targets], cwd=ROOT)
    return [next(BUILD.glob(f"{name}.*.so")) for name in targets]


def environment() -> dict[str, str]:
    """Of a child: Python is no sanitized program, so the library comes first. It looks for what it
    replaces when it is loaded: C++ exceptions have to be there by then."""
    libraries = [
        subprocess.check_output(["g++", f"-print-file-name={name}"], text=True).strip()
        for name in ("libasan.so", "libstdc++.so.6")
    ]
    options = {
        "detect_leaks": 0,  # Python's own
        "hard_rss_limit_mb": MOST_MEGABYTES,
        "max_allocation_size_mb": MOST_MEGABYTES,
        "quarantine_size_mb": 16,
        "abort_on_error": 0,
    }
    return os.environ | {
        "LD_PRELOAD": " ".join(libraries),
        "ASAN_OPTIONS": ":".join(f"{key}={value}" for key, value in options.items()),
        "UBSAN_OPTIONS": "print_stacktrace=1:halt_on_error=1",
        "OPENBLAS_NUM_THREADS": "1",
    }


class Tally:
    """What became of the cases of one kind; children count in `progress`: case, read, refused."""

    def __init__(self, kind: str) -> None:
        self.kind = kind
        self.folder = CASES / kind
        shutil.rmtree(self.folder, ignore_errors=True)
        (self.folder / "seeds").mkdir(parents=True)
        seeds.make(kind, self.folder / "seeds")
        self.read = self.refused = self.crashed = 0
        self.most_megabytes = 0
        self.next = 0

    def progress(self) -> tuple[int, int, int]:
        try:
            case, read, refused = (self.folder / "progress").read_text().split()
        except (OSError, ValueError):
            return self.next, 0, 0
        return int(case), int(read), int(refused)

    def line(self) -> str:
        total = self.read + self.refused + self.crashed
        return (
            f"{self.kind:<12} {total:>8} cases: {self.read} read, {self.refused} refused, "
            f"{self.crashed} crashed, at most {self.most_megabytes} MiB"
        )


def child(tally: Tally, modules: list[Path], until: float) -> None:
    """Runs cases until the time is over or one crashes."""
    (tally.folder / "progress").unlink(missing_ok=True)
    command = [sys.executable, str(ROOT / "bench" / "fuzzing" / "child.py"), tally.kind]
    command += [str(tally.folder), str(tally.next), str(max(0.0, until - time.time()))]
    command += [str(path) for path in modules]
    log = tally.folder / "log.txt"
    with log.open("w") as output:
        process = subprocess.Popen(
            command, env=environment(), stdout=output, stderr=output, start_new_session=True
        )
        last, since = tally.progress()[0], time.time()
        while process.poll() is None:
            tally.most_megabytes = max(tally.most_megabytes, _peak(process.pid))
            time.sleep(0.2)
            case = tally.progress()[0]
            if case != last:
                last, since = case, time.time()
            elif time.time() - since > LONGEST:
                output.write(f"no end after {LONGEST:.0f} s\n")
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
    case, read, refused = tally.progress()
    tally.read += read
    tally.refused += refused
    tally.next = case + 1
    if process.returncode != 0:
        tally.crashed += 1
        kept = tally.folder / f"crash_{case}"
        shutil.copytree(tally.folder / "case", kept, dirs_exist_ok=True)
        shutil.copy2(log, kept / "log.txt")
        print(f"{tally.kind}: case {case} crashed: {_cause(log)}", flush=True)


def _peak(process: int) -> int:
    """Most memory that a process has held so far, in MiB; 0 once it is gone."""
    try:
        status = Path(f"/proc/{process}/status").read_text()
    except OSError:
        return 0
    return sum(int(line.split()[1]) for line in status.splitlines() if "VmHWM" in line) // 1024


def _cause(log: Path) -> str:
    """The line of a sanitizer's report that says what happened, or the last."""
    lines = log.read_text(errors="replace").strip().splitlines() or ["nothing was printed"]
    found = [line for line in lines if "ERROR:" in line or "runtime error:" in line]
    return (found or lines[-1:])[0]


def main() -> int:
    parser = argparse.ArgumentParser(prog="./dev bench fuzz", description=__doc__.split("\n")[0])
    parser.add_argument("kinds", nargs="*", metavar="KIND", help=", ".join(seeds.KINDS))
    parser.add_argument("--minutes", type=float, default=10, help="for each kind (%(default)s)")
    parser.add_argument("--core", action="store_true", help="builds _core with sanitizers too")
    options = parser.parse_args()
    unknown = [kind for kind in options.kinds if kind not in seeds.KINDS]
    if unknown:
        parser.error(f"no kind {unknown[0]!r}; give some of {', '.join(seeds.KINDS)}")
    modules = built(options.core)
    tallies = []
    for kind in options.kinds or seeds.KINDS:
        tally = Tally(kind)
        tallies.append(tally)
        until = time.time() + 60 * options.minutes
        while time.time() < until:
            child(tally, modules, until)
        print(tally.line(), flush=True)
    return 1 if any(tally.crashed for tally in tallies) else 0


if __name__ == "__main__":
    sys.exit(main())
