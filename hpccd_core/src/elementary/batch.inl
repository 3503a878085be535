// SPDX-License-Identifier: Apache-2.0
// Included once per instruction set, after its header (base/simd/scalar.h). Uses nothing from the standard library at
// run time: an inline function compiled here could be linked into code for older processors.

#include "base/ticks.h"
#include "elementary/batch.h"
#include "elementary/filtered_test.h"

namespace hpccd::HPCCD_ISA {

#include "elementary/kdop_filter.inl"
#include "elementary/pair_lanes.inl"

template <Kind kind, class Policy, class R>
void test(const Geometry& g, const std::uint32_t* first, const std::uint32_t* second, std::uint32_t n,
          BatchResult& result) {
  using Lanes = const Motion<R>&;
  result.n_contacts = result.n_undecided = 0;
  std::uint32_t near[batch_capacity], single[batch_capacity], many[batch_capacity];
  std::uint32_t n_survivors = 0, n_single = 0, n_many = 0;

  const std::uint64_t began = ticks();
  const std::uint32_t n_near = !g.kdops      ? n
                               : g.until < 1 ? near_pairs<kind>(until(g), g, first, second, n, near)
                                             : near_pairs<kind>(Apart(), g, first, second, n, near);
  if (const std::uint64_t now = ticks(); now > began) result.counts.kdop_ticks += now - began;  // else on another core
  std::uint32_t n_apart = 0;
  for_lanes<kind, R>(g, first, second, g.kdops ? near : nullptr, n_near,
                     [&](Lanes m, const std::uint32_t* at, unsigned valid) {
                       const Magnitudes<R> size = magnitudes(m);
                       const CubicError<R> error = error_of<Policy>(size);
                       const Cubic<R> f = coplanarity(m);
                       const unsigned usable = bits(in_range(size));
                       const unsigned open = valid & ~(bits(certainly_no_root(f, error.coefficient)) & usable);
                       if (!open) return;
                       n_survivors += static_cast<unsigned>(__builtin_popcount(open));
                       const unsigned reach = open & ~(bits(certainly_outside<kind>(m, size)) & usable);
                       if (!reach) return;
                       const unsigned one = bits(certainly_one_root(f, error.coefficient)) & usable & reach;
                       unsigned apart = 0;
                       if (one) apart = bits(certainly_apart_at_root<kind>(m, size, f, error.value)) & one;
                       n_apart += static_cast<unsigned>(__builtin_popcount(apart));
                       append(single, n_single, at, one & ~apart);
                       append(many, n_many, at, reach & ~one);
                     });
  for_lanes<kind, R>(g, first, second, single, n_single, [&](Lanes m, const std::uint32_t* at, unsigned valid) {
    collect(single_root_test<kind, Policy>(m), at, valid, result);
  });
  for_lanes<kind, R>(g, first, second, many, n_many, [&](Lanes m, const std::uint32_t* at, unsigned valid) {
    collect(many_roots_test<kind, Policy>(m), at, valid, result);
  });

  result.counts.tested += n;
  result.counts.kdop += n - n_near;
  result.counts.coplanarity += n_near - n_survivors;
  result.counts.projection += n_survivors - n_single - n_many - n_apart;
  result.counts.roots += n_apart;
  result.counts.contacts += result.n_contacts;
  result.counts.undecided += result.n_undecided;
}

namespace {

void run(const Geometry& g, Kind kind, const std::uint32_t* first, const std::uint32_t* second, std::uint32_t n,
         BatchResult& result) {
  if (kind == Kind::vertex_face)
    test<Kind::vertex_face, Proven, Double>(g, first, second, n, result);
  else
    test<Kind::edge_edge, Proven, Double>(g, first, second, n, result);
}

void run_fast(const Geometry& g, Kind kind, const std::uint32_t* first, const std::uint32_t* second, std::uint32_t n,
              BatchResult& result) {
  if (kind == Kind::vertex_face)
    test<Kind::vertex_face, Likely, Single>(g, first, second, n, result);
  else
    test<Kind::edge_edge, Likely, Single>(g, first, second, n, result);
}

}  // namespace

BatchTest batch_test(Accuracy accuracy) { return accuracy == Accuracy::fast ? run_fast : run; }

}  // namespace hpccd::HPCCD_ISA
