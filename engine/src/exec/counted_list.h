// Lists of what elements have to tell, where bodies run: counted first, then written, so that they
// are in the order of the elements however these are spread.
#pragma once

#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "exec/executor.h"

namespace amhex {

// A search calls visit(item) for each item of an element, the same ones every time:
//   template <class Visit> AMHEX_HD void VisitItems(int64_t element, const Visit& visit) const;
// One element of this body per element of the search and one more, which gets zero.
template <class Search>
struct CountItemsBody {
  Search search;
  ArrayView<int32_t> count;
  AMHEX_HD void operator()(int64_t element) const {
    int32_t found = 0;
    if (element + 1 < count.size) {
      search.VisitItems(element, [&found](const typename Search::Item&) { ++found; });
    }
    count[element] = found;
  }
};

template <class Search>
struct ListItemsBody {
  using Item = typename Search::Item;
  Search search;
  ArrayView<const int32_t> first;  // [element] where its items go
  ArrayView<Item> items;
  AMHEX_HD void operator()(int64_t element) const {
    int64_t place = first[element];
    search.VisitItems(element, [&](const Item& item) {
      items[place] = item;
      ++place;
    });
  }
};

struct NumberBody {
  ArrayView<const int32_t> numbers;
  AMHEX_HD int64_t operator()(int64_t index) const { return numbers[index]; }
};

template <class E, class Item>
struct ListedItems {
  Buffer<E, int32_t> first;  // [element] where its items begin; at the end how many there are
  Buffer<E, Item> items;
};

// The items of elements 0 .. count-1. Waits for their number. Throws std::length_error, which names
// the search, if there are more than 32 bits can number. Once stopped there are none.
template <class E, class Search>
ListedItems<E, typename Search::Item> ListItemsByElement(E& executor, const char* description,
                                                         int64_t count, const Search& search) {
  using Item = typename Search::Item;
  Buffer<E, int32_t> first = executor.template Alloc<int32_t>(count + 1);
  executor.ForEach(description, count + 1, CountItemsBody<Search>{search, first.View()});
  const int64_t total = executor.Reduce(description, count, NumberBody{ReadOnly(first.View())});
  if (executor.Stopped()) return {std::move(first), executor.template Alloc<Item>(0)};
  if (total > std::numeric_limits<int32_t>::max()) {
    throw std::length_error(std::string(description) + ": there are " + std::to_string(total) +
                            ", limit " + std::to_string(std::numeric_limits<int32_t>::max()));
  }
  executor.ExclusiveScan(first, count + 1);
  Buffer<E, Item> items = executor.template Alloc<Item>(total);
  executor.ForEach(description, count,
                   ListItemsBody<Search>{search, ReadOnly(first.View()), items.View()});
  return {std::move(first), std::move(items)};
}

// The same where nobody asks whose items they are.
template <class E, class Search>
Buffer<E, typename Search::Item> ListItems(E& executor, const char* description, int64_t count,
                                           const Search& search) {
  return ListItemsByElement(executor, description, count, search).items;
}

// Memory where bodies run, for as many elements and items, but for what sums and scans need.
template <class Search>
int64_t ListItemsBytes(int64_t count, int64_t item_count) {
  return count * static_cast<int64_t>(sizeof(int32_t)) +
         item_count * static_cast<int64_t>(sizeof(typename Search::Item));
}

}  // namespace amhex
