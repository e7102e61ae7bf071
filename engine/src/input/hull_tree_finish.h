// Bodies that make the hull's hierarchy of nodes that have been split (hull_tree_impl.h): bounds,
// depth-first order, dipoles.
#pragma once

#include <array>
#include <cstdint>

#include "base/array_view.h"
#include "input/hull_split.h"
#include "input/hull_tree_split.h"

namespace amhex {

// Per triangle of the input, and one more.
struct KeepTrianglesBody {
  ArrayView<const Vec3d> vertices;
  ArrayView<const std::array<int32_t, 3>> triangles;
  ArrayView<int32_t> is_kept;
  AMHEX_HD void operator()(int64_t i) const {
    bool keeps = false;
    if (i < triangles.size) {
      const auto& t = triangles[i];
      keeps = !IsDegenerate(vertices[t[0]], vertices[t[1]], vertices[t[2]]);
    }
    is_kept[i] = keeps ? 1 : 0;
  }
};

// Per triangle of the input.
struct TakeTrianglesBody {
  ArrayView<const Vec3d> vertices;
  ArrayView<const std::array<int32_t, 3>> triangles;
  ArrayView<const int32_t> kept_before;
  ArrayView<HullTriangle> taken;
  ArrayView<int32_t> original;
  AMHEX_HD void operator()(int64_t i) const {
    const int32_t place = kept_before[i];
    if (kept_before[i + 1] == place) return;
    const auto& t = triangles[i];
    taken[place] = {vertices[t[0]], vertices[t[1]], vertices[t[2]]};
    original[place] = static_cast<int32_t>(i);
  }
};

// Per triangle: all belong to the root.
struct BeginTreeBody {
  HullTreeNodes nodes;
  ArrayView<int32_t> order, place;
  AMHEX_HD void operator()(int64_t i) const {
    order[i] = static_cast<int32_t>(i);
    place[i] = 0;
    if (i == 0) nodes.begin[0] = 0, nodes.end[0] = static_cast<int32_t>(order.size);
  }
};

// Per triangle.
struct PutInLeafOrderBody {
  ArrayView<const HullTriangle> taken;
  ArrayView<const int32_t> taken_original;
  ArrayView<const int32_t> order;
  ArrayView<HullTriangle> triangles;
  ArrayView<Vec3d> normals;
  ArrayView<int32_t> original;
  AMHEX_HD void operator()(int64_t i) const {
    const HullTriangle t = taken[order[i]];
    triangles[i] = t;
    normals[i] = Normalized(DoubleAreaVector(t.a, t.b, t.c));
    original[i] = taken_original[order[i]];
  }
};

// Nodes with what is found from the leaves up and from the root down.
struct HullTreeShape {
  HullTreeNodes nodes;
  ArrayView<HullBox> box;
  ArrayView<int32_t> size;    // of the subtree
  ArrayView<int32_t> number;  // in depth-first order
};

// Per node of a level, after the levels below.
struct BoundNodesBody {
  HullTreeShape tree;
  ArrayView<const HullTriangle> triangles;
  int64_t first = 0;
  AMHEX_HD void operator()(int64_t j) const {
    const int64_t node = first + j;
    const int32_t left = tree.nodes.left[node];
    HullBox box;
    int32_t size = 1;
    if (left < 0) {
      for (int32_t i = tree.nodes.begin[node]; i < tree.nodes.end[node]; ++i) {
        box.Extend(triangles[i]);
      }
    } else {
      box = tree.box[left];
      box.Extend(tree.box[left + 1]);
      size += tree.size[left] + tree.size[left + 1];
    }
    tree.box[node] = box;
    tree.size[node] = size;
  }
};

// Per node of a level, after the levels above: numbers its children.
struct NumberNodesBody {
  HullTreeShape tree;
  int64_t first = 0;
  AMHEX_HD void operator()(int64_t j) const {
    const int64_t node = first + j;
    if (node == 0) tree.number[0] = 0;
    const int32_t left = tree.nodes.left[node];
    if (left < 0) return;
    // The root writes its own number and reads it in the same element.
    tree.number[left] = tree.number[node] + 1;
    tree.number[left + 1] = tree.number[node] + 1 + tree.size[left];
  }
};

// Per node.
struct WriteNodesBody {
  HullTreeShape tree;
  ArrayView<HullNode> out;
  AMHEX_HD void operator()(int64_t node) const {
    const int32_t left = tree.nodes.left[node];
    const HullBox& box = tree.box[node];
    out[tree.number[node]] = {box.low, box.high, tree.nodes.begin[node], tree.nodes.end[node],
                              left < 0 ? -1 : tree.number[left + 1]};
  }
};

// The triangles of nodes, in parts that are summed one by one.
struct HullParts {
  ArrayView<const HullNode> nodes;
  ArrayView<const HullTriangle> triangles;
  ArrayView<int32_t> first;  // [node, and one more] parts before it

  AMHEX_HD int64_t count() const { return first[nodes.size]; }
  AMHEX_HD int64_t NodeOf(int64_t part) const {
    int64_t low = 0, high = nodes.size;  // the last node that begins at or before the part
    while (high - low > 1) {
      const int64_t middle = (low + high) / 2;
      if (first[middle] <= part) {
        low = middle;
      } else {
        high = middle;
      }
    }
    return low;
  }
  AMHEX_HD const HullTriangle* Begin(int64_t part, int64_t node) const {
    return triangles.data + nodes[node].begin + (part - first[node]) * kTrianglesPerSum;
  }
  AMHEX_HD const HullTriangle* End(int64_t part, int64_t node) const {
    return Smaller(Begin(part, node) + kTrianglesPerSum, triangles.data + nodes[node].end);
  }
};

// Per node, and one more.
struct CountPartsBody {
  HullParts parts;
  AMHEX_HD void operator()(int64_t node) const {
    int32_t count = 0;
    if (node < parts.nodes.size) {
      const int32_t triangles = parts.nodes[node].end - parts.nodes[node].begin;
      count = (triangles + kTrianglesPerSum - 1) / kTrianglesPerSum;
    }
    parts.first[node] = count;
  }
};

// Per part, of which there may be fewer, then per node.
struct SumPartBody {
  HullParts parts;
  ArrayView<DipoleSums> sums;
  AMHEX_HD void operator()(int64_t part) const {
    if (part >= parts.count()) return;
    const int64_t node = parts.NodeOf(part);
    sums[part] = DipoleSums::Of(parts.Begin(part, node), parts.End(part, node));
  }
};
struct MakeDipolesBody {
  HullParts parts;
  ArrayView<const DipoleSums> sums;
  ArrayView<HullDipole> dipoles;
  AMHEX_HD void operator()(int64_t node) const {
    DipoleSums all;
    for (int32_t part = parts.first[node]; part < parts.first[node + 1]; ++part) {
      all.Add(sums[part]);
    }
    dipoles[node] = all.Dipole(parts.nodes[node]);
  }
};

// The same for what needs the dipole's centre.
struct PartMomentsBody {
  HullParts parts;
  ArrayView<const HullDipole> dipoles;
  ArrayView<DipoleMoments> moments;
  AMHEX_HD void operator()(int64_t part) const {
    if (part >= parts.count()) return;
    const int64_t node = parts.NodeOf(part);
    moments[part] =
        DipoleMoments::Of(parts.Begin(part, node), parts.End(part, node), dipoles[node].centre);
  }
};
struct AddMomentsBody {
  HullParts parts;
  ArrayView<const DipoleMoments> moments;
  ArrayView<HullDipole> dipoles;
  AMHEX_HD void operator()(int64_t node) const {
    DipoleMoments all;
    for (int32_t part = parts.first[node]; part < parts.first[node + 1]; ++part) {
      all.Add(moments[part]);
    }
    all.PutInto(dipoles[node]);
  }
};

}  // namespace amhex
