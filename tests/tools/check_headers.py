#!/usr/bin/env python3
"""Does every header begin with #pragma once, and compile alone?

Usage: check_headers.py BUILD_FOLDER [--all]  (the folder holds compile_commands.json)

A header that needs what its includer happens to have included breaks at the next reordering. Most
headers prove it without a compiler run of their own: the first include of NAME.cc must be NAME.h, so
the build compiles the header first, as it does those that a test or another source includes first. All
others are compiled one by one (syntax only), with the flags of a source file of their folder. Where the build includes a precompiled header before, or compiles
several sources at a time (CMAKE_UNITY_BUILD), the order of includes proves less: --all compiles
those headers too, which takes some 150 s of processor time.
"""

import concurrent.futures
import os
import pathlib
import re
import shlex
import subprocess
import sys

from compile_commands import commands_of_sources

ROOT = pathlib.Path(__file__).resolve().parents[2]
FOLDERS = ("render", "server", "worker", "client", "tests")
INCLUDE = re.compile(r'^\s*#\s*include\s*["<]([^">]+)', re.MULTILINE)
PRECOMPILED = re.compile(r"cmake_pch\.hxx$")


def commands_by_source(build):
    """Source file, relative to the project -> its compiler flags as words."""
    commands = {}
    for entry in commands_of_sources(build):
        path = pathlib.Path(entry["file"])
        if path.is_relative_to(ROOT):
            commands[path.relative_to(ROOT).as_posix()] = shlex.split(entry["command"])
    return commands


def syntax_only(command):
    """The command without output, source, optimisation, precompiled header and compiler launcher."""
    first = next(i for i, word in enumerate(command) if re.search(r"(\+\+|g\+\+|clang)[-\d.]*$", word))
    words = []
    skip = 0
    for word, after in zip(command[first:], command[first + 1:] + [""]):
        if skip:
            skip -= 1
        elif word in ("-o", "-c") or (word == "-include" and PRECOMPILED.search(after)):
            skip = 1
        elif not re.match(r"-O\d|-g\d?$|-Winvalid-pch|-fpch-preprocess", word):
            words.append(word)
    return words + ["-O0", "-w", "-fsyntax-only"]


def compiles(header, command):
    done = subprocess.run(command + ["-x", "c++", "-"], input=f'#include "{header}"\n', text=True,
                          capture_output=True, cwd=ROOT, check=False)
    return done.returncode == 0, done.stderr


def flags_for(header, commands):
    """The flags of NAME.cc, else of a source in the same folder, else of one that includes it."""
    own = header.removesuffix(".h") + ".cc"
    if own in commands:
        return commands[own]
    folder = header.rsplit("/", 1)[0] + "/"
    near = [source for source in commands if source.startswith(folder)]
    return commands[sorted(near)[0]] if near else None


def main():
    build = pathlib.Path(sys.argv[1])
    all_headers = "--all" in sys.argv[2:]
    commands = commands_by_source(build)
    first_includes = {}
    for source in commands:
        first = INCLUDE.search((ROOT / source).read_text())
        first_includes[source] = first.group(1) if first else None
    proved = set(first_includes.values())
    faults = []
    alone = []
    headers = sorted(path.relative_to(ROOT).as_posix()
                     for folder in FOLDERS for path in (ROOT / folder).rglob("*.h"))
    for header in headers:
        if not re.search(r"^#pragma once$", (ROOT / header).read_text(), re.MULTILINE):
            faults.append(f"{header}: no #pragma once")
        own = header.removesuffix(".h") + ".cc"
        if header.endswith("_inl.h"):
            continue  # the end of another header, and included by it alone
        if own not in commands:
            if all_headers or header not in proved:
                alone.append(header)
            continue
        if first_includes[own] != header:
            faults.append(f"{own}: its first include must be {header}")
        if all_headers and any(PRECOMPILED.search(word) for word in commands[own]):
            alone.append(header)

    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        runs = {}
        for header in alone:
            flags = flags_for(header, commands)
            if flags is None:
                faults.append(f"{header}: no source near it tells its compiler flags")
            else:
                runs[header] = pool.submit(compiles, header, syntax_only(flags))
        for header, run in runs.items():
            fine, errors = run.result()
            if not fine:
                faults.append(f"{header}: does not compile alone:\n{errors}")
    for fault in faults:
        print(fault)
    print(f"{len(headers)} headers, {len(runs)} of them compiled alone")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
