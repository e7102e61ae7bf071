// Items sorted where bodies run: by several numbers, the last one first.
#pragma once

#include <cstdint>

#include "exec/executor.h"

namespace amhex {

// A key is a structure with
//   AMHEX_HD uint32_t operator()(const Item& item) const;
template <class Item, class Key>
struct KeyItemsBody {
  ArrayView<const Item> items;
  Key key_of;
  ArrayView<uint32_t> key;
  ArrayView<int32_t> id;
  AMHEX_HD void operator()(int64_t i) const {
    key[i] = key_of(items[i]);
    id[i] = static_cast<int32_t>(i);
  }
};
template <class Item>
struct GatherItemsBody {
  ArrayView<const Item> items;
  ArrayView<const int32_t> order;
  ArrayView<Item> sorted;
  AMHEX_HD void operator()(int64_t i) const { sorted[i] = items[order[i]]; }
};

// Equal ones in their order.
template <class E, class Item, class Key>
Buffer<E, Item> SortedBy(E& executor, const Buffer<E, Item>& items, const Key& key,
                         uint32_t largest) {
  const int64_t count = items.size();
  KeyedIds<E> pairs{executor.template Alloc<uint32_t>(count),
                    executor.template Alloc<int32_t>(count)};
  KeyedIds<E> order{executor.template Alloc<uint32_t>(count),
                    executor.template Alloc<int32_t>(count)};
  executor.ForEach("take keys", count,
                   KeyItemsBody<Item, Key>{items.View(), key, pairs.key.View(), pairs.id.View()});
  executor.SortByKey(pairs, count, largest, order);
  Buffer<E, Item> sorted = executor.template Alloc<Item>(count);
  executor.ForEach("put in order", count,
                   GatherItemsBody<Item>{items.View(), ReadOnly(order.id.View()), sorted.View()});
  return sorted;
}

}  // namespace amhex
