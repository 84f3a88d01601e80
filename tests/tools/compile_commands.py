#!/usr/bin/env python3
"""Prints compile_commands.json of a build folder, with an entry for each source of the project.

Usage: compile_commands.py BUILD_FOLDER

Where sources are compiled several at a time (CMAKE_UNITY_BUILD), CMake's own file names what it has
generated; each source that such a file includes gets its command.
"""

import json
import pathlib
import re
import sys

INCLUDED = re.compile(r'^#include "(.+\.cc)"$', re.MULTILINE)


def commands_of_sources(build):
    """The entries, each source once."""
    entries = {}
    for entry in json.loads((build / "compile_commands.json").read_text()):
        path = pathlib.Path(entry["file"])
        if path.parent.name != "Unity":
            entries.setdefault(entry["file"], entry)
            continue
        for source in INCLUDED.findall(path.read_text()):
            command = entry["command"].removesuffix(f" -c {path}") + f" -c {source}"
            entries.setdefault(source, {**entry, "file": source, "command": command})
    return list(entries.values())


if __name__ == "__main__":
    json.dump(commands_of_sources(pathlib.Path(sys.argv[1])), sys.stdout, indent=1)
