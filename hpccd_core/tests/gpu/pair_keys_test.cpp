// SPDX-License-Identifier: Apache-2.0
// Devices sort pairs by their keys: the order of keys must be the canonical one, and each key must give its pair back.
#include "gpu/pair_keys.h"

#include <gtest/gtest.h>

#include <vector>

namespace hpccd::gpu {
namespace {

struct Sizes {
  std::uint32_t vertices, edges, faces;
};

std::vector<std::uint32_t> some_below(std::uint32_t n) {
  std::vector<std::uint32_t> numbers;
  for (const std::uint32_t i : {0u, 1u, n / 2, n - 1})
    if (i < n && (numbers.empty() || i > numbers.back())) numbers.push_back(i);
  return numbers;
}

// In the canonical order: vertex-face before edge-edge, by first and then second feature. First ones are numbered
// through all worlds.
std::vector<Candidate> some_pairs(const Sizes& n, std::uint32_t worlds) {
  std::vector<Candidate> pairs;
  for (const auto v : some_below(worlds * n.vertices))
    for (const auto f : some_below(n.faces)) pairs.push_back({v, f, Kind::vertex_face});
  for (const auto a : some_below(worlds * n.edges))
    for (const auto b : some_below(n.edges)) pairs.push_back({a, b, Kind::edge_edge});
  return pairs;
}

TEST(PairKeys, AscendInTheCanonicalOrderAndGiveTheirPairsBack) {
  constexpr std::uint32_t most = 0x7FFFFFFF;
  struct Case {
    Sizes n;
    std::uint32_t worlds;
  };
  for (const auto& [n, worlds] :
       {Case{{3, 3, 1}, 1}, Case{{100, 4, 7}, 1}, Case{{4, 100, 1}, 1}, Case{{5, 9, 5000}, 1},
        Case{{most, most, most}, 1}, Case{{3, 3, 1}, 65536}, Case{{1350, 4050, 2700}, 8192}}) {
    const PairKeys keys = PairKeys::of(n.vertices, n.edges, n.faces, worlds);
    u64 last = 0;
    bool first = true;
    for (const Candidate& pair : some_pairs(n, worlds)) {
      const u64 key = keys.key_of(pair.kind, pair.first, pair.second);
      EXPECT_TRUE(first || last < key);
      EXPECT_LT(key, u64{1} << keys.bits());
      const Candidate back = keys.pair_of(key);
      EXPECT_EQ(back.first, pair.first);
      EXPECT_EQ(back.second, pair.second);
      EXPECT_EQ(back.kind, pair.kind);
      last = key, first = false;
    }
  }
}

}  // namespace
}  // namespace hpccd::gpu
