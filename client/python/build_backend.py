#!/usr/bin/env python3
"""How does the package become a wheel, with the stubs of the protocol in it?

pip calls build_wheel (PEP 517). By hand, for use without an installation:

  build_backend.py FOLDER      # writes FOLDER/lucerna, for PYTHONPATH=FOLDER

Needs protoc, its own messages and grpc_python_plugin (Debian: protobuf-compiler, libprotobuf-dev,
protobuf-compiler-grpc), and the whole source tree, because the protocol is in its folder `proto`.
"""

import base64
import hashlib
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
import zipfile

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
# What a client of jobs calls, and what that needs.
PROTOS = ["images", "jobs", "values"]


class UnsupportedOperation(Exception):
    """PEP 517: this backend does not offer it."""


def version() -> str:
    text = (ROOT / "CMakeLists.txt").read_text(encoding="utf-8")
    found = re.search(r"^project\(lucerna VERSION ([0-9.]+)", text, re.MULTILINE)
    if found is None:
        sys.exit("CMakeLists.txt names no version")
    return found[1]


def write_stubs(package: pathlib.Path) -> None:
    """package/v1: the messages and services of proto/lucerna/v1."""
    programs = {name: shutil.which(name) for name in ("protoc", "grpc_python_plugin")}
    missing = [name for name, path in programs.items() if path is None]
    if missing:
        sys.exit(f"{' and '.join(missing)} not found; install protobuf-compiler and "
                 "protobuf-compiler-grpc")
    if not (ROOT / "proto/lucerna/v1").is_dir():
        sys.exit(f"{ROOT}/proto is missing; install from the whole source tree")
    stubs = package / "v1"
    stubs.mkdir()
    (stubs / "__init__.py").write_text('"""Generated from proto/lucerna/v1."""\n', encoding="utf-8")
    with tempfile.TemporaryDirectory() as folder:
        made = subprocess.run([programs["protoc"], f"--proto_path={ROOT}", f"--python_out={folder}",
                               f"--pyi_out={folder}", f"--grpc_out={folder}",
                               f"--plugin=protoc-gen-grpc={programs['grpc_python_plugin']}",
                               *(f"proto/lucerna/v1/{name}.proto" for name in PROTOS)],
                              stderr=subprocess.PIPE, text=True, check=False)
        if made.returncode != 0:
            advice = ("; install libprotobuf-dev, which has them"
                      if "google/protobuf" in made.stderr else "")
            sys.exit(f"protoc failed{advice}:\n{made.stderr}")
        for path in sorted((pathlib.Path(folder) / "proto/lucerna/v1").glob("*.py*")):
            text = path.read_text(encoding="utf-8")
            # A top-level module `proto` would be in the way of other packages.
            text = re.sub(r"^from proto\.lucerna\.v1 import", "from lucerna.v1 import", text,
                          flags=re.MULTILINE)
            text = re.sub(r"^(_builder\..*)'proto\.lucerna\.v1\.", r"\1'lucerna.v1.", text,
                          flags=re.MULTILINE)
            (stubs / path.name).write_text(text, encoding="utf-8")


def write_package(folder: pathlib.Path) -> pathlib.Path:
    package = folder / "lucerna"
    shutil.copytree(HERE / "lucerna", package,
                    ignore=shutil.ignore_patterns("__pycache__", "v1", "*.pyc"))
    write_stubs(package)
    return package


def metadata() -> str:
    project = tomllib.loads((HERE / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    lines = ["Metadata-Version: 2.1", f"Name: {project['name']}", f"Version: {version()}",
             f"Summary: {project['description']}", f"License: {project['license']['text']}",
             f"Requires-Python: {project['requires-python']}"]
    lines += [f"Requires-Dist: {one}" for one in project["dependencies"]]
    return "\n".join(lines) + "\n"


def get_requires_for_build_wheel(config_settings=None):
    return []


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    info = f"lucerna-{version()}.dist-info"
    name = f"lucerna-{version()}-py3-none-any.whl"
    with tempfile.TemporaryDirectory() as folder:
        package = write_package(pathlib.Path(folder))
        files = {str(path.relative_to(folder)): path.read_bytes()
                 for path in sorted(package.rglob("*")) if path.is_file()}
    files[f"{info}/METADATA"] = metadata().encode()
    files[f"{info}/LICENSE"] = (ROOT / "LICENSE").read_bytes()
    files[f"{info}/WHEEL"] = (b"Wheel-Version: 1.0\nGenerator: lucerna\n"
                              b"Root-Is-Purelib: true\nTag: py3-none-any\n")
    record = ""
    for path, content in files.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
        record += f"{path},sha256={digest},{len(content)}\n"
    files[f"{info}/RECORD"] = f"{record}{info}/RECORD,,\n".encode()
    with zipfile.ZipFile(pathlib.Path(wheel_directory) / name, "w", zipfile.ZIP_DEFLATED) as wheel:
        for path, content in files.items():
            wheel.writestr(path, content)
    return name


def build_sdist(sdist_directory, config_settings=None):
    raise UnsupportedOperation("there is no source archive of the package alone; install from the "
                               "whole source tree")


if __name__ == "__main__":
    if len(sys.argv) != 2 or sys.argv[1].startswith("-"):
        sys.exit("usage: build_backend.py FOLDER")
    target = pathlib.Path(sys.argv[1])
    shutil.rmtree(target / "lucerna", ignore_errors=True)
    target.mkdir(parents=True, exist_ok=True)
    write_package(target)
