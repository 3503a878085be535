// SPDX-License-Identifier: Apache-2.0
// Pairs of features, before and after the elementary test: vertex and face, or edges with first < second. The layout
// is the same on CPUs and devices.
#pragma once

#include <cstdint>

#include "elementary/motion.h"

namespace hpccd {

// To be tested, or left undecided by a test.
struct Candidate {
  std::uint32_t first, second;
  Kind kind;
};

// Its kind is that of the list it is in: with it 16 bytes, of which millions are sorted, would become 24.
struct Contact {
  std::uint32_t first, second;
  double toc;
};

// The canonical order within one kind. No pair is found twice, so it is strict. An object: std::sort calls a function
// through its address.
inline constexpr auto before = [](const Contact& a, const Contact& b) {
  return a.first < b.first || (a.first == b.first && a.second < b.second);
};

}  // namespace hpccd
