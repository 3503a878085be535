// SPDX-License-Identifier: Apache-2.0
// Gaps as one array for each field, all in one block of memory: a single copy brings them to a device.
#pragma once

#include <cstdint>
#include <cstring>
#include <functional>
#include <numeric>
#include <type_traits>
#include <utility>
#include <vector>

#include "hpccd/hpccd.h"

namespace hpccd {

class GapFields {
 public:
  struct Field {
    const char* name;
    char kind;  // 'i', 'u' or 'f'
    int item_bytes;
    std::vector<std::int64_t> row;  // its shape for one gap
    std::size_t begin;              // in the block
  };

  // Fields with larger numbers come first, so that each is aligned. Codes are 32 bits wide: PyTorch reads an index of 8
  // bits as a mask.
  explicit GapFields(const std::vector<Gap>& gaps) {
    add<double>("distance", 'f', {}, gaps, [](const Gap& g) { return &g.distance; });
    add<double>("points", 'f', {2, 3}, gaps, [](const Gap& g) { return g.points[0].data(); });
    add<double>("weights", 'f', {4}, gaps, [](const Gap& g) { return g.weights.data(); });
    add<double>("normal", 'f', {3}, gaps, [](const Gap& g) { return g.normal.data(); });
    add<std::uint32_t>("features", 'u', {4}, gaps, [](const Gap& g) { return g.features.data(); });
    add<std::uint32_t>("vertices", 'u', {4}, gaps, [](const Gap& g) { return g.vertices.data(); });
    add<std::int32_t>("kind", 'i', {}, gaps, [](const Gap& g) { return static_cast<std::int32_t>(g.kind); });
    add<std::int32_t>("inside", 'i', {}, gaps, [](const Gap& g) { return static_cast<std::int32_t>(g.inside); });
  }
  const std::vector<Field>& fields() const { return fields_; }
  const std::vector<unsigned char>& block() const { return block_; }

 private:
  // of(gap): a pointer to the first item, or the item itself.
  template <class Item, class Of>
  void add(const char* name, char kind, std::vector<std::int64_t> row, const std::vector<Gap>& gaps, Of&& of) {
    const std::int64_t items = std::accumulate(row.begin(), row.end(), std::int64_t{1}, std::multiplies<>());
    const std::size_t bytes = static_cast<std::size_t>(items) * sizeof(Item), begin = block_.size();
    fields_.push_back({name, kind, sizeof(Item), std::move(row), begin});
    block_.resize(begin + gaps.size() * bytes);
    unsigned char* to = block_.data() + begin;
    for (const Gap& gap : gaps) {
      const auto from = of(gap);
      if constexpr (std::is_pointer_v<decltype(of(gap))>)
        std::memcpy(to, from, bytes);
      else
        std::memcpy(to, &from, bytes);
      to += bytes;
    }
  }
  std::vector<Field> fields_;
  std::vector<unsigned char> block_;
};

}  // namespace hpccd
