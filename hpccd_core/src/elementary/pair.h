// SPDX-License-Identifier: Apache-2.0
// Pairs of features, before and after the elementary test: vertex and face, or edges with first < second. The layout
// is the same on CPUs and devices.
#pragma once

#include <cstdint>

#include "elementary/motion.h"

namespace hpccd {

// A pair to be tested, or left undecided by a test.
struct Candidate {
  std::uint32_t first, second;
  Kind kind;
};

// The list of a contact determines its kind: a member for it would enlarge the struct, of which millions are sorted,
// from 16 to 24 bytes.
struct Contact {
  std::uint32_t first, second;
  double toc;
};

// The canonical order within one kind. No pair occurs twice, so the order is strict. An object: std::sort would call a
// function through its address.
inline constexpr auto before = [](const Contact& a, const Contact& b) {
  return a.first < b.first || (a.first == b.first && a.second < b.second);
};

}  // namespace hpccd
