#!/usr/bin/env python3
"""Does Blender still export the room of client/blender as it is in tests/scenes, and is that read without a warning?

  check_blender.py FOLDER_OF_PROGRAMS

77 where Blender is missing.
"""
import json
import os
import pathlib
import shutil
import struct
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
SCENE = ROOT / "tests/scenes/blender-room.glb"


def meaning_of(path):
    """What the file says without its buffers, whose order differs from run to run, and who wrote it."""
    data = path.read_bytes()
    length = struct.unpack("<I", data[12:16])[0]
    document = json.loads(data[20:20 + length])
    accessors = document["accessors"]
    for mesh in document["meshes"]:
        for primitive in mesh["primitives"]:
            for values in (primitive["attributes"], primitive):
                for name, number in list(values.items()):
                    if name in ("POSITION", "NORMAL", "TEXCOORD_0", "indices"):
                        values[name] = [accessors[number]["count"], accessors[number]["type"],
                                        accessors[number].get("min"), accessors[number].get("max")]
    for name in ("asset", "accessors", "bufferViews", "buffers"):
        document.pop(name, None)
    return document


def main():
    lucerna = pathlib.Path(sys.argv[1]) / "lucerna"
    said = json.loads(subprocess.run([lucerna, "validate", SCENE, "--json"], capture_output=True,
                                     text=True, check=True).stdout)
    bad = [one for one in said["diagnostics"] if one["severity"] in ("error", "warning")]
    if bad:
        print(f"{SCENE.name} is not read as it is meant: {bad}")
        return 1
    if shutil.which("blender") is None:
        print("Blender is not installed: the scene was read, and not exported anew")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        made = pathlib.Path(folder) / "room.glb"
        done = subprocess.run(["blender", "--background", "--factory-startup", "--python",
                               ROOT / "client/blender/room.py", "--", made],
                              # Debian's Blender looks for Python, and with it for numpy, in PATH.
                              env={**os.environ, "PATH": f"/usr/bin:{os.environ['PATH']}"},
                              capture_output=True, text=True, check=False)
        if not made.exists():
            print(done.stdout + done.stderr)
            return 1
        if meaning_of(made) != meaning_of(SCENE):
            print("Blender exports another room than tests/scenes/blender-room.glb")
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
