// The order of node_order.h on the host.
#pragma once

#include <cstdint>
#include <vector>

#include "amhex/run_context.h"
#include "fields/node_order.h"

namespace amhex::fields {

// With the links between its numbers. O(nodes).
class OwnedNodeOrder {
 public:
  OwnedNodeOrder(ArrayView<const uint64_t> keys, const NodeLinks& links, const RunContext& run);
  NodeOrder View() const;
  NodeLinks Links() const;

 private:
  std::vector<int32_t> node_of_, number_of_;
  int64_t even_count_ = 0;
  std::vector<int32_t> neighbours_;
  std::vector<uint8_t> codes_;
};

}  // namespace amhex::fields
