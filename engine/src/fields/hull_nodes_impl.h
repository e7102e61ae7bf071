// Finds what hull_nodes_task.h asks for: a template over the executor.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "exec/counted_list.h"
#include "exec/executor.h"
#include "exec/resident_arrays.h"
#include "exec/uploaded_arrays.h"
#include "fields/hull_nodes_task.h"
#include "input/hull_batch_impl.h"

namespace amhex::fields {

// Which nodes are next to the hull: 1 or 0.
struct IsAtHullBody {
  HullView hull;
  CellCentres cells;
  ArrayView<uint8_t> is_near;
  AMHEX_HD void operator()(int64_t i) const {
    is_near[i] = hull.IsWithin(cells[i], kHullReach * cells.side) ? 1 : 0;
  }
};
struct NodeAtHullSearch {
  using Item = int32_t;
  ArrayView<const uint8_t> is_near;
  template <class Visit>
  AMHEX_HD void VisitItems(int64_t i, const Visit& visit) const {
    if (is_near[i] != 0) visit(static_cast<int32_t>(i));
  }
};

// One element per node next to the hull.
struct FindConstraintsBody {
  HullView hull;
  ConstraintsOf question;
  ArrayView<const int32_t> nodes;
  ArrayView<HullConstraints> found;
  AMHEX_HD void operator()(int64_t k) const { found[k] = question(hull, nodes[k]); }
};
struct ConstraintSearch {
  using Item = HullConstraint;
  ArrayView<const HullConstraints> found;
  template <class Visit>
  AMHEX_HD void VisitItems(int64_t k, const Visit& visit) const {
    for (const HullConstraint& constraint : found[k]) visit(constraint);
  }
};

template <class T>
struct CopyArrayBody {
  ArrayView<const T> from;
  ArrayView<T> to;
  AMHEX_HD void operator()(int64_t i) const { to[i] = from[i]; }
};

template <class E>
struct FoundHullNodes {
  Buffer<E, int32_t> nodes;
  ListedItems<E, HullConstraint> demands;  // by place among the nodes
};

// Once stopped they mean nothing.
template <class E>
FoundHullNodes<E> FindHullNodes(E& executor, const HullView& hull, const CellCentres& cells) {
  Buffer<E, uint8_t> is_near = executor.template Alloc<uint8_t>(cells.count());
  executor.ForEach("find nodes at the hull", cells.count(),
                   IsAtHullBody{hull, cells, is_near.View()});
  Buffer<E, int32_t> nodes = ListItems(executor, "list nodes at the hull", cells.count(),
                                       NodeAtHullSearch{ReadOnly(is_near.View())});
  Buffer<E, HullConstraints> found = executor.template Alloc<HullConstraints>(nodes.size());
  executor.ForEach("find the hull's demands", nodes.size(),
                   FindConstraintsBody{hull, {cells}, ReadOnly(nodes.View()), found.View()});
  auto demands = ListItemsByElement(executor, "list the hull's demands", nodes.size(),
                                    ConstraintSearch{ReadOnly(found.View())});
  return {std::move(nodes), std::move(demands)};
}

// False if it was stopped.
template <class E>
bool TakeHullNodes(E& executor, const FoundHullNodes<E>& found, HullNodesTask& task) {
  if (executor.Stopped()) return false;
  const auto& [first, constraints] = found.demands;
  std::vector<int32_t> host_nodes(static_cast<size_t>(found.nodes.size()));
  std::vector<int32_t> host_first(static_cast<size_t>(first.size()));
  std::vector<HullConstraint> host_constraints(static_cast<size_t>(constraints.size()));
  executor.CopyOutLater(found.nodes, found.nodes.size(), host_nodes.data());
  executor.CopyOutLater(first, first.size(), host_first.data());
  executor.CopyOutLater(constraints, constraints.size(), host_constraints.data());
  executor.Synchronize();
  if (executor.Stopped()) return false;
  task.nodes = std::move(host_nodes), task.first = std::move(host_first);
  task.constraints = std::move(host_constraints);
  return true;
}

// Memory where bodies run, beyond what is there, as far as it is known before nodes are found:
// those take some 260 bytes each, which are refused, if need be, once their number is there.
template <class E>
int64_t HullNodesBytes(const HullNodesTask& task) {
  constexpr int64_t kOfNode = sizeof(uint8_t) + sizeof(int32_t);
  return ResidentHullBytes<E>(task.hull, *task.resident) + BytesOfViewsThere<E>(task.cells) +
         kOfNode * task.cells.count();
}

template <class E, class T>
ArrayView<const T> Kept(UploadedArrays<E>& arrays, ArrayView<const T> made) {
  const ArrayView<T> kept = arrays.template AddArray<T>(made.size);
  arrays.executor().ForEach("keep the hull's demands", made.size, CopyArrayBody<T>{made, kept});
  return ReadOnly(kept);
}

// On a device: leaves there what it finds. False if it was stopped.
template <class E>
bool FindHullNodesThere(E& executor, HullNodesTask& task) {
  UploadedArrays<E> arrays(executor);
  const HullView hull = ResidentHull<E>(task.hull, *task.resident);
  const FoundHullNodes<E> found = FindHullNodes(executor, hull, ViewsThere(arrays, task.cells));
  if (!TakeHullNodes(executor, found, task)) return false;
  ResidentData<E>(*task.there, [&found](UploadedArrays<E>& kept) {
    return HullNodes{Kept(kept, found.nodes.View()), Kept(kept, found.demands.first.View()),
                     Kept(kept, found.demands.items.View())};
  });
  return true;
}

}  // namespace amhex::fields
