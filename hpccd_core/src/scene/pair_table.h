// SPDX-License-Identifier: Apache-2.0
// One value for each pair of meshes. For few meshes this is a table of all pairs. For many meshes it is one default
// value and a hash table of the exceptions: with 8,000 bodies a table of all pairs would need 64 MB per byte.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "base/hd.h"

namespace hpccd {

// Read access without the standard library.
template <class T>
struct PairValues {
  static constexpr std::uint64_t free_slot = ~std::uint64_t{0};
  const T* all = nullptr;  // n_meshes^2 values; null: `otherwise`, except for pairs in the slots
  std::uint32_t n_meshes = 0;
  std::uint32_t slot_mask = 0;  // number of slots, a power of two, minus one
  const std::uint64_t* keys = nullptr;
  const T* values = nullptr;
  T otherwise{};

  HPCCD_HD static std::uint64_t key_of(std::uint32_t a, std::uint32_t b) {
    return a < b ? std::uint64_t{a} << 32 | b : std::uint64_t{b} << 32 | a;
  }
  // The slot of a key, or the free slot for it.
  HPCCD_HD std::uint32_t slot_of(std::uint64_t key) const {
    std::uint32_t slot = static_cast<std::uint32_t>((key * 0x9E3779B97F4A7C15u) >> 32) & slot_mask;
    while (keys[slot] != key && keys[slot] != free_slot) slot = (slot + 1) & slot_mask;
    return slot;
  }
  HPCCD_HD T of(std::uint32_t a, std::uint32_t b) const {
    if (all) return all[std::size_t{a} * n_meshes + b];
    if (!keys) return otherwise;
    const std::uint64_t key = key_of(a, b);
    const std::uint32_t slot = slot_of(key);
    return keys[slot] == key ? values[slot] : otherwise;
  }
};

template <class T>
class PairTable {
 public:
  static constexpr std::size_t most_in_table = 256;  // meshes

  PairTable(std::size_t n_meshes, T otherwise) : n_(n_meshes), otherwise_(otherwise) {
    if (has_all()) values_.assign(n_ * n_, otherwise);
  }

  T of(std::uint32_t a, std::uint32_t b) const { return has_all() ? in_table(a, b) : view().of(a, b); }
  // Requires has_all().
  T in_table(std::uint32_t a, std::uint32_t b) const { return values_[a * n_ + b]; }
  PairValues<T> view() const {
    const auto n = static_cast<std::uint32_t>(n_);
    if (has_all()) return {values_.data(), n, 0, nullptr, nullptr, otherwise_};
    if (keys_.empty()) return {nullptr, n, 0, nullptr, nullptr, otherwise_};
    return {nullptr, n, static_cast<std::uint32_t>(keys_.size() - 1), keys_.data(), values_.data(), otherwise_};
  }

  void set(std::uint32_t a, std::uint32_t b, T value) {
    if (has_all()) {
      values_[a * n_ + b] = values_[b * n_ + a] = value;
      return;
    }
    if (2 * (n_set_ + 1) > keys_.size()) enlarge();
    const std::uint64_t key = PairValues<T>::key_of(a, b);
    const std::uint32_t slot = view().slot_of(key);
    if (keys_[slot] != key) {
      if (partners_.empty()) partners_.resize(n_);
      add_partners(a, b);
      keys_[slot] = key, ++n_set_;
    }
    values_[slot] = value;
  }

  // Calls f(b, value) for the pairs of a mesh: for all pairs, or, without a table of all, only for pairs that were ever
  // set.
  bool has_all() const { return n_ <= most_in_table; }
  template <class Function>
  void for_pairs_of(std::uint32_t a, Function&& f) const {
    if (has_all())
      for (std::uint32_t b = 0; b < n_; ++b) f(b, values_[a * n_ + b]);
    else if (!partners_.empty())
      for (const std::uint32_t b : partners_[a]) f(b, of(a, b));
  }
  T otherwise() const { return otherwise_; }

  std::size_t bytes() const {
    std::size_t n = values_.capacity() * sizeof(T) + keys_.capacity() * sizeof(keys_[0]);
    for (const auto& p : partners_) n += sizeof p + p.capacity() * sizeof(std::uint32_t);
    return n;
  }

 private:
  // Adds both directions, or neither if memory runs out: otherwise a pair would count twice.
  void add_partners(std::uint32_t a, std::uint32_t b) {
    partners_[a].push_back(b);
    if (a == b) return;
    try {
      partners_[b].push_back(a);
    } catch (...) {
      partners_[a].pop_back();
      throw;
    }
  }
  void enlarge() {
    std::vector<std::uint64_t> keys(std::max<std::size_t>(16, 2 * keys_.size()), PairValues<T>::free_slot);
    std::vector<T> values(keys.size(), otherwise_);
    keys.swap(keys_), values.swap(values_);
    const PairValues<T> now = view();
    for (std::size_t i = 0; i < keys.size(); ++i)
      if (keys[i] != PairValues<T>::free_slot) {
        const std::uint32_t slot = now.slot_of(keys[i]);
        keys_[slot] = keys[i], values_[slot] = values[i];
      }
  }

  std::size_t n_;
  T otherwise_;
  std::size_t n_set_ = 0;
  std::vector<std::uint64_t> keys_;                   // empty if there is a table of all pairs
  std::vector<T> values_;                             // of all pairs, or by slot
  std::vector<std::vector<std::uint32_t>> partners_;  // by mesh: the other meshes with which it has a slot
};

}  // namespace hpccd
