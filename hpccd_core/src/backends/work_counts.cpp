// SPDX-License-Identifier: Apache-2.0
#include "backends/work_counts.h"

namespace hpccd {
namespace {

void add_fallbacks(FallbackCounts& to, const FallbackCounts& more) {
  to.tolerance += more.tolerance, to.extended += more.extended, to.integers += more.integers;
}

}  // namespace

void WorkCounts::add(const std::vector<Worker>& workers) {
  for (const Worker& w : workers) {
    node_pairs += w.node_pairs, leaf_pairs += w.leaf_pairs;
    leaf_pairs_seconds += w.leaf_pairs_time.seconds();
    const double a_tick = w.elementary_ticks == 0 ? 0 : w.elementary_seconds / static_cast<double>(w.elementary_ticks);
    for (int k = 0; k < 3; ++k) {
      batches[k] += w.counts[k], ignored[k] += w.ignored[k];
      add_fallbacks(fallbacks[k], w.fallbacks[k]);
      kdop_seconds += a_tick * static_cast<double>(w.counts[k].kdop_ticks);
    }
  }
}

WorkCounts& WorkCounts::operator+=(const WorkCounts& c) {
  node_pairs += c.node_pairs, leaf_pairs += c.leaf_pairs, near_pairs += c.near_pairs;
  leaf_pairs_seconds += c.leaf_pairs_seconds, kdop_seconds += c.kdop_seconds;
  for (int k = 0; k < 3; ++k) {
    batches[k] += c.batches[k], ignored[k] += c.ignored[k];
    add_fallbacks(fallbacks[k], c.fallbacks[k]);
    asked[k] = asked[k] || c.asked[k];
  }
  earliest = earliest || c.earliest, timed = timed || c.timed;
  return *this;
}

void WorkCounts::write(std::map<std::string, std::uint64_t>& stats) const {
  const char* kinds[3] = {"vf", "ee", "ef"};
  stats["node_pairs"] += node_pairs;
  stats["leaf_pairs"] += leaf_pairs;
  for (int k = 0; k < 3; ++k) {
    if (!asked[k]) continue;
    const std::string kind = kinds[k];
    const BatchCounts& c = batches[k];
    stats[kind + "_candidates"] += c.tested;
    stats[kind + "_ignored"] += ignored[k];
    stats[kind + "_rejected_coplanarity"] += c.coplanarity;
    stats[kind + "_rejected_projection"] += c.projection;
    stats[kind + "_rejected_roots"] += c.roots;
    stats[kind + "_rejected_separated"] += c.separated;
    stats[kind + "_proven_contacts"] += c.contacts;
    stats[kind + "_undecided"] += c.undecided;
    stats[kind + "_by_integers"] += fallbacks[k].integers;
    if (k == 2) continue;  // edge-face pairs have neither k-DOPs nor a second fallback
    stats[kind + "_rejected_kdop"] += c.kdop;
    stats[kind + "_by_tolerance"] += fallbacks[k].tolerance;
    stats[kind + "_by_extended"] += fallbacks[k].extended;
  }
  if (earliest) stats["near_pairs"] += near_pairs;
  if (!timed) return;
  constexpr double ns = 1e9;
  stats["leaf_pairs_ns"] += static_cast<std::uint64_t>(ns * leaf_pairs_seconds);
  stats["kdop_ns"] += static_cast<std::uint64_t>(ns * kdop_seconds);
}

}  // namespace hpccd
