// The faces of collect_faces_task.h with arrays where bodies run.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "exec/counted_list.h"
#include "exec/executor.h"
#include "exec/uploaded_arrays.h"
#include "topology/collect_faces_task.h"
#include "topology/edge_network_impl.h"
#include "topology/loop_search.h"

namespace amhex {

// Memory where bodies run. What is added to the network is some percent of it.
template <class E>
int64_t CollectFacesBytes(const CollectFacesTask& task) {
  return UploadedArrays<E>::Bytes(task.given) +
         NetworkBytes<E>(task.given.vertices.size, 2 * task.given.edges.size);
}

// The network with all that its quads and penta-loops add to it.
template <class E>
BuiltNetwork<E> CompleteNetwork(E& executor, const EdgesToSearch& given) {
  const auto count = static_cast<int32_t>(given.vertices.size);
  BuiltNetwork<E> network = BuildNetwork(executor, count, {{given.edges}});
  const QuadSearch quads{network.View()};
  const PentaLoopSearch loops{network.View()};
  const Buffer<E, VertexPair> diagonals = ListItems(executor, "find diagonals of poor quads", count,
                                                    DiagonalSearch{quads, given.vertices});
  const Buffer<E, VertexPair> across = ListItems(executor, "find edges across penta-loops", count,
                                                 SpiralEdgeSearch{loops, given.vertices});
  if (executor.Stopped() || diagonals.size() + across.size() == 0) return network;
  network = {};
  return BuildNetwork(executor, count, {{given.edges, diagonals.View(), across.View()}});
}

// False if it was stopped.
template <class E>
bool CollectAllFaces(E& executor, CollectFacesTask& task) {
  UploadedArrays<E> arrays(executor);
  const EdgesToSearch given = arrays.Upload(task.given);
  const int64_t count = given.vertices.size;
  const BuiltNetwork<E> network = CompleteNetwork(executor, given);
  const EdgeNetworkView view = network.View();
  const Buffer<E, CellFace> triangles =
      ListItems(executor, "find triangles", count, TriangleSearch{view});
  const Buffer<E, CellFace> quads = ListItems(executor, "find well-shaped quads", count,
                                              WellShapedQuadSearch{{view}, given.vertices});
  if (executor.Stopped()) return false;
  std::vector<CellFace> faces(static_cast<size_t>(triangles.size() + quads.size()));
  executor.CopyOutLater(triangles, triangles.size(), faces.data());
  executor.CopyOutLater(quads, quads.size(), faces.data() + triangles.size());
  executor.Synchronize();
  if (executor.Stopped()) return false;
  task.faces = std::move(faces);
  return true;
}

}  // namespace amhex
