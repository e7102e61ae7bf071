"""JSON schemas of the Kubernetes objects in deploy/kubernetes and of deploy/compose.yaml, written from
the reference of each.

They are strict: a field they do not name is an error, so that a misspelt one is found. What they do
not know is whether a cluster has the storage class, the runtime class or KEDA.
"""

NAME = {"type": "string", "pattern": "^[a-z0-9]([-a-z0-9.]*[a-z0-9])?$", "maxLength": 253}
TEXT = {"type": "string", "minLength": 1}
LABELS = {"type": "object", "additionalProperties": {"type": "string", "maxLength": 63}}
QUANTITY = {"anyOf": [{"type": "string", "pattern": "^[0-9]+(\\.[0-9]+)?(m|k|Ki|M|Mi|G|Gi|T|Ti)?$"}, {"type": "integer"}]}
COUNT = {"type": "integer", "minimum": 0}
PORT = {"type": "integer", "minimum": 1, "maximum": 65535}
BOOLEAN = {"type": "boolean"}
NUMBER_TEXT = {"type": "string", "pattern": "^[0-9]+(\\.[0-9]+)?$"}


def record(required, **members):
    return {"type": "object", "required": required, "properties": members, "additionalProperties": False}


def many(item):
    return {"type": "array", "minItems": 1, "items": item}


SELECTOR = record([], matchLabels={**LABELS, "minProperties": 1})
METADATA = record(["name"], name=NAME, namespace=NAME, labels=LABELS, annotations={"type": "object", "additionalProperties": {"type": "string"}})
RESOURCES = record(["requests", "limits"],
                   requests={"type": "object", "additionalProperties": QUANTITY},
                   limits={"type": "object", "additionalProperties": QUANTITY})
PROBE = record(["grpc"], grpc=record(["port"], port=PORT, service=TEXT), periodSeconds=COUNT,
               timeoutSeconds=COUNT, failureThreshold=COUNT, initialDelaySeconds=COUNT)
ENVIRONMENT = record(["name"], name=TEXT, value={"type": "string"}, valueFrom={"oneOf": [
    record(["fieldRef"], fieldRef=record(["fieldPath"], fieldPath={"enum": ["metadata.name", "metadata.namespace", "status.podIP"]})),
    record(["secretKeyRef"], secretKeyRef=record(["name", "key"], name=NAME, key=TEXT))]})
CONTAINER = record(
    ["name", "image", "args", "ports", "livenessProbe", "readinessProbe", "startupProbe", "resources", "securityContext", "volumeMounts"],
    name=NAME, image=TEXT, args=many(TEXT), env=many(ENVIRONMENT),
    ports=many(record(["name", "containerPort"], name=NAME, containerPort=PORT)),
    livenessProbe=PROBE, readinessProbe=PROBE, startupProbe=PROBE, resources=RESOURCES,
    securityContext=record(
        ["allowPrivilegeEscalation", "readOnlyRootFilesystem", "capabilities"],
        allowPrivilegeEscalation={"const": False}, readOnlyRootFilesystem={"const": True},
        capabilities=record(["drop"], drop={"const": ["ALL"]})),
    volumeMounts=many(record(["name", "mountPath"], name=NAME, mountPath={"type": "string", "pattern": "^/"}, readOnly=BOOLEAN)))
POD = record(
    ["containers", "volumes", "securityContext", "terminationGracePeriodSeconds", "serviceAccountName", "automountServiceAccountToken"],
    serviceAccountName=NAME, automountServiceAccountToken={"const": False},
    terminationGracePeriodSeconds=COUNT, runtimeClassName=NAME,
    securityContext=record(
        ["runAsNonRoot", "runAsUser", "seccompProfile"],
        runAsNonRoot={"const": True}, runAsUser={"type": "integer", "minimum": 1}, runAsGroup=COUNT,
        fsGroup=COUNT, fsGroupChangePolicy={"enum": ["Always", "OnRootMismatch"]},
        seccompProfile=record(["type"], type={"const": "RuntimeDefault"})),
    tolerations=many(record(["key", "operator"], key=TEXT, operator={"enum": ["Exists", "Equal"]}, value=TEXT,
                            effect={"enum": ["NoSchedule", "PreferNoSchedule", "NoExecute"]})),
    topologySpreadConstraints=many(record(
        ["maxSkew", "topologyKey", "whenUnsatisfiable", "labelSelector"], maxSkew=COUNT, topologyKey=TEXT,
        whenUnsatisfiable={"enum": ["DoNotSchedule", "ScheduleAnyway"]}, labelSelector=SELECTOR)),
    containers=many(CONTAINER),
    volumes=many({"oneOf": [
        record(["name", "persistentVolumeClaim"], name=NAME, persistentVolumeClaim=record(["claimName"], claimName=NAME)),
        record(["name", "emptyDir"], name=NAME, emptyDir=record([], sizeLimit=QUANTITY, medium=TEXT))]}))

PEER = {"oneOf": [record(["namespaceSelector"], namespaceSelector=SELECTOR), record(["podSelector"], podSelector=SELECTOR)]}
POLICY_PORT = record(["port", "protocol"], port=PORT, protocol={"enum": ["TCP", "UDP"]})


def kind(api, name, **members):
    return {**record(["apiVersion", "kind", "metadata"] + list(members), apiVersion={"const": api},
                     kind={"const": name}, metadata=METADATA, **members)}


SCHEMAS = {
    "Namespace": kind("v1", "Namespace"),
    "ServiceAccount": kind("v1", "ServiceAccount", automountServiceAccountToken={"const": False}),
    "StatefulSet": kind("apps/v1", "StatefulSet", spec=record(
        ["serviceName", "selector", "template"], serviceName=NAME, replicas=COUNT, selector=SELECTOR,
        podManagementPolicy={"enum": ["OrderedReady", "Parallel"]},
        updateStrategy=record(["type"], type={"enum": ["RollingUpdate", "OnDelete"]}),
        template=record(["metadata", "spec"], spec=POD,
                        metadata=record(["labels"], labels=LABELS, annotations=LABELS)))),
    "Service": kind("v1", "Service", spec=record(
        ["selector", "ports"], clusterIP={"const": "None"}, publishNotReadyAddresses=BOOLEAN,
        selector={**LABELS, "minProperties": 1},
        ports=many(record(["name", "port", "targetPort"], name=NAME, port=PORT, targetPort=NAME, appProtocol=TEXT)))),
    "PersistentVolumeClaim": kind("v1", "PersistentVolumeClaim", spec=record(
        ["accessModes", "resources"], storageClassName=NAME,
        accessModes=many({"enum": ["ReadWriteOnce", "ReadOnlyMany", "ReadWriteMany", "ReadWriteOncePod"]}),
        resources=record(["requests"], requests=record(["storage"], storage=QUANTITY)))),
    "PodDisruptionBudget": kind("policy/v1", "PodDisruptionBudget", spec=record(
        ["selector", "maxUnavailable"], selector=SELECTOR, maxUnavailable=COUNT)),
    "NetworkPolicy": kind("networking.k8s.io/v1", "NetworkPolicy", spec=record(
        ["podSelector", "policyTypes", "ingress", "egress"], podSelector=SELECTOR,
        policyTypes={"const": ["Ingress", "Egress"]},
        ingress=many(record(["from", "ports"], **{"from": many(PEER), "ports": many(POLICY_PORT)})),
        egress=many(record(["ports"], to=many(PEER), ports=many(POLICY_PORT))))),
    "ScaledObject": kind("keda.sh/v1alpha1", "ScaledObject", spec=record(
        ["scaleTargetRef", "triggers"],
        scaleTargetRef=record(["apiVersion", "kind", "name"], apiVersion=TEXT, kind=TEXT, name=NAME),
        minReplicaCount=COUNT, maxReplicaCount=COUNT, pollingInterval=COUNT, cooldownPeriod=COUNT,
        advanced=record(["horizontalPodAutoscalerConfig"], horizontalPodAutoscalerConfig=record(
            ["behavior"], behavior=record(["scaleDown"], scaleDown=record(
                [], stabilizationWindowSeconds=COUNT,
                policies=many(record(["type", "value", "periodSeconds"], type={"enum": ["Pods", "Percent"]}, value=COUNT, periodSeconds=COUNT)))))),
        triggers=many(record(["type", "metadata", "authenticationRef"], type={"const": "postgresql"},
                             metadata=record(["query", "targetQueryValue"], query={"type": "string", "pattern": "^SELECT "},
                                             targetQueryValue=NUMBER_TEXT, activationTargetQueryValue=NUMBER_TEXT),
                             authenticationRef=record(["name"], name=NAME))))),
    "TriggerAuthentication": kind("keda.sh/v1alpha1", "TriggerAuthentication", spec=record(
        ["secretTargetRef"], secretTargetRef=many(record(["parameter", "name", "key"], parameter={"enum": ["connection", "password"]}, name=NAME, key=TEXT)))),
}

LOOPBACK_PORT = {"type": "string", "pattern": "^127\\.0\\.0\\.1:[0-9]+:[0-9]+$"}
COMPOSE_VOLUME = {"type": "string", "pattern": "^[^:]+:/[^:]*(:ro)?$"}
COMPOSE_SERVICE = record(
    ["image", "ports", "restart"], image=TEXT, ports=many(LOOPBACK_PORT), volumes=many(COMPOSE_VOLUME),
    build=record(["context", "dockerfile"], context=TEXT, dockerfile=TEXT, args={"type": "object", "additionalProperties": TEXT}),
    environment={"type": "object", "additionalProperties": {"type": "string"}}, depends_on=many(TEXT),
    read_only=BOOLEAN, tmpfs=many(TEXT), cap_drop=many(TEXT), security_opt=many(TEXT),
    stop_grace_period={"type": "string", "pattern": "^[0-9]+s$"}, restart={"enum": ["no", "always", "on-failure", "unless-stopped"]})
COMPOSE = record(["services", "volumes"], services={"type": "object", "additionalProperties": COMPOSE_SERVICE},
                 volumes={"type": "object", "additionalProperties": {"type": "null"}})
