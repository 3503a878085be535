// SPDX-License-Identifier: Apache-2.0
#include "contacts/order.h"

#include <algorithm>

namespace hpccd {

std::vector<Found> sorted(const std::vector<const std::vector<Found>*>& lists, ThreadPool& pool) {
  std::size_t n = 0;
  std::uint32_t most = 0;
  for (const auto* list : lists) {
    n += list->size();
    for (const Found& f : *list) most = std::max(most, f.first);
  }
  // Buckets by the first feature, about 256 contacts each, then each bucket on its own.
  const std::size_t n_buckets = std::clamp<std::size_t>(n / 256, 1, 4096);
  const double per_feature = static_cast<double>(n_buckets) / (static_cast<double>(most) + 1);
  const auto bucket_of = [&](const Found& f) { return static_cast<std::size_t>(f.first * per_feature); };
  std::vector<std::size_t> begin(n_buckets + 1, 0);
  for (const auto* list : lists)
    for (const Found& f : *list) ++begin[bucket_of(f) + 1];
  for (std::size_t b = 0; b < n_buckets; ++b) begin[b + 1] += begin[b];
  std::vector<Found> all(n);
  std::vector<std::size_t> next(begin.begin(), begin.end() - 1);
  for (const auto* list : lists)
    for (const Found& f : *list) all[next[bucket_of(f)]++] = f;
  parallel_for(pool, n_buckets, 16, [&](std::size_t from, std::size_t to, int) {
    for (std::size_t b = from; b < to; ++b)
      std::sort(all.begin() + static_cast<std::ptrdiff_t>(begin[b]),
                all.begin() + static_cast<std::ptrdiff_t>(begin[b + 1]), [](const Found& x, const Found& y) {
                  return x.first < y.first || (x.first == y.first && x.second < y.second);
                });
  });
  return all;
}

}  // namespace hpccd
