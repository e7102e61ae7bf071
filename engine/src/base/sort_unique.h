// Lists as ascending sets.
#pragma once

#include <algorithm>
#include <vector>

namespace amhex {

// Ascending, each once.
template <class Item>
void SortUnique(std::vector<Item>& items) {
  std::sort(items.begin(), items.end());
  items.erase(std::unique(items.begin(), items.end()), items.end());
}

}  // namespace amhex
