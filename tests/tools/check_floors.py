#!/usr/bin/env python3
"""Does any include climb?

The floors are a line: an include names its own floor or a lower one, and the three programs never
include each other. Some libraries and some calls belong to one floor or one file alone. Prints
every line that breaks a rule and ends with 1 when there is one. The rules are tried on planted
faults first, so that a rule which has rotted is noticed.
"""

import pathlib
import re
import sys
import tempfile

# What each floor may include of the house, besides itself.
BELOW = {
    "render/base": [],
    "render/math": ["render/base"],
    "render/image": ["render/base"],
    "render/scene": ["render/base", "render/math"],
    "render/formats": ["render/base", "render/math", "render/image", "render/scene"],
    "render/frequency": ["render/base", "render/math"],
    "render/bake": ["render/base", "render/math", "render/image", "render/scene", "render/formats"],
}
LINE = [
    "render/geometry",
    "render/transport",
    "render/estimate",
    "render/film",
    "render/analysis",
    "render/tracing",
    "render/wire",
    "render/report",
]
for number, floor in enumerate(LINE):
    BELOW[floor] = (
        ["render/base", "render/math", "render/image", "render/scene", "render/frequency"]
        + LINE[:number]
    )
for program in ("server", "worker", "client"):
    BELOW[program] = list(BELOW) + ["proto"]
    BELOW[program] = [floor for floor in BELOW[program] if floor.startswith(("render", "proto"))]
for floor in ("render/wire", "render/report"):
    BELOW[floor] += ["proto", "render/bake"]

# Libraries that one place owns: header pattern -> path prefixes that may include it.
OWNERS = {
    r"embree3/": ["render/geometry/"],
    r"(Imf|Imath|Iex|OpenEXR/)": ["render/image/exr_file"],
    r"stb": ["render/film/png_file", "render/film/picture_file", "render/formats/image_file"],
    r"(google/protobuf|grpcpp|grpc)/": ["render/wire/", "render/report/", "server/", "worker/", "client/"],
    r"zstd\.h": ["render/wire/"],
    r"openssl/": ["render/base/"],
    r"tbb/": ["render/base/parallel"],
    r"httplib": ["server/web/"],
    r"prometheus/": ["render/wire/metrics"],
    r"pugixml": ["render/formats/mitsuba/"],
    r"tiny_obj_loader": ["render/formats/mitsuba/"],
    r"zlib\.h": ["render/formats/", "render/image/", "render/film/png_file"],
    r"sqlite3\.h": ["server/"],
    r"random>?$": [],
}

# Calls that one place owns.
CALLS = {
    r"(steady|system|high_resolution)_clock::now|\bclock_gettime\b|\bgettimeofday\b": [
        "render/base/clock"
    ],
    r"\bgetenv\b": ["server/main.cc", "worker/main.cc", "client/main.cc"],
    r"\bofstream\b|\bfopen\b|\bO_CREAT\b|\bO_WRONLY\b|\bO_RDWR\b": ["render/base/files"],
    r"\bgetrandom\(": ["render/base/random_id"],
    # Text for people is in the characters of the locale. The mains print addresses, which are ASCII.
    r"\bstd::(printf|fprintf|f?puts|cout|cerr|clog)\b": [
        "render/base/console", "render/base/status.h", "render/wire/program_log", "server/main.cc", "worker/main.cc"
    ],
    r"\bsetlocale\b": ["render/base/console"],
    r"\bstd::mt19937|\brandom_device\b|\b(s?rand|drand48)\(": [],
}

INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]')


def floor_of(path):
    for floor in sorted(BELOW, key=len, reverse=True):
        if path.startswith(floor + "/"):
            return floor
    return None


def without_comments(line):
    return re.sub(r'"(\\.|[^"\\])*"', '""', line.split("//")[0])


def faults_in(root):
    faults = []
    for top in ("render", "server", "worker", "client"):
        for file in sorted((root / top).rglob("*")):
            if file.suffix not in (".h", ".cc"):
                continue
            path = file.relative_to(root).as_posix()
            floor = floor_of(path)
            if floor is None:
                faults.append(f"{path}:1: this folder is no floor")
                continue
            for number, line in enumerate(file.read_text().splitlines(), 1):
                where = f"{path}:{number}:"
                include = INCLUDE.match(line)
                if include is None:
                    for pattern, owners in CALLS.items():
                        if re.search(pattern, without_comments(line)) and not any(
                            path.startswith(owner) for owner in owners
                        ):
                            faults.append(f"{where} belongs in {owners or 'no file'}: {line.strip()}")
                    continue
                named = include.group(1)
                target = floor_of(named) or ("proto" if named.startswith("proto/") else None)
                if target is not None and target != floor and target not in BELOW[floor]:
                    faults.append(f"{where} {floor} includes {target}, which is not below it")
                if named.startswith("tests/"):
                    faults.append(f"{where} the product includes a test")
                for pattern, owners in OWNERS.items():
                    if re.match(pattern, named) and not any(
                        path.startswith(owner) for owner in owners
                    ):
                        faults.append(f"{where} <{named}> belongs in {owners or 'no file'}")
    return faults


# A file and the line in it that must be refused.
PLANTED = [
    ("render/math/a.h", '#include "render/scene/scene.h"'),
    ("render/estimate/a.h", '#include "render/film/film.h"'),
    ("render/transport/a.cc", '#include "proto/lucerna/v1/jobs.pb.h"'),
    ("render/transport/a.cc", '#include "render/analysis/needs.h"'),
    ("server/a.cc", '#include "worker/gather.h"'),
    ("worker/a.cc", '#include "client/view/report.h"'),
    ("render/transport/a.cc", "#include <embree3/rtcore.h>"),
    ("render/film/film.cc", "#include <ImfOutputFile.h>"),
    ("render/image/a.cc", '#include "render/scene/scene.h"'),
    ("render/scene/a.cc", '#include "render/formats/read_scene.h"'),
    ("render/transport/a.cc", '#include "render/formats/pbrt/lights.h"'),
    ("render/scene/a.cc", "#include <google/protobuf/message.h>"),
    ("worker/a.cc", "#include <tbb/parallel_for.h>"),
    ("render/math/a.cc", "#include <random>"),
    ("worker/a.cc", "const auto now = std::chrono::steady_clock::now();"),
    ("server/a.cc", 'const char* home = std::getenv("HOME");'),
    ("client/a.cc", "std::ofstream out(path);"),
    ("client/commands/a.cc", 'std::printf("%s", text);'),
    ("client/main.cc", "std::setlocale(LC_ALL, text);"),
    ("render/other/a.cc", "int x = 0;"),
]
# Lines that must be let through.
INNOCENT = [
    ("render/film/film.cc", '#include "render/estimate/statistics.h"'),
    ("render/geometry/intersector.cc", "#include <embree3/rtcore.h>"),
    ("server/a.cc", "// std::getenv is for a main."),
    ("server/a.cc", '#include "proto/lucerna/v1/jobs.pb.h"'),
    ("client/main.cc", 'const char* home = std::getenv("HOME");'),
]


def faults_of_line(path, line):
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        (root / path).parent.mkdir(parents=True)
        (root / path).write_text("// What?\n" + line + "\n")
        return faults_in(root)


def main():
    for path, line in PLANTED:
        if not faults_of_line(path, line):
            print(f"check_floors.py lets a planted fault through: {path}: {line}")
            return 1
    for path, line in INNOCENT:
        if faults_of_line(path, line):
            print(f"check_floors.py refuses an innocent line: {path}: {line}")
            return 1
    root = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else pathlib.Path(__file__).parents[2]
    faults = faults_in(root)
    for fault in faults:
        print(fault)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
