"""Tests of the manifests of docker/k8s against the API's schema, which the models of python3-kubernetes contain:
all keys are known, all types are correct, no key is missing. Also tests the names by which the manifests refer to each
other. Needs no cluster."""

import datetime
import json
import os
import pathlib
import re
import subprocess
import sys
import unittest

try:
    import yaml
    from kubernetes import client
except ImportError as error:
    print(f"skipped: {error.name} is missing (apt-get install python3-kubernetes)")
    sys.exit(77)

ROOT = pathlib.Path(__file__).resolve().parents[2]
PLAIN = {"str": str, "int": int, "bool": bool, "float": (int, float), "datetime": datetime.datetime}


def check(value, kind, place):
    """Raises ValueError if `value` is not of the API's type `kind`."""
    if kind == "object":
        return
    if kind in PLAIN:
        is_bool = isinstance(value, bool)
        if not isinstance(value, PLAIN[kind]) or is_bool != (kind == "bool"):
            raise ValueError(f"{place}: expected {kind}, got {value!r}")
        return
    if found := re.fullmatch(r"list\[(.+)\]", kind):
        if not isinstance(value, list):
            raise ValueError(f"{place}: expected a list, got {value!r}")
        for index, item in enumerate(value):
            check(item, found[1], f"{place}[{index}]")
        return
    if not isinstance(value, dict):
        raise ValueError(f"{place}: expected a mapping, got {value!r}")
    if found := re.fullmatch(r"dict\(str, (.+)\)", kind):
        for key, item in value.items():
            check(item, found[1], f"{place}.{key}")
        return
    model = getattr(client, kind)
    attributes = {key: attribute for attribute, key in model.attribute_map.items()}
    for key, item in value.items():
        if key not in attributes:
            raise ValueError(f"{place}: expected a key of {kind}, got '{key}'")
        check(item, model.openapi_types[attributes[key]], f"{place}.{key}")
    try:
        model(**{attributes[key]: item for key, item in value.items()})  # refuses what is missing
    except ValueError as error:
        raise ValueError(f"{place}: {error}") from None


def check_manifest(manifest, place):
    group, _, version = manifest["apiVersion"].rpartition("/")
    # batch/v1 Job is V1Job; the version is part of the name, the group is not.
    kind = version.capitalize() + manifest["kind"]
    groups = {"V1Service": "", "V1PersistentVolumeClaim": "", "V1Deployment": "apps", "V1Job": "batch"}
    if groups.get(kind) != group:
        raise ValueError(f"{place}: expected a kind that this test knows, got {manifest['apiVersion']} "
                         f"{manifest['kind']}")
    check(manifest, kind, place)


def load_manifests():
    for file in sorted((ROOT / "docker/k8s").rglob("*.yaml")):
        for manifest in yaml.safe_load_all(file.read_text()):
            yield f"{file.name}: {manifest['kind']} {manifest['metadata']['name']}", manifest


MANIFESTS = dict(load_manifests())
PODS = {place: manifest["spec"]["template"] for place, manifest in MANIFESTS.items()
        if "template" in manifest["spec"]}


class ManifestsTest(unittest.TestCase):
    def test_every_manifest_fits_the_schema(self):
        self.assertEqual(len(MANIFESTS), 10)
        for place, manifest in MANIFESTS.items():
            check_manifest(manifest, place)

    def test_the_check_finds_defects(self):
        place, job = next(item for item in MANIFESTS.items() if item[0].endswith(" sls-server"))
        def container(manifest):
            return manifest["spec"]["template"]["spec"]["containers"][0]
        defects = {
            "expected a key of V1JobSpec": lambda m: m["spec"].update(backofLimit=0),
            "expected int": lambda m: m["spec"].update(backoffLimit="0"),
            "expected a list": lambda m: container(m).update(command="sim_server"),
            "`name`, must not be `None`": lambda m: container(m).pop("name"),
            "expected str": lambda m: container(m)["env"][0].update(value=1),
            "expected a kind": lambda m: m.update(apiVersion="batch/v2"),
        }
        for expected, damage in defects.items():
            damaged = json.loads(json.dumps(job))
            damage(damaged)
            with self.assertRaisesRegex(ValueError, re.escape(expected)):
                check_manifest(damaged, place)

    def test_names_that_refer_to_something_find_it(self):
        names = {(m["kind"], m["metadata"]["name"]) for m in MANIFESTS.values()}
        # README.md creates this one from the scenario and the QoS file.
        names.add(("ConfigMap", "sls-config"))
        for place, pod in PODS.items():
            volumes = {volume["name"] for volume in pod["spec"].get("volumes", [])}
            for volume in pod["spec"].get("volumes", []):
                if "configMap" in volume:
                    self.assertIn(("ConfigMap", volume["configMap"]["name"]), names, place)
                if "persistentVolumeClaim" in volume:
                    claim = volume["persistentVolumeClaim"]["claimName"]
                    self.assertIn(("PersistentVolumeClaim", claim), names, place)
            for container in pod["spec"]["containers"]:
                mounted = {mount["name"] for mount in container.get("volumeMounts", [])}
                self.assertEqual(mounted, volumes, place)
                for variable in container.get("env", []):
                    if variable["name"] == "SLS_DISCOVERY_SERVER":
                        self.assertIn(("Service", variable["value"]), names, place)
        for place, manifest in MANIFESTS.items():
            if manifest["kind"] == "Service":
                chosen = [pod for pod in PODS.values()
                          if manifest["spec"]["selector"].items() <= pod["metadata"]["labels"].items()]
                self.assertEqual(len(chosen), 1, place)
            if manifest["kind"] == "Deployment":
                self.assertEqual(manifest["spec"]["selector"]["matchLabels"],
                                 manifest["spec"]["template"]["metadata"]["labels"], place)

    def test_nobody_is_root_or_may_become_it(self):
        for place, pod in PODS.items():
            self.assertTrue(pod["spec"]["securityContext"]["runAsNonRoot"], place)
            self.assertGreater(pod["spec"]["securityContext"]["runAsUser"], 0, place)
            for container in pod["spec"]["containers"] + pod["spec"].get("initContainers", []):
                self.assertEqual(container["securityContext"],
                                 {"allowPrivilegeEscalation": False, "readOnlyRootFilesystem": True,
                                  "capabilities": {"drop": ["ALL"]}}, place)

    def test_a_campaign_is_flown_by_indices_of_a_job(self):
        jobs = {m["metadata"]["name"]: m["spec"] for m in MANIFESTS.values() if m["kind"] == "Job"}
        fly = jobs["sls-campaign-fly"]
        self.assertEqual(fly["completionMode"], "Indexed")
        self.assertLessEqual(fly["parallelism"], fly["completions"])
        commands = {name: jobs[f"sls-campaign-{name}"]["template"]["spec"]["containers"][0]["command"]
                    for name in ("plan", "fly", "collect")}
        self.assertIn("JOB_COMPLETION_INDEX", commands["fly"])
        for command in commands.values():  # all of the same folder
            self.assertIn("/campaigns/mine", command)
        self.assertEqual(commands["plan"][4], commands["collect"][4])

    @unittest.skipUnless(len(sys.argv) > 1, "expected the folder of the programs")
    def test_the_command_lines_are_those_of_the_programs(self):
        for place, pod in PODS.items():
            for container in pod["spec"]["containers"]:
                program, *flags = container["command"]
                if program == "fast-discovery-server":
                    continue
                asked, environment = [f"{PROGRAMS}/{program}"], dict(os.environ)
                if program == "/usr/bin/python3":
                    python = [str(ROOT / "python"), f"{PROGRAMS}/../python"]
                    asked, environment["PYTHONPATH"] = container["command"][:4], ":".join(python)
                known = subprocess.run([*asked, "--help"], capture_output=True, text=True,
                                       check=True, env=environment).stdout
                for flag in flags:
                    if flag.startswith("--"):
                        self.assertIn(flag, known, place)


if __name__ == "__main__":
    PROGRAMS = sys.argv[1] if len(sys.argv) > 1 else ""
    unittest.main(argv=sys.argv[:1], verbosity=2)
