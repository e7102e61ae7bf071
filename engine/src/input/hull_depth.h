// How deep the hierarchy over a hull's triangles can be.
#pragma once

namespace amhex {

// From this depth on nodes are halved by count, which bounds the depth by 64 + log2(2^31) and so
// the nodes that wait on a stack.
inline constexpr int kHullBalancedDepth = 64;
inline constexpr int kHullStackSize = 128;

}  // namespace amhex
