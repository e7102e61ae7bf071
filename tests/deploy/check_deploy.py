#!/usr/bin/env python3
"""Checks what lies in deploy/ without a cluster: manifests, alerts, dashboard, compose file, SBOM."""
import importlib.util
import json
import pathlib
import re
import shutil
import subprocess
import unittest

import jsonschema
import yaml

from render_manifests import render
from schemas import COMPOSE, SCHEMAS

ROOT = pathlib.Path(__file__).resolve().parents[2]
DEPLOY = ROOT / "deploy"
OVERLAYS = ("cpu", "gpu")


def load_dashboard_maker():
    spec = importlib.util.spec_from_file_location("make_dashboard", DEPLOY / "grafana/make_dashboard.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def declared_metrics():
    maker = load_dashboard_maker()
    return {name for _, name, _ in maker.find_metrics(maker.METRICS.read_text())}


def metrics_in(expression):
    return {re.sub("_(bucket|sum|count)$", "", name) for name in re.findall(r"\b(?:amhex|grpc_server)_[a-z_]+", expression)}


def run(*command):
    return subprocess.run(command, cwd=DEPLOY / "prometheus", capture_output=True, text=True)


class Manifests(unittest.TestCase):
    def objects(self, overlay):
        return {(entry["kind"], entry["metadata"]["name"]): entry for entry in render(DEPLOY / "kubernetes" / overlay)}

    def pod(self, overlay):
        return self.objects(overlay)["StatefulSet", "amhex"]["spec"]["template"]

    def test_every_object_obeys_its_schema(self):
        for overlay in OVERLAYS:
            for (kind, name), entry in self.objects(overlay).items():
                with self.subTest(overlay=overlay, kind=kind, name=name):
                    jsonschema.Draft7Validator(SCHEMAS[kind]).validate(entry)

    def test_a_misspelt_field_is_found(self):
        entry = self.objects("cpu")["StatefulSet", "amhex"]
        entry["spec"]["template"]["spec"]["terminationGracePeriod"] = 1
        with self.assertRaises(jsonschema.ValidationError):
            jsonschema.Draft7Validator(SCHEMAS["StatefulSet"]).validate(entry)

    def test_selectors_meet_the_pods(self):
        for overlay in OVERLAYS:
            labels = self.pod(overlay)["metadata"]["labels"].items()
            for (kind, _), entry in self.objects(overlay).items():
                selector = entry.get("spec", {}).get("selector", entry.get("spec", {}).get("podSelector"))
                if selector is None:
                    continue
                self.assertLessEqual(selector.get("matchLabels", selector if kind == "Service" else {}).items(), labels)

    def test_names_that_objects_give_each_other_exist(self):
        for overlay in OVERLAYS:
            objects = self.objects(overlay)
            stateful = objects["StatefulSet", "amhex"]["spec"]
            pod = stateful["template"]["spec"]
            container = pod["containers"][0]
            self.assertEqual(objects["Service", stateful["serviceName"]]["spec"]["clusterIP"], "None")
            self.assertIn(("ServiceAccount", pod["serviceAccountName"]), objects)
            volumes = {volume["name"]: volume for volume in pod["volumes"]}
            self.assertEqual({mount["name"] for mount in container["volumeMounts"]}, set(volumes))
            for volume in volumes.values():
                if "persistentVolumeClaim" in volume:
                    claim = objects["PersistentVolumeClaim", volume["persistentVolumeClaim"]["claimName"]]
                    self.assertEqual(claim["spec"]["accessModes"], ["ReadWriteMany"])
            ports = {port["name"]: port["containerPort"] for port in container["ports"]}
            for service in ("amhex", "amhex-nodes"):
                for port in objects["Service", service]["spec"]["ports"]:
                    self.assertEqual(ports[port["targetPort"]], port["port"])
            for probe in ("livenessProbe", "readinessProbe", "startupProbe"):
                self.assertEqual(container[probe]["grpc"]["port"], ports["grpc"])
            scaled = objects["ScaledObject", "amhex"]["spec"]
            target = scaled["scaleTargetRef"]
            self.assertIn((target["kind"], target["name"]), objects)
            for trigger in scaled["triggers"]:
                self.assertIn(("TriggerAuthentication", trigger["authenticationRef"]["name"]), objects)

    def test_flags_exist_and_leave_time_to_drain(self):
        source = (ROOT / "server/src/server_options.cpp").read_text()
        for overlay in OVERLAYS:
            pod = self.pod(overlay)["spec"]
            flags = dict(argument.partition("=")[::2] for argument in pod["containers"][0]["args"])
            for flag in flags:
                self.assertIn('"%s"' % flag, source)
            for variable in pod["containers"][0]["env"]:
                if variable["name"].startswith("AMHEX_"):
                    self.assertIn('"%s"' % variable["name"], source)
            drain = int(flags["--drain-delay"]) + int(flags["--drain-timeout"])
            self.assertGreater(pod["terminationGracePeriodSeconds"], drain)

    def test_only_the_gpu_overlay_asks_for_a_gpu(self):
        limits = {overlay: self.pod(overlay)["spec"]["containers"][0]["resources"]["limits"] for overlay in OVERLAYS}
        self.assertNotIn("nvidia.com/gpu", limits["cpu"])
        self.assertEqual(limits["gpu"]["nvidia.com/gpu"], 1)
        self.assertEqual(self.pod("gpu")["spec"]["runtimeClassName"], "nvidia")

    def test_rendering_is_that_of_kubectl(self):
        if shutil.which("kubectl") is None:
            self.skipTest("no kubectl here; the objects were checked as rendered by render_manifests.py")
        for overlay in OVERLAYS:
            result = run("kubectl", "kustomize", str(DEPLOY / "kubernetes" / overlay))
            if result.returncode != 0 and "labels" in result.stderr:
                self.skipTest("this kubectl is too old to render them")
            self.assertEqual(result.returncode, 0, result.stderr)
            theirs = {(entry["kind"], entry["metadata"]["name"]): entry for entry in yaml.safe_load_all(result.stdout)}
            self.assertEqual(theirs, self.objects(overlay))


class Monitoring(unittest.TestCase):
    def rules(self):
        return [rule for group in yaml.safe_load((DEPLOY / "prometheus/alerts.yml").read_text())["groups"] for rule in group["rules"]]

    def test_alerts_fire_when_they_should_and_only_then(self):
        for command in (("check", "rules", "alerts.yml"), ("check", "config", "prometheus.yml"), ("test", "rules", "alerts_test.yml")):
            result = run("promtool", *command)
            self.assertEqual(result.returncode, 0, result.stdout + result.stderr)

    def test_every_alert_has_a_test(self):
        tested = {case["alertname"] for test in yaml.safe_load((DEPLOY / "prometheus/alerts_test.yml").read_text())["tests"]
                  for case in test["alert_rule_test"] if case["exp_alerts"]}
        self.assertEqual({rule["alert"] for rule in self.rules()}, tested)

    def test_every_alert_is_documented_with_what_to_do(self):
        rows = set(re.findall(r"^\| `(Amhex\w+)` \|[^|]+\|[^|]+\|$", (ROOT / "docs/operations.md").read_text(), re.M))
        self.assertEqual({rule["alert"] for rule in self.rules()}, rows)

    def test_alerts_name_metrics_that_exist(self):
        for rule in self.rules():
            self.assertLessEqual(metrics_in(rule["expr"]), declared_metrics(), rule["alert"])

    def test_every_metric_is_documented(self):
        documented = metrics_in((ROOT / "docs/operations.md").read_text())
        self.assertEqual(declared_metrics() - documented, set())

    def test_dashboard_is_what_its_script_makes_and_shows_every_metric(self):
        result = run(str(DEPLOY / "grafana/make_dashboard.py"), "--check")
        self.assertEqual(result.returncode, 0, result.stderr)
        dashboard = json.loads((DEPLOY / "grafana/dashboards/amhex.json").read_text())
        shown = set().union(*(metrics_in(target["expr"]) for panel in dashboard["panels"] for target in panel["targets"]))
        self.assertEqual(shown, declared_metrics())

    def test_dashboard_expressions_are_promql(self):
        dashboard = json.loads((DEPLOY / "grafana/dashboards/amhex.json").read_text())
        rules = [{"record": "check:%d" % i, "expr": target["expr"].replace("$__rate_interval", "5m").replace("$instance", ".*")}
                 for i, target in enumerate(target for panel in dashboard["panels"] for target in panel["targets"])]
        text = yaml.safe_dump({"groups": [{"name": "dashboard", "rules": rules}]})
        result = subprocess.run(["promtool", "check", "rules", "/dev/stdin"], input=text, capture_output=True, text=True)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)


class Compose(unittest.TestCase):
    def test_it_obeys_its_schema(self):
        compose = yaml.safe_load((DEPLOY / "compose.yaml").read_text())
        jsonschema.Draft7Validator(COMPOSE).validate(compose)
        for service in compose["services"].values():
            self.assertLessEqual(set(service.get("depends_on", [])), set(compose["services"]))
        compose["services"]["amhexd"]["volume"] = ["a:/b"]
        with self.assertRaises(jsonschema.ValidationError):
            jsonschema.Draft7Validator(COMPOSE).validate(compose)

    def test_the_server_may_drain(self):
        service = yaml.safe_load((DEPLOY / "compose.yaml").read_text())["services"]["amhexd"]
        default = re.search(r"drain_timeout = absl::Seconds\((\d+)\)", (ROOT / "server/src/server_options.h").read_text())
        self.assertGreater(int(service["stop_grace_period"].rstrip("s")), int(default.group(1)))

    def test_paths_and_volumes_exist_and_ports_stay_on_this_machine(self):
        compose = yaml.safe_load((DEPLOY / "compose.yaml").read_text())
        self.assertEqual(set(compose["services"]), {"amhexd", "prometheus", "grafana"})
        for name, service in compose["services"].items():
            for port in service["ports"]:
                self.assertTrue(port.startswith("127.0.0.1:"), name)
            for volume in service.get("volumes", []):
                source = volume.split(":")[0]
                found = (DEPLOY / source).exists() if source.startswith(".") else source in compose["volumes"]
                self.assertTrue(found, volume)
        self.assertTrue(compose["services"]["amhexd"]["read_only"])


class Images(unittest.TestCase):
    def stages(self, name):
        return re.split(r"^FROM ", (DEPLOY / name).read_text(), flags=re.M)[1:]

    def test_last_stage_has_no_compiler_no_root_and_a_probe(self):
        for name in ("Dockerfile", "Dockerfile.cuda"):
            stage = self.stages(name)[-1]
            self.assertIn("\nUSER 10001\n", stage)
            self.assertIn("\nHEALTHCHECK ", stage)
            self.assertIn("make-sbom.sh", stage)
            self.assertIn("install-packages.sh run", stage)
            self.assertNotIn("install-packages.sh build", stage)

    def test_sbom_lists_every_package(self):
        made = run(str(DEPLOY / "make-sbom.sh"), "amhex", 'a "quoted" revision')
        self.assertEqual(made.returncode, 0, made.stderr)
        sbom = json.loads(made.stdout)
        self.assertEqual(sbom["spdxVersion"], "SPDX-2.3")
        self.assertEqual(sbom["packages"][0]["versionInfo"], 'a "quoted" revision')
        installed = run("dpkg-query", "-W", "-f", "${Package}\n").stdout.split()
        self.assertEqual(len(sbom["packages"]) - 1, len(installed))
        identifiers = [package["SPDXID"] for package in sbom["packages"]]
        self.assertEqual(len(identifiers), len(set(identifiers)))


if __name__ == "__main__":
    unittest.main()
