// SPDX-License-Identifier: Apache-2.0
// Counters of the kernels, cleared before each frame, or before each submission of the hybrid.
#pragma once

#include <cstdint>

#include "base/hd.h"
#include "elementary/batch.h"
#include "gpu/device.h"

namespace hpccd::gpu {

using u32 = std::uint32_t;
using u64 = unsigned long long;

// The device's integers have one or two limbs per coordinate, like the CPU's fixed-size integers.
inline constexpr int integer_sizes = 2;

// Counters of one world.
struct WorldCounters {
  u64 extent_low[3], extent_high[3];  // maximum of the ordered bits, of low values negated: zero is neutral
  u64 floats_suffice;                 // for a fast frame: whether floats suffice (scene/edge_sample.h)
  // About the results; first_toc is the complement of the bits of the earliest time, first_key that of the first key.
  u64 hash, first_toc, first_key;
};

struct Counters {
  // For a single world. Several worlds have their own counters; then hash and first_toc here are those of all worlds.
  WorldCounters world;
  u64 bad;             // invalid coordinates
  u64 floats_suffice;  // for a fast frame: the number of worlds for which floats suffice
  u64 node_tests;
  u64 leaf_pairs, next_leaf_pair;
  u64 survivors[2], single[2], many[2], separated[2];                                        // of the current segment
  u64 all_survivors[2], all_single[2], all_many[2], most_survivors, most_single, most_many;  // of all segments
  u64 most_separated;
  u64 ignored[2];  // candidates dropped by filters
  u64 candidates[2], proven[2], undecided_of[2];
  u64 open[2];    // of the current segment: pairs that single precision leaves undecided
  u64 missed[2];  // apart at their only root in single precision: on none of the following lists
  u64 by_tolerance[2], by_extended[2],
      by_integers[2];  // pairs that the error bounds left undecided, by the stage that decided them
  u64 apart[2], proven_near[2], undecided_near[2];  // of tests with a distance
  u64 found[2];                                     // by kind, after the fallback on the device
  u64 found_all, undecided, open_in_integers[integer_sizes], to_host;
  u64 rows[2];                  // of the results, by kind
  u64 most_of_a_feature;        // rows with the same first feature
  u64 soonest, soonest_proven;  // complements of the bits of the earliest times
  u64 way, away;                // bits of the longest displacements along an axis (device_near_list.cuh)
  u64 listed[2];
  double area, looseness;  // Wear
};

// Checks that each pair that the error bounds left undecided was decided by some stage, or goes to the CPU; and for a
// snapshot, that each tested pair was found near, apart or undecided. Valid if no list was too short. False: the device
// has lost pairs.
HPCCD_HD bool books_balance(const Counters& c, bool of_snapshot) {
  u64 open = 0, settled = c.to_host;
  bool tested = true;
  for (int k = 0; k < 2; ++k) {
    open += c.undecided_of[k] + c.undecided_near[k];
    settled += c.by_tolerance[k] + c.by_extended[k] + c.by_integers[k];
    tested = tested && c.apart[k] + c.proven_near[k] + c.undecided_near[k] == c.all_survivors[k];
  }
  const bool decided = of_snapshot ? tested && open == c.to_host : open == c.undecided && settled == open;
  return decided && c.found[0] + c.found[1] == c.found_all;
}

inline void require_balance(const Counters& c, bool of_snapshot) {
  if (!books_balance(c, of_snapshot)) throw Error("the device has lost pairs that it had to decide; please report it");
}

// Outcomes of the pairs of one kind; on the host.
inline BatchCounts batch_counts(const Counters& c, int kind) {
  BatchCounts b;
  b.tested = c.candidates[kind];
  b.coplanarity = c.candidates[kind] - c.all_survivors[kind];
  b.separated = c.apart[kind];
  const u64 by_distance = c.apart[kind] + c.proven_near[kind] + c.undecided_near[kind];
  const u64 at_roots = c.all_single[kind] + c.all_many[kind] + c.missed[kind];
  b.projection = c.all_survivors[kind] - by_distance - at_roots;
  b.roots = at_roots - c.proven[kind] - c.undecided_of[kind];
  b.contacts = c.proven[kind] + c.proven_near[kind];
  b.undecided = c.undecided_of[kind] + c.undecided_near[kind];
  return b;
}

}  // namespace hpccd::gpu
