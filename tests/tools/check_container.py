#!/usr/bin/env python3
"""Does deploy/container/Containerfile fit the project, and the manifests that use its image?

  check_container.py ROOT

Reads the file alone: no network, no podman. try_container.sh builds the image and renders in it.
"""
import fnmatch
import pathlib
import re
import sys

PROBLEMS = []


def check(holds, problem):
    if not holds:
        PROBLEMS.append(problem)


def instructions(text):
    """(name, arguments) of each, with continued lines joined and comments left out."""
    lines = [line for line in text.splitlines() if not line.lstrip().startswith("#")]
    joined = re.sub(r"\\\n", " ", "\n".join(lines))
    return [tuple(line.split(None, 1)) for line in joined.splitlines() if line.strip()]


def is_ignored(path, patterns):
    """The last pattern that matches the path, or a folder above it, decides."""
    ignored = False
    parts = path.split("/")
    prefixes = ["/".join(parts[:count + 1]) for count in range(len(parts))]
    for pattern in patterns:
        wanted = pattern.lstrip("!")
        if any(prefix.count("/") == wanted.count("/") and fnmatch.fnmatchcase(prefix, wanted)
               for prefix in prefixes):
            ignored = not pattern.startswith("!")
    return ignored


def main():
    root = pathlib.Path(sys.argv[1])
    text = (root / "deploy/container/Containerfile").read_text(encoding="utf-8")
    version = re.search(r"project\(lucerna VERSION (\S+)",
                        (root / "CMakeLists.txt").read_text(encoding="utf-8")).group(1)
    stages = []
    for name, arguments in instructions(text):
        if name == "FROM":
            stages.append([])
        elif stages:
            stages[-1].append((name, arguments))
    check(len(stages) == 2, "there are not two stages: package and image")
    package, image = (dict(stage) for stage in (stages[0], stages[-1]))

    run = package.get("RUN", "")
    for script in re.findall(r"bash (\S+\.sh)", run):
        check((root / script).is_file(), f"{script} does not exist")
    built = set(re.search(r"--target ([\w -]+);", run).group(1).split())
    installed = re.search(r"install\(TARGETS ([\w -]+) RUNTIME\)",
                          (root / "CMakeLists.txt").read_text(encoding="utf-8")).group(1).split()
    check(built == set(installed), f"it builds {built}, and the package has {installed}")
    preset = re.search(r"--preset (\w+)", run).group(1)
    check(f'"name": "{preset}"' in (root / "CMakePresets.json").read_text(encoding="utf-8"),
          f"there is no preset {preset}")

    user = image.get("USER", "0")
    check(re.fullmatch(r"[1-9]\d*:[1-9]\d*", user) is not None,
          "the programs do not run as a user and a group with numbers other than 0")
    check(f"chown {user} {image.get('WORKDIR')}" in image.get("RUN", ""),
          "the working folder does not belong to the user")
    check(f'["{installed[0]}"' in image.get("CMD", ""), "the command is not the client")
    check("/var/lib/apt/lists" in image.get("RUN", ""), "the lists of packages stay in the image")

    patterns = (root / ".containerignore").read_text(encoding="utf-8").split()
    check(not is_ignored(f"build/{preset}/lucerna_{version}_amd64.deb", patterns),
          "a ready package does not get into the context")
    check(not is_ignored("render/base/status.h", patterns), "sources do not get into the context")
    for left_out in (".git/HEAD", "build/release/bin/lucerna", "build/asan/CMakeCache.txt"):
        check(is_ignored(left_out, patterns), f"{left_out} gets into the context")

    tag = f"lucerna:{version}"
    users = [root / "deploy/container/Containerfile", root / "docs/deploy.md",
             *(root / "deploy/kubernetes").glob("*.yaml")]
    for path in users:
        for found in re.findall(r"\blucerna:(\d[\w.]*)", path.read_text(encoding="utf-8")):
            check(found == version, f"{path.name}: lucerna:{found}, and this is {tag}")
        for found in re.findall(r"lucerna_(\d[\d.]*)_amd64", path.read_text(encoding="utf-8")):
            check(found == version, f"{path.name}: lucerna_{found}, and this is {version}")
    check(tag in users[0].read_text(encoding="utf-8"), f"the Containerfile does not name {tag}")

    for problem in PROBLEMS:
        print(problem)
    return 1 if PROBLEMS else 0


if __name__ == "__main__":
    sys.exit(main())
