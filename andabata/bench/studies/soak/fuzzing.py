"""Coverage-guided fuzzing of readers by atheris, each in a process of its own for a bounded time.

``python -m andabata.bench.studies.soak.fuzzing READER SECONDS FOLDER`` fuzzes one reader: it begins
with good files, and keeps the input that ended in a foreign error, a hang or a lost process.
"""

import random
import re
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from types import FunctionType

from andabata.bench.studies.soak.archives import with_changed_entry
from andabata.bench.studies.soak.outcome import Outcome, Tally, not_run
from andabata.bench.studies.soak.readers import READERS, Reader, name_of_file
from andabata.distribution import install_extra

_LONGEST = 20
"""Time after which reading an input counts as hanging [s]."""

_MEMORY_MB = 4096
"""Memory above which a reader has failed [MB]."""

_INPUTS = ("crash-", "timeout-", "oom-", "leak-")
"""First words of the names of inputs that failed, as libFuzzer writes them."""

_UNCAUGHT = "Uncaught Python exception"
"""Heading of an exception in the output of atheris."""

_TRIES = re.compile(r"stat::number_of_executed_units:\s*(\d+)")

NO_ATHERIS = f"atheris is not installed (`{install_extra('fuzz')}`)"


def fuzzed_readers_raise_named_errors(count: int, folder: Path) -> Outcome:
    """Check that readers, fuzzed for a time, raise none but their named errors, and end.

    Args:
        count: Time of all readers together [s].
        folder: Folder for their files; inputs that failed are kept beside it.
    """
    if find_spec("atheris") is None:
        return not_run(NO_ATHERIS)
    tally, seconds = Tally(), max(1, count // len(READERS))
    for name in READERS:
        place = folder / name.replace(" ", "-")
        place.mkdir()
        words = [sys.executable, "-m", __name__, name, str(seconds), str(place)]
        done = subprocess.run(words, capture_output=True, text=True, errors="replace", check=False)
        tries, reason = _TRIES.search(done.stderr), _reason(done.stdout + done.stderr)
        tally.trials += int(tries[1]) if tries else 0
        kept = [each for each in place.iterdir() if each.name.startswith(_INPUTS)]
        for each in kept:
            inputs = folder.parent / "inputs"
            inputs.mkdir(exist_ok=True)
            tally.fail(f"{name}: {reason}; input {each.rename(inputs / each.name)}")
        if done.returncode and not kept:
            tally.fail(f"{name}: ended with {done.returncode}: {reason}")
    return tally.outcome(f"{tally.trials:,} inputs, {seconds} s each of {len(READERS)} readers")


def _reason(text: str) -> str:
    """Return the line of a fuzzer's output that names what happened."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    # The line after the heading of an exception names it; libFuzzer's own line comes without one.
    headings = [k for k, line in enumerate(lines[:-1]) if _UNCAUGHT in line]
    named = [lines[k + 1] for k in headings] or [line for line in lines if "ERROR:" in line]
    return (named or lines[-1:] or ["no output"])[0][:200]


def fuzz(reader: Reader, seconds: int, folder: Path) -> None:
    """Fuzz a reader in this process, which ends with it.

    Args:
        reader: Reader.
        seconds: Time of the fuzzing [s].
        folder: Folder for the inputs.
    """
    import atheris

    seeds, corpus = reader.seeds(), folder / "corpus"
    corpus.mkdir()
    for number, seed in enumerate(seeds):
        (corpus / f"seed-{number}").write_bytes(seed)
    path = folder / name_of_file(reader)

    def read(data: bytes) -> None:
        path.write_bytes(data)
        with suppress(OSError, *reader.errors()):
            reader.read(path)

    # An archive whose entry is changed is stored, which is larger than packed.
    longest = (16 if reader.suffix == ".npz" else 2) * max(map(len, seeds))
    words = [
        "fuzz",
        str(corpus),
        f"-max_total_time={seconds}",
        f"-timeout={_LONGEST}",
        f"-rss_limit_mb={_MEMORY_MB}",
        f"-max_len={longest}",
        f"-artifact_prefix={folder}/",
        "-print_final_stats=1",
    ]
    more = {"custom_mutator": _change_an_entry} if reader.suffix == ".npz" else {}
    atheris.Setup(words, read, **more)
    atheris.Fuzz()


def _change_an_entry(data: bytes, longest: int, seed: int) -> bytes:
    """Return an archive that is changed in an entry, or as any bytes."""
    import atheris

    pick = random.Random(seed)
    if pick.random() < 0.8:
        changed = with_changed_entry(
            data, pick.randrange, lambda entry: bytes(atheris.Mutate(entry, len(entry) + 64))
        )
        if len(changed) <= longest:
            return changed
    return bytes(atheris.Mutate(data, longest))


def trace(prefixes: Sequence[str]) -> int:
    """Let the branches of all functions in loaded modules be counted; return their number.

    Compiled functions are no functions of Python, and stay as they are.

    Args:
        prefixes: Names of modules, and of packages with all that is in them.
    """
    import atheris

    traced = 0
    for name, module in list(sys.modules.items()):
        if any(name == prefix or name.startswith(f"{prefix}.") for prefix in prefixes):
            for function in _functions(module, name):
                atheris.instrument_func(function)
                traced += 1
    return traced


def _functions(owner: object, module: str) -> Iterator[FunctionType]:
    """Yield the functions of a module and of its classes that are written there."""
    for each in list(vars(owner).values()):
        function = getattr(each, "__func__", getattr(each, "fget", each))
        if isinstance(function, FunctionType) and function.__module__ == module:
            yield function
        elif isinstance(each, type) and each.__module__ == module and each is not owner:
            yield from _functions(each, module)


def main(name: str, seconds: str, folder: str) -> None:
    """Fuzz a reader; reading a good file first imports what is to be traced."""
    reader, path = READERS[name], Path(folder) / name_of_file(READERS[name])
    for seed in reader.seeds():
        path.write_bytes(seed)
        reader.read(path)
    trace(reader.traced)
    fuzz(reader, int(seconds), Path(folder))


if __name__ == "__main__":
    main(*sys.argv[1:])
