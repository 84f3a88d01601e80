#!/usr/bin/env python3
"""Do the manifests of deploy/kubernetes fit each other and the programs?

  check_kubernetes.py ROOT FOLDER_OF_PROGRAMS

Flags must be those of the programs, labels that select must be labels of a pod, ports, mounts and
volumes must have each other's names, and the autoscaler's metric must be one that there is. What
Kubernetes's own schemas say: validate_kubernetes.mjs. Exits with 77 when python3-yaml is missing.
"""
import pathlib
import re
import subprocess
import sys

try:
    import yaml
except ImportError:
    print("python3-yaml is not installed: the manifests were not checked")
    sys.exit(77)

PROBLEMS = []


def check(holds, problem):
    if not holds:
        PROBLEMS.append(problem)


def flags_of(program):
    text = subprocess.run([program, "help"], capture_output=True, text=True, check=True).stdout
    return set(re.findall(r"^ +(?:-\w,)?(--[a-z-]+)", text, re.MULTILINE))


def check_container(container, volumes, programs):
    name = container["name"]
    program = container["command"][0]
    flags = flags_of(programs / program)
    check(len(flags) > 5, f"{program} help was not understood")
    mounts = {mount["mountPath"] for mount in container["volumeMounts"]}
    for argument in container["args"]:
        flag, _, value = argument.partition("=")
        check(flag in flags, f"{name}: {program} has no flag {flag}")
        if value.startswith("/"):
            check(any(value == mount or value.startswith(mount + "/") for mount in mounts),
                  f"{name}: {value} lies in no volume")
    check({mount["name"] for mount in container["volumeMounts"]} == volumes,
          f"{name}: mounts and volumes differ")
    ports = {port["name"] for port in container["ports"]}
    numbers = {str(port["containerPort"]) for port in container["ports"]}
    for argument in container["args"]:
        flag, _, value = argument.partition("=")
        if flag.startswith("--listen") or flag == "--metrics":
            check(value.rpartition(":")[2] in numbers, f"{name}: {argument} is none of its ports")
    for probe in ("startupProbe", "livenessProbe", "readinessProbe"):
        for way in ("httpGet", "tcpSocket"):
            port = container.get(probe, {}).get(way, {}).get("port")
            check(port is None or port in ports, f"{name}: {probe} is of port {port}, which is none")
    return ports


def main():
    root, programs = map(pathlib.Path, sys.argv[1:])
    folder = root / "deploy/kubernetes"
    named = yaml.safe_load((folder / "kustomization.yaml").read_text(encoding="utf-8"))["resources"]
    others = {path.name for path in folder.glob("*.yaml")} - {"kustomization.yaml"}
    check(set(named) == others, "kustomization.yaml does not name all manifests")
    manifests = [manifest for name in named for manifest in
                 yaml.safe_load_all((folder / name).read_text(encoding="utf-8"))]
    pods = {}
    for manifest in manifests:
        if manifest["kind"] not in ("StatefulSet", "Deployment"):
            continue
        template = manifest["spec"]["template"]
        labels = tuple(sorted(template["metadata"]["labels"].items()))
        check(manifest["spec"]["selector"]["matchLabels"] == dict(labels),
              f"{manifest['kind']}: selector and labels of its pods differ")
        volumes = {volume["name"] for volume in template["spec"]["volumes"]}
        volumes |= {claim["metadata"]["name"]
                    for claim in manifest["spec"].get("volumeClaimTemplates", [])}
        ports = set()
        for container in template["spec"]["containers"]:
            ports |= check_container(container, volumes, programs)
        scraped = template["metadata"]["annotations"]["prometheus.io/port"]
        check(any(scraped == str(port["containerPort"]) and port["name"] == "metrics"
                  for container in template["spec"]["containers"] for port in container["ports"]),
              f"{manifest['kind']}: Prometheus is sent to another port")
        pods[labels] = ports
    check(len(pods) == 2, "there are not two kinds of pods")

    def selected(selector, where):
        labels = tuple(sorted(selector.items()))
        check(labels in pods, f"{where} selects no pods of ours")
        return pods.get(labels, set())

    for manifest in manifests:
        spec = manifest["spec"]
        where = f"{manifest['kind']} {manifest['metadata']['name']}"
        if manifest["kind"] == "Service":
            ports = selected(spec["selector"], where)
            check({port["targetPort"] for port in spec["ports"]} <= ports, f"{where}: other ports")
        elif manifest["kind"] == "PodDisruptionBudget":
            selected(spec["selector"]["matchLabels"], where)
        elif manifest["kind"] == "NetworkPolicy":
            own = selected(spec["podSelector"]["matchLabels"], where)
            for rule in spec["ingress"]:
                check({port["port"] for port in rule["ports"]} <= own, f"{where}: other ports")
        elif manifest["kind"] == "HorizontalPodAutoscaler":
            target = spec["scaleTargetRef"]
            check(any(other["kind"] == target["kind"] and
                      other["metadata"]["name"] == target["name"] for other in manifests),
                  f"{where}: nothing to scale")
            metric = spec["metrics"][0]["external"]["metric"]["name"]
            check(f'"{metric}"' in (root / "server/metrics.cc").read_text(encoding="utf-8"),
                  f"{where}: there is no metric {metric}")
    for problem in PROBLEMS:
        print(problem)
    sys.exit(1 if PROBLEMS else 0)


main()
