#!/usr/bin/env python3
"""Writes the Grafana dashboard from the metrics that the server declares.

    deploy/grafana/make_dashboard.py            writes dashboards/amhex.json
    deploy/grafana/make_dashboard.py --check    exits with 1 if the file is not up to date

Names, kinds and help texts come from server/src/metrics.cpp, so no panel can name a metric that
does not exist and none can be forgotten.
"""
import json
import pathlib
import re
import sys

FOLDER = pathlib.Path(__file__).resolve().parent
METRICS = FOLDER.parent.parent / "server/src/metrics.cpp"
OUTPUT = FOLDER / "dashboards/amhex.json"

# Labels that split a metric into lines of one panel.
SPLIT = {
    "amhex_jobs_finished_total": "state, reason",
    "amhex_jobs": "state",
    "amhex_primitives_total": "type",
    "amhex_progress_frames_total": "outcome",
    "amhex_blob_bytes_total": "dir",
    "amhex_decode_rejected_total": "reason",
    "amhex_worker_restarts_total": "cause",
    "amhex_stage_duration_seconds": "stage",
    "amhex_job_duration_seconds": "size_class",
    "grpc_server_call_duration_seconds": "method",
    "amhex_build_info": "version",
}
# Every node of a cluster tells the same of what they share.
SHARED = {"amhex_jobs", "amhex_queue_cost_seconds", "amhex_queue_oldest_age_seconds", "amhex_blob_store_bytes"}
WIDTH, HEIGHT, COLUMNS = 8, 7, 3


def find_metrics(source):
    """Yields (kind, name, help) for every family, in the order of their names."""
    # Adjacent string literals are one.
    source = re.sub(r'"\s*\n\s*"', "", source)
    found = {}
    pattern = r'\b(CounterFamily|OneCounter|OneGauge|HistogramFamily|OneHistogram)\(\s*\*registry,\s*"([a-z_]+)",\s*"([^"]+)"'
    for match in re.finditer(pattern, source):
        kind = re.sub("Family|One", "", match.group(1)).lower()
        found[match.group(2)] = (kind, match.group(3))
    for match in re.finditer(r'Build(Gauge|Counter|Histogram)\(\)\s*\.Name\("([a-z_]+)"\)\s*\.Help\("([^"]+)"\)', source):
        found[match.group(2)] = (match.group(1).lower(), match.group(3))
    return [(kind, name, text) for name, (kind, text) in sorted(found.items())]


def unit(name):
    if "_bytes" in name:
        return "bytes"
    if "_seconds" in name:
        return "s"
    return "percentunit" if name.endswith("_ratio") else "short"


def targets(kind, name):
    """The queries of a metric's panel: (expression, legend)."""
    by = SPLIT.get(name)
    legend = " ".join("{{%s}}" % label.strip() for label in by.split(",")) if by else "{{instance}}"
    chosen = '{instance=~"$instance"}'
    if kind == "counter":
        return [("sum by (%s) (rate(%s%s[$__rate_interval]))" % (by or "instance", name, chosen), legend)]
    if kind == "gauge":
        how = "max" if name in SHARED else "sum"
        return [("%s by (%s) (%s%s)" % (how, by or ("job" if name in SHARED else "instance"), name, chosen),
                 legend if by or name not in SHARED else "all nodes")]
    group = "le, " + by if by else "le"
    prefix = legend + " " if by else ""
    return [("histogram_quantile(%s, sum by (%s) (rate(%s_bucket%s[$__rate_interval])))" % (share, group, name, chosen),
             "%s%d %%" % (prefix, round(100 * share))) for share in (0.5, 0.95)]


def panel(number, kind, name, text):
    per_second = "per second" if kind == "counter" else ""
    queries = [{"refId": chr(ord("A") + i), "expr": expression, "legendFormat": legend,
                "datasource": {"type": "prometheus", "uid": "${datasource}"}}
               for i, (expression, legend) in enumerate(targets(kind, name))]
    return {
        "id": number + 1,
        "type": "timeseries",
        "title": text.rstrip("."),
        "description": (name + " " + per_second).strip(),
        "datasource": {"type": "prometheus", "uid": "${datasource}"},
        "gridPos": {"x": number % COLUMNS * WIDTH, "y": number // COLUMNS * HEIGHT, "w": WIDTH, "h": HEIGHT},
        "fieldConfig": {"defaults": {"unit": unit(name), "min": 0}, "overrides": []},
        "options": {"legend": {"showLegend": True, "displayMode": "list", "placement": "bottom"}},
        "targets": queries,
    }


def dashboard():
    metrics = find_metrics(METRICS.read_text())
    return {
        "title": "Amhex",
        "uid": "amhex",
        "schemaVersion": 38,
        "version": 1,
        "refresh": "15s",
        "time": {"from": "now-1h", "to": "now"},
        "tags": ["amhex"],
        "templating": {"list": [
            {"name": "datasource", "type": "datasource", "query": "prometheus"},
            {"name": "instance", "type": "query", "query": "label_values(amhex_build_info, instance)",
             "datasource": {"type": "prometheus", "uid": "${datasource}"},
             "includeAll": True, "multi": True, "current": {"text": "All", "value": "$__all"}, "refresh": 2},
        ]},
        "panels": [panel(number, *metric) for number, metric in enumerate(metrics)],
    }


def main():
    text = json.dumps(dashboard(), indent=1) + "\n"
    if "--check" in sys.argv[1:]:
        if not OUTPUT.exists() or OUTPUT.read_text() != text:
            sys.exit("%s is not what %s makes; run it" % (OUTPUT.name, pathlib.Path(__file__).name))
        return
    OUTPUT.parent.mkdir(exist_ok=True)
    OUTPUT.write_text(text)


if __name__ == "__main__":
    main()
