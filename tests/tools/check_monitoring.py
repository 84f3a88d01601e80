#!/usr/bin/env python3
"""Are the alerts and the dashboard of deploy/monitoring sound, and about metrics that there are?

  check_monitoring.py ROOT

promtool reads configuration and alerts and runs the alerts' own tests. Every metric that an alert
or a panel names must be one that a program offers, by the source text. Exits with 77 when promtool
is not installed.
"""
import json
import pathlib
import re
import shutil
import subprocess
import sys

# Made by Prometheus itself.
OTHERS = {"up"}


def metrics_of(root):
    names = set()
    for path in ["server/metrics.cc", "worker/work_counts.cc", "render/wire/metrics.cc"]:
        names |= set(re.findall(r'"((?:lucerna|process)_[a-z_]+)"',
                                (root / path).read_text(encoding="utf-8")))
    return names


def main():
    root = pathlib.Path(sys.argv[1])
    folder = root / "deploy/monitoring"
    dashboard = json.loads((folder / "grafana.json").read_text(encoding="utf-8"))
    used = {target["expr"] for panel in dashboard["panels"] for target in panel["targets"]}
    text = "\n".join(used) + (folder / "alerts.yml").read_text(encoding="utf-8")
    named = set(re.findall(r"\b((?:lucerna|process)_[a-z_]+)\b(?=[{\[ )]|$)", text, re.MULTILINE))
    offered = metrics_of(root)
    known = offered | {name + end for name in offered for end in ("_bucket", "_count", "_sum")}
    unknown = named - known - OTHERS
    if unknown:
        sys.exit(f"deploy/monitoring names metrics that there are not: {sorted(unknown)}")
    if len(named) < 10:
        sys.exit("too few metrics were found: this check does not read its input")
    ids = [panel["id"] for panel in dashboard["panels"]]
    if len(ids) != len(set(ids)):
        sys.exit("two panels have the same id")
    if shutil.which("promtool") is None:
        print("promtool is not installed: alerts were not checked")
        sys.exit(77)
    for command in [["promtool", "check", "config", str(folder / "prometheus.yml")],
                    ["promtool", "test", "rules", str(folder / "alerts_test.yml")]]:
        subprocess.run(command, check=True)


main()
