#include "fields/owned_node_order.h"

#include "base/array_view_of.h"
#include "fields/field_loops.h"
#include "fields/node_links.h"

namespace amhex::fields {

OwnedNodeOrder::OwnedNodeOrder(ArrayView<const uint64_t> keys, const NodeLinks& links,
                               const RunContext& run)
    : number_of_(keys.size), neighbours_(6 * keys.size), codes_(3 * keys.size) {
  node_of_.reserve(keys.size);
  for (const bool is_even : {true, false}) {
    for (int64_t node = 0; node < keys.size; ++node) {
      if (IsOfEvenCell(keys[node]) != is_even) continue;
      number_of_[node] = static_cast<int32_t>(node_of_.size());
      node_of_.push_back(static_cast<int32_t>(node));
    }
    if (is_even) even_count_ = static_cast<int64_t>(node_of_.size());
  }
  ForEach(run, keys.size,
          RenumberLinksBody{links, View(), WritableViewOf(neighbours_), WritableViewOf(codes_)});
}

NodeOrder OwnedNodeOrder::View() const {
  return {ArrayViewOf(node_of_), ArrayViewOf(number_of_), even_count_};
}

NodeLinks OwnedNodeOrder::Links() const {
  return {ArrayViewOf(neighbours_), ArrayViewOf(codes_), RenamingsByCode()};
}

}  // namespace amhex::fields
