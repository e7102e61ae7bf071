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

// Whether an ascending vector has the value.
template <class T>
bool IsAmong(const std::vector<T>& ascending, const T& value) {
  return std::binary_search(ascending.begin(), ascending.end(), value);
}

}  // namespace amhex
