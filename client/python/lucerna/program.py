"""What the program `lucerna` does for this package: it reads scenes.

Only a reader of scenes can tell which files one names. There is one for each of three formats, in the
program, and none here.
"""

import difflib
import functools
import json
import os
import re
import subprocess
from collections.abc import Mapping, Sequence
from typing import Any

from lucerna.errors import Error, UnreachableError, UsageError, printable

# A value of a setting: what its flag takes, or True for a flag without one.
Value = str | int | float | bool
StrPath = str | os.PathLike[str]

_EXIT_USAGE = 2
_EXIT_UNREACHABLE = 3
# What command lines get beside the sentence.
_HINT = "Run with --help for more information."


def run(program: StrPath, words: Sequence[str], token: str | None = None) -> str:
    """Runs `lucerna WORDS`; returns its standard output. The user's file of flags is not read: what
    a script does depends on its arguments. Errors: Error, UsageError, UnreachableError with the
    program's message."""
    environment = dict(os.environ)
    if token is not None:
        # Not among the arguments, which other users of the machine can see.
        environment["LUCERNA_TOKEN"] = token
    try:
        done = subprocess.run([program, "--config", os.devnull, *words], env=environment,
                              stdin=subprocess.DEVNULL, capture_output=True, check=False)
    except OSError as error:
        raise Error(f"the program {os.fspath(program)} cannot be run ({error.strerror}); give "
                    "program=, or put it into PATH") from None
    if done.returncode == 0:
        return done.stdout.decode("utf-8", "replace")
    said = done.stderr.decode("utf-8", "replace")
    lines = [line.removeprefix("lucerna: ") for line in said.splitlines() if line != _HINT]
    message = printable("\n".join(lines).strip(), keeps="\n")
    if done.returncode == _EXIT_USAGE:
        raise UsageError(message)
    if done.returncode == _EXIT_UNREACHABLE:
        raise UnreachableError(message)
    raise Error(message or f"lucerna ended with exit code {done.returncode}")


@functools.cache
def _settings(program: str) -> dict[str, bool]:
    """Whether a setting takes a value, by its name."""
    table = run(program, ["help", "settings"])
    return {name.replace("-", "_"): end == " "
            for name, end in re.findall(r"^\| `--([a-z-]+)([ `])", table, re.MULTILINE)}


def text_of(value: Value) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def flags(program: StrPath, settings: Mapping[str, Value]) -> list[str]:
    """Errors: UsageError for a name that is no setting, and for False, which no flag can say."""
    words = []
    for name, value in settings.items():
        takes_value = _settings(os.fspath(program))
        if name not in takes_value:
            near = difflib.get_close_matches(name, takes_value, n=1)
            proposal = f"; did you mean {near[0]}?" if near else ""
            raise UsageError(f"there is no setting {name}{proposal} (lucerna help settings lists "
                             "them)")
        word = f"--{name.replace('_', '-')}"
        if takes_value[name]:
            word += f"={text_of(value)}"
        elif value is not True:
            raise UsageError(f"{name} is given as True or left away, not {value}")
        words.append(word)
    return words


def compare(scene: StrPath, reference: StrPath, settings: Mapping[str, Mapping[str, Value]] | None =
            None, *, times: Sequence[float] | None = None, repetitions: int | None = None,
            program: StrPath = "lucerna", **common: Value) -> dict[str, Any]:
    """Which settings are ahead after equal time? Renders the scene on this machine with each of
    `settings`, given by a name of your choice, and returns what `lucerna compare --json --full`
    prints.

    reference: an EXR file, best of `lucerna reference`. times: processor seconds over cores, growing.
    common: settings of all. Without `settings` every radius controller is tried.
    """
    words = ["compare", os.path.abspath(scene), "--reference", os.path.abspath(reference), "--json",
             "--full", "--quiet", *flags(program, common)]
    for name, one in (settings or {}).items():
        if any(set(text_of(value)) & set(" \t\r\n\"'") for value in one.values()):
            raise UsageError(f"setting \"{name}\": a value holds a space or a quotation mark")
        words += ["--settings", f"{name}: {' '.join(flags(program, one))}"]
    if times is not None:
        words += ["--times", ",".join(f"{float(time):.9g}" for time in times)]
    if repetitions is not None:
        words += ["--repetitions", str(repetitions)]
    return json.loads(run(program, words))
