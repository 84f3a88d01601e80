#!/usr/bin/env python3
"""Does all JSON of lucerna follow the schemas of docs/schemas, and would they find what does not?

  check_schemas.py FOLDER_OF_PROGRAMS [--print]

Runs the programs on small scenes, alone and with a coordinator and a worker, and validates what
each command prints. Then every value is changed in each place, by another property or by another
type, which its schema must refuse. Every schema must have had a value, and every object, property
and number in them what their readers need. --print shows each value that was validated. Exits with
77 when python3-jsonschema is not installed.
"""
import argparse
import copy
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time

try:
    import jsonschema
except ImportError:
    print("python3-jsonschema is not installed: the JSON of lucerna was not checked")
    sys.exit(77)

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCHEMAS = ROOT / "docs/schemas"
SCENE = ROOT / "tests/scenes/caustic.pbrt"
SMALL = ["--size", "16x12", "--photons-per-pass", "500"]
# No light reaches what the camera sees, and a light without an area is a warning.
BLACK = """LookAt 0 0 1  0 0 0  0 1 0
Camera "perspective" "float fov" [40]
WorldBegin
LightSource "point" "point3 from" [0 0 -2]
AttributeBegin
AreaLightSource "diffuse"
Shape "trianglemesh" "point3 P" [0 0 0 1 0 0 2 0 0] "integer indices" [0 1 2]
AttributeEnd
Shape "disk" "float radius" [9]
"""
PATIENCE_S = 300
# Of jobs that fail, photons that are not finite, and errors that fall slowly enough.
RARE = {"common/$defs/job/properties/failure",
        "common/$defs/job/properties/dropped_photons",
        "common/$defs/photon_key/properties/index",
        "common/$defs/photon_key/properties/pass",
        "common/$defs/job/properties/far_target/properties/left_s"}


def definitions():
    """All files by name, with references that lead from one to another within one document."""

    def moved(value, name):
        if isinstance(value, list):
            return [moved(item, name) for item in value]
        if not isinstance(value, dict):
            return value
        value = {key: moved(item, name) for key, item in value.items() if key != "$schema"}
        if isinstance(value.get("$ref"), str):
            file, _, place = value["$ref"].partition("#")
            file = file.removesuffix(".schema.json") or name
            value["$ref"] = f"#/$defs/{file}{place}"
        return value

    files = {path.name.removesuffix(".schema.json"): json.loads(path.read_text(encoding="utf-8"))
             for path in sorted(SCHEMAS.glob("*.schema.json"))}
    for schema in files.values():
        jsonschema.Draft202012Validator.check_schema(schema)
    return {name: moved(schema, name) for name, schema in files.items()}


def find_gaps(schema, place, gaps):
    """What a reader of the schema would miss."""
    if isinstance(schema, list):
        for i, item in enumerate(schema):
            find_gaps(item, f"{place}[{i}]", gaps)
        return
    if not isinstance(schema, dict):
        return
    types = schema.get("type", [])
    types = types if isinstance(types, list) else [types]
    if "object" in types and "additionalProperties" not in schema:
        gaps.append(f"{place} takes properties that are not documented")
    if {"number", "integer"} & set(types):
        if "unit" not in schema:
            gaps.append(f"{place} has no unit")
        ends = {"minimum", "exclusiveMinimum", "maximum", "exclusiveMaximum"}
        if not ends & set(schema) and "of either sign" not in schema.get("description", ""):
            gaps.append(f"{place} has no range")
    if schema.get("type") and "description" not in schema:
        gaps.append(f"{place} has no description")
    for key, item in schema.items():
        if key not in ("if", "else"):
            find_gaps(item, f"{place}/{key}", gaps)


def places(value, place=()):
    """All places in a value, but for those in texts by names that others choose."""
    yield place
    if isinstance(value, dict) and place[-1:] != ("metadata",):
        for key, item in value.items():
            yield from places(item, place + (key,))
    elif isinstance(value, list):
        for i, item in enumerate(value):
            yield from places(item, place + (i,))


def in_any_item(place):
    return tuple("*" if isinstance(key, int) else key for key in place)


def documented(definitions, pointer, place=()):
    """The properties that a schema names: each place, as in_any_item gives it, and a pointer to its
    definition, which other schemas may share."""
    schema = definitions
    for key in pointer.split("/"):
        schema = schema[key]
    if "$ref" in schema:
        yield from documented(definitions, schema["$ref"].removeprefix("#/$defs/"), place)
        return
    if place and place[-1] != "*":
        yield place, pointer
    for key in schema.get("properties", {}):
        yield from documented(definitions, f"{pointer}/properties/{key}", place + (key,))
    if "items" in schema:
        yield from documented(definitions, pointer + "/items", place + ("*",))


def changed(value, place, change):
    if not place:
        return change(value)
    copied = copy.copy(value)
    copied[place[0]] = changed(value[place[0]], place[1:], change)
    return copied


def of_another_type(value):
    """Arrays of arrays and objects of objects do not occur, nor does a number stand for a text."""
    return 7.5 if isinstance(value, (str, bool, dict)) or value is None else {"x": "y"}


class Checks:
    def __init__(self, programs, prints):
        self.programs = programs
        self.prints = prints
        self.definitions = definitions()
        self.validators = {}
        self.values = {}
        self.errors = []

    def validator(self, name):
        if name not in self.validators:
            self.validators[name] = jsonschema.Draft202012Validator(
                {"$ref": f"#/$defs/{name}", "$defs": self.definitions})
        return self.validators[name]

    def run(self, schema, *words, code=0):
        """Runs a command and validates what it prints; returns the value."""
        words = [str(word) for word in words]
        done = subprocess.run([self.programs / "lucerna", *words, "--json"], capture_output=True,
                              text=True, timeout=PATIENCE_S)
        command = "lucerna " + " ".join(words) + " --json"
        if done.returncode != code:
            sys.exit(f"{command} ended with {done.returncode}: {done.stderr}")
        value = json.loads(done.stdout)
        if self.prints:
            print(f"{command}\n{done.stdout}")
        self.values.setdefault(schema, []).append(value)
        for error in self.validator(schema).iter_errors(value):
            place = "/".join(map(str, error.absolute_path))
            self.errors.append(f"{command}: {schema}.schema.json, at /{place}: {error.message}")
        return value

    def expect(self, holds, what):
        if not holds:
            self.errors.append(what)

    def refuse_changes(self):
        count = 0
        printed, named = set(), set()
        for schema, values in self.values.items():
            validator = self.validator(schema)
            seen = set()
            for value, place in ((value, place) for value in values for place in places(value)):
                if in_any_item(place) in seen:
                    continue
                seen.add(in_any_item(place))
                target = value
                for key in place:
                    target = target[key]
                changes = {"of another type": of_another_type}
                if isinstance(target, dict):
                    changes["with another property"] = lambda old: {**old, "undocumented": 1}
                for what, change in changes.items():
                    count += 1
                    self.expect(not validator.is_valid(changed(value, place, change)),
                                f"{schema}.schema.json takes /{'/'.join(map(str, place))} {what}")
            for place, pointer in documented(self.definitions, schema):
                (printed if place in seen else named).add(pointer)
        for pointer in sorted(named - printed - RARE):
            self.errors.append(f"no command has printed {pointer}")
        return count


def alone(checks, folder):
    """What needs no coordinator of its own."""
    image, reference, black = folder / "a.exr", folder / "ref.exr", folder / "black.pbrt"
    black.write_text(BLACK)
    checks.run("reference", "reference", SCENE, *SMALL, "--passes", 4, "-o", reference, "--quiet")
    short = checks.run("job", "render", SCENE, *SMALL, "--passes", 20, "-o", image, "--png",
                       folder / "a.png", "--reference", reference, "--quiet")
    checks.expect("true" in short.get("relative_error", {}),
                  "the short job lacks the error against its reference")
    checks.expect(len(json.dumps(short, indent=2)) < 2500, "the short job is long")
    full = checks.run("job-full", "render", SCENE, *SMALL, "--passes", 20, "-o", image,
                      "--reference", reference, "--quiet", "--full")
    checks.expect(set(short) < set(full), "the short job is no part of the full one")
    checks.expect(full["image_digest"] == short["image_digest"], "the digests differ")
    of_black = checks.run("job-full", "render", black, "--size", "8x8", "--error", "3%",
                          "--passes", 40, "-o", folder / "black.exr", "--quiet", "--full")
    checks.expect(of_black.get("nothing_found") is True, "the black image is not said to be one")
    checks.run("job", "render", black, "--size", "8x8", "--passes", 4, "-o", folder / "black.exr",
               "--quiet", "--force")
    checks.run("diff", "diff", image, reference)
    checks.run("diff", "diff", image, folder / "black.exr", "--crop")
    checks.run("digest", "digest", image)
    checks.run("validate", "validate", SCENE)
    checks.run("validate", "validate", black, "--strict", code=1)
    checks.run("plan", "plan", SCENE, "--radius-controller", "frequency-mse")
    checks.run("selfcheck", "selfcheck", "--only", "number-")
    checks.run("bake", "bake", ROOT / "tests/scenes/corner.pbrt", "-o", folder / "a.ply",
               "--spacing", 1, "--passes", 12, "--photons-per-pass", 2000, "--quiet")
    checks.run("bake", "bake", ROOT / "tests/scenes/corner.pbrt", "-o", folder / "a.glb",
               "--spacing", 1, "--passes", 12, "--photons-per-pass", 2000, "--quiet")
    checks.run("mesh-render", "render", ROOT / "tests/scenes/corner.pbrt", "--from-mesh",
               folder / "a.glb", "--size", "8x8", "--passes", 2, "-o", folder / "drawn.exr",
               "--quiet")
    compare = ["compare", SCENE, "--reference", reference, *SMALL, "--times", "0.1,0.2",
               "--repetitions", 2, "--settings", "first: --kernel constant", "--settings",
               "second: --radius-controller pppm", "--quiet"]
    compared = checks.run("compare", *compare)
    checks.expect(all("runs" not in one for one in compared["settings"]),
                  "compare prints its runs without --full")
    compared = checks.run("compare", *compare, "--full")
    checks.expect(all(one["runs"] for one in compared["settings"]), "compare --full has no runs")


def wait_for(what, read):
    """The first value that is not empty."""
    end = time.monotonic() + PATIENCE_S
    while not (value := read()):
        if time.monotonic() > end:
            sys.exit(f"there is no {what} after {PATIENCE_S} s")
        time.sleep(0.05)
    return value


def with_coordinator(checks, folder):
    programs = []
    token = checks.run("token", "token", "new", "someone", "--roles", "submit,work,admin")
    tokens = folder / "tokens"
    tokens.write_text(token["line"] + "\n")
    tokens.chmod(0o600)
    os.environ["LUCERNA_TOKEN"] = token["token"]

    def start(name, *words):
        programs.append(subprocess.Popen([checks.programs / name, *words], text=True,
                                         stdout=subprocess.PIPE, stderr=subprocess.DEVNULL))
        return programs[-1]

    try:
        coordinator = start("lucerna-server", "--listen", "127.0.0.1:0", "--threads", "1",
                            "--tokens", tokens, "--log-level", "off")
        address = re.fullmatch(r"listening on (\S+)\n", coordinator.stdout.readline()).group(1)
        at = ["--server", address]

        def submit(*words):
            return checks.run("submitted", "submit", SCENE, *SMALL, *words, *at)["job_id"]

        waiting = submit("--time", 1000)
        wait_for("job without workers",
                 lambda: checks.run("jobs", "jobs", *at)[0].get("no_workers"))
        start("lucerna-worker", "--server", address, "--threads", "1", "--log-level", "off")

        job = submit("--passes", 12)
        checks.run("job", "wait", job, *at, "--quiet")
        checks.run("job", "priority", waiting, 7, *at)
        paused = checks.run("job", "pause", waiting, *at)
        checks.expect(paused.get("pause_cause") == "USER", "the paused job does not say why")
        checks.expect(paused.get("owner") == "someone", "the job has no owner")
        checks.run("job", "resume", waiting, *at)
        checks.run("job", "extend", waiting, "--error", "0.001%", "--time", 1000, *at)
        checks.run("job-full", "cancel", waiting, *at, "--full")
        checks.run("job", "wait", waiting, *at, "--quiet", code=1)
        stopped = submit("--reference", folder / "ref.exr", "--passes", 1_000_000_000,
                         "--error", "0.001%")
        wait_for("target out of sight",
                 lambda: checks.run("report", "report", stopped, *at).get("far_target"))
        checks.run("job", "stop", stopped, *at)
        checks.run("job", "watch", stopped, *at, "--quiet")
        checks.run("job-full", "watch", stopped, *at, "--quiet", "--full")
        checks.run("fetched", "fetch", job, "-o", folder / "b.exr", *at)
        checks.run("job", "submit", SCENE, *SMALL, "--passes", 3, "-o", folder / "c.exr", *at,
                   "--quiet")
        checks.run("report", "report", job, *at)
        checks.run("jobs", "jobs", *at)
        checks.run("jobs-full", "jobs", *at, "--full")
        ends = {checks.run("trace-photon", "trace-photon", job, f"0:{i}", *at)["end"]
                for i in range(12)}
        checks.expect(len(ends) > 1, f"all photons ended so: {ends}")
        black = checks.run("submitted", "submit", folder / "black.pbrt", "--size", "8x8",
                           "--passes", 4, *at)["job_id"]
        checks.run("job", "wait", black, *at, "--quiet")
        checks.run("report", "report", black, *at)
        glass = checks.run("submitted", "submit", ROOT / "tests/scenes/prism.pbrt", *SMALL,
                           "--passes", 2, *at)["job_id"]
        checks.run("job", "wait", glass, *at, "--quiet")
        bent = any("wavelength_nm" in checks.run("trace-photon", "trace-photon", glass,
                                                 f"0:{i}", *at) for i in range(20))
        checks.expect(bent, "no photon of a prism has a wavelength")
        worker = checks.run("workers", "workers", *at)[0]["worker_id"]
        checks.run("workers", "workers", "quarantine", worker, *at)
        checks.run("workers", "workers", "release", worker, *at)
        checks.run("workers", "workers", "drain", worker, *at)
    finally:
        for program in reversed(programs):
            program.terminate()
        for program in programs:
            program.wait()
            program.stdout.close()


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("programs", type=pathlib.Path)
    parser.add_argument("--print", dest="prints", action="store_true")
    arguments = parser.parse_args()
    checks = Checks(arguments.programs.resolve(), arguments.prints)
    for name, schema in checks.definitions.items():
        find_gaps(schema, name, checks.errors)
    with tempfile.TemporaryDirectory() as folder:
        alone(checks, pathlib.Path(folder))
        with_coordinator(checks, pathlib.Path(folder))
    unused = set(checks.definitions) - set(checks.values) - {"common"}
    checks.expect(not unused, f"no value was checked against {sorted(unused)}")
    changes = checks.refuse_changes()
    if checks.errors:
        sys.exit("\n".join(checks.errors))
    print(f"{sum(map(len, checks.values.values()))} values follow {len(checks.values)} schemas, "
          f"which refuse {changes} changes of them")


main()
