"""Renders deploy/kubernetes as `kubectl apply -k` would, for the part of kustomize used there."""
import copy
import pathlib

import yaml

KNOWN = {"apiVersion", "kind", "namespace", "resources", "labels", "images", "patches"}


def render(folder):
    """The objects of a kustomization, as a list of dictionaries."""
    folder = pathlib.Path(folder)
    plan = yaml.safe_load((folder / "kustomization.yaml").read_text())
    unknown = set(plan) - KNOWN
    if unknown:
        raise ValueError("%s uses %s, which is not rendered here" % (folder, sorted(unknown)))
    objects = []
    for resource in plan["resources"]:
        path = folder / resource
        if path.is_dir():
            objects += render(path)
        else:
            objects += [entry for entry in yaml.safe_load_all(path.read_text()) if entry]
    for entry in objects:
        if plan.get("namespace") and entry["kind"] != "Namespace":
            entry["metadata"]["namespace"] = plan["namespace"]
        for label in plan.get("labels", []):
            add_labels(entry, label)
        for patch in plan.get("patches", []):
            if matches(entry, patch["target"]):
                for step in yaml.safe_load(patch["patch"]):
                    apply(entry, step)
        for image in plan.get("images", []):
            rename_image(entry, image)
    return objects


def add_labels(entry, label):
    pairs = label["pairs"]
    entry["metadata"].setdefault("labels", {}).update(pairs)
    spec = entry.get("spec", {})
    if entry["kind"] == "Service":
        spec["selector"] = {**(spec.get("selector") or {}), **pairs}
    if entry["kind"] in ("StatefulSet", "PodDisruptionBudget"):
        spec["selector"]["matchLabels"] = {**(spec["selector"].get("matchLabels") or {}), **pairs}
    if "template" in spec:
        spec["template"].setdefault("metadata", {}).setdefault("labels", {}).update(pairs)


def matches(entry, target):
    return entry["kind"] == target["kind"] and entry["metadata"]["name"] == target["name"]


def apply(entry, step):
    """One step of a JSON patch (RFC 6902); only "add" of a member is used."""
    if step["op"] != "add":
        raise ValueError("unknown step " + step["op"])
    *path, last = step["path"].strip("/").split("/")
    place = entry
    for name in path:
        place = place[int(name) if isinstance(place, list) else name.replace("~1", "/")]
    place[last] = copy.deepcopy(step["value"])


def rename_image(entry, image):
    pod = entry.get("spec", {}).get("template", {}).get("spec", {})
    for container in pod.get("containers", []):
        if container["image"].split(":")[0] == image["name"]:
            container["image"] = "%s:%s" % (image["newName"], image["newTag"])
