// SPDX-License-Identifier: Apache-2.0
// How fast this machine compares, computes and moves numbers, at the very most: what a benchmark holds the time of a
// step against. Nothing else uses it.
#pragma once

#include <cstddef>

#include "hpccd/hpccd.h"

namespace hpccd {

enum class Rate {
  comparisons,  // of floats, each with its part in a combined answer
  floats,       // multiplications and additions in single precision
  doubles,      // the same in double precision
  read,         // bytes
  copy,         // bytes, each read and written
};

// Per second, by so many threads at once (0: all cores), the best of several tries: 0.1 s in all. `bytes`: how much
// data they read or copy again and again, together; whichever cache holds it shows.
double machine_rate(Rate rate, Simd simd, int threads, std::size_t bytes);

}  // namespace hpccd
