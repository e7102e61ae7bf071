#!/usr/bin/env python3
"""mesh_cloud.py SERVER: sends the points of a torus, with normals, and gets the mesh back as arrays.

Needs grpcio and the stubs, which protoc makes:

    protoc -I proto --python_out=stubs --grpc_out=stubs --plugin=protoc-gen-grpc=$(which grpc_python_plugin) \
        proto/amhex/v1/*.proto proto/google/rpc/*.proto
    PYTHONPATH=stubs examples/python/mesh_cloud.py localhost:50051
"""
import array
import hashlib
import math
import struct
import sys

import google
import grpc

# Debian's google package ends at its own folder; the stubs add google.rpc.
google.__path__ = [*google.__path__, *(f"{folder}/google" for folder in sys.path)]

from amhex.v1 import blob_service_pb2, blob_service_pb2_grpc, geometry_pb2, job_pb2
from amhex.v1 import meshing_service_pb2, meshing_service_pb2_grpc


def torus(count, large=2.0, small=0.8):
    """Points spread evenly by the golden ratio, and their normals."""
    points, normals = array.array("d"), array.array("d")
    for i in range(count):
        u, v = 2 * math.pi * i / count, 2 * math.pi * (i * 0.6180339887498949 % 1)
        # More points where the torus is wide.
        v += small / large * math.sin(v) * -0.5
        normal = (math.cos(v) * math.cos(u), math.cos(v) * math.sin(u), math.sin(v))
        ring = (large * math.cos(u), large * math.sin(u), 0.0)
        points.extend(r + small * n for r, n in zip(ring, normal))
        normals.extend(normal)
    return points, normals


def encode_cloud(points, normals):
    """INPUT_ENCODING_ARRAYS of proto/amhex/v1/geometry.proto."""
    return struct.pack("<8siiqq", b"AMHEXHUL", 1, 1, len(points) // 3, 0) + points.tobytes() + normals.tobytes()


def decode_mesh(data):
    """MESH_ENCODING_ARRAYS: vertices and corners as flat arrays, quality and types per cell."""
    magic, version, _, vertex_count, cell_count = struct.unpack_from("<8siiqq", data)
    assert magic == b"AMHEXVOL" and version == 1
    arrays, at = [], 32
    for code, length in (("d", 3 * vertex_count), ("i", 8 * cell_count), ("f", cell_count), ("B", cell_count)):
        values = array.array(code)
        values.frombytes(data[at:at + length * values.itemsize])
        arrays.append(values)
        at += length * values.itemsize
    return arrays


def main():
    channel = grpc.insecure_channel(sys.argv[1])
    mesher = meshing_service_pb2_grpc.MesherStub(channel)
    blobs = blob_service_pb2_grpc.BlobsStub(channel)

    request = meshing_service_pb2.SubmitJobRequest(
        inline_input=encode_cloud(*torus(6000)), input_encoding=geometry_pb2.INPUT_ENCODING_ARRAYS)
    request.params.sizing.cell_count = 1000
    job = mesher.SubmitJob(request).job
    for frame in mesher.WatchJob(meshing_service_pb2.WatchJobRequest(name=job.name)):
        if frame.HasField("stage"):
            print(job_pb2.Stage.Name(frame.stage.stage))
        if frame.HasField("job"):
            job = frame.job
    if job.HasField("error"):
        sys.exit(job.error.message)

    read = blob_service_pb2.ReadBlobRequest(blob=job.result.mesh)
    data = b"".join(chunk.data for chunk in blobs.ReadBlob(read))
    assert hashlib.sha256(data).hexdigest() == job.result.mesh.sha256
    vertices, corners, quality, types = decode_mesh(data)
    print(f"{len(types)} cells, {len(vertices) // 3} vertices, {len(corners)} corners, "
          f"least scaled Jacobian {min(quality):.3f}")


if __name__ == "__main__":
    main()
