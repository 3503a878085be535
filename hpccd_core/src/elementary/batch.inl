// SPDX-License-Identifier: Apache-2.0
// Included once per instruction set, after its header (base/simd/scalar.h). Must not use the standard library at run
// time: an inline function compiled here could be linked into code for older processors.

#include "base/simd/twice.h"
#include "base/ticks.h"
#include "elementary/batch.h"
#include "elementary/filtered_test.h"

namespace hpccd::HPCCD_ISA {

#include "elementary/kdop_filter.inl"
#include "elementary/pair_lanes.inl"

// Pairs that may touch, sorted by the tests that they still need.
struct Sorted {
  Chosen single, many;
};

// The cheap filters, for the chosen pairs: rejects pairs that are certainly apart, and sorts the rest by their possible
// roots.
template <Kind kind, class Policy, class R, class Numbers>
HPCCD_HD void sort_out(const Geometry& g, const PairList& list, Numbers& chosen, Sorted& out, BatchCounts& counts) {
  std::uint32_t n_survivors = 0, n_apart = 0;
  for_lanes<kind, R>(g, list, chosen, [&](const Motion<R>& m, const LaneNumbers<Numbers>& of) {
    const Magnitudes<R> size = magnitudes(m);
    const CubicError<R> error = error_of<Policy>(size);
    const Cubic<R> f = coplanarity(m);
    const unsigned usable = bits(in_range(size));
    const unsigned open = of.valid & ~(bits(certainly_no_root(f, error.coefficient)) & usable);
    if (!open) return;
    n_survivors += static_cast<unsigned>(__builtin_popcount(open));
    const unsigned one = bits(certainly_one_root(f, error.coefficient)) & usable & open;
    unsigned apart = 0;
    if (one) apart = bits(certainly_apart_at_root<kind>(m, size, f, error.value)) & one;
    n_apart += static_cast<unsigned>(__builtin_popcount(apart));
    append(out.single, of, one & ~apart);
    append(out.many, of, open & ~one);
  });
  counts.coplanarity += chosen.n - n_survivors;
  counts.roots += n_apart;
}

// For pairs without a certain root or with several: keeps those that do not stay outside in a projection. (Most pairs
// with one root are certainly apart at that root, which is cheaper to decide.)
template <Kind kind, class R>
HPCCD_HD void leave_out_outside(const Geometry& g, const PairList& list, Chosen& many, BatchCounts& counts) {
  Chosen left;
  for_lanes<kind, R>(g, list, many, [&](const Motion<R>& m, const LaneNumbers<Chosen>& of) {
    const Magnitudes<R> size = magnitudes(m);
    append(left, of, of.valid & ~bits(certainly_outside<kind>(m, size) && in_range(size)));
  });
  counts.projection += many.n - left.n;
  many.n = left.n;
  __builtin_memcpy(many.of, left.of, left.n * sizeof *left.of);
}

// Contacts and undecided pairs among the sorted ones. R: the type in which roots are computed.
template <Kind kind, class Policy, class R>
HPCCD_HD void seek_roots(const Geometry& g, const PairList& list, Sorted& sorted, Chosen& undecided,
                         BatchResult& result) {
  const auto take = [&](const Outcome<R>& o, const LaneNumbers<Chosen>& of) {
    collect(o, list, of, undecided, result);
  };
  for_lanes<kind, R>(g, list, sorted.single, [&](const Motion<R>& m, const LaneNumbers<Chosen>& of) {
    take(single_root_test<kind, Policy>(m), of);
  });
  for_lanes<kind, R>(g, list, sorted.many, [&](const Motion<R>& m, const LaneNumbers<Chosen>& of) {
    take(many_roots_test<kind, Policy>(m), of);
  });
}

template <Kind kind>
void list_touching(const Geometry& g, const std::uint32_t* first, const std::uint32_t* second, std::uint32_t n,
                   PairList& list, BatchCounts& counts) {
  const std::uint64_t began = ticks();
  const auto list_before = [&](const auto* next) { list_pairs<kind>(Apart(), g, next, first, second, n, list); };
  g.rounded ? list_before(g.rounded) : list_before(g.vertices);
  if (const std::uint64_t now = ticks(); now > began)
    counts.kdop_ticks += now - began;  // otherwise the thread has moved to another core
  counts.tested += n;
  counts.kdop += n - list.n;
}

// Root searches in double precision wait for each other's divisions: two registers of pairs side by side take three
// quarters of the time of one after the other.
template <Kind kind, class Numbers>
void test_in_doubles(const Geometry& g, const PairList& list, Numbers& chosen, Chosen& undecided, BatchResult& result) {
  Sorted sorted;
  sort_out<kind, Proven, Double>(g, list, chosen, sorted, result.counts);
  leave_out_outside<kind, Double>(g, list, sorted.many, result.counts);
  seek_roots<kind, Proven, Twice<Double>>(g, list, sorted, undecided, result);
}

// With rounded coordinates, most pairs are rejected at half the cost.
template <Kind kind>
void test_proven(const Geometry& g, const std::uint32_t* first, const std::uint32_t* second, std::uint32_t n,
                 BatchResult& result) {
  result.n_contacts = 0;
  PairList list;
  list_touching<kind>(g, first, second, n, list, result.counts);
  Chosen undecided;
  All all{list.n};
  if (g.rounded) {
    Sorted sieved;
    sort_out<kind, Sieve, Single>(g, list, all, sieved, result.counts);
    leave_out_outside<kind, Single>(g, list, sieved.many, result.counts);
    Sorted sorted;
    sort_out<kind, Proven, Double>(g, list, sieved.many, sorted, result.counts);
    append(sorted.single, sieved.single);
    seek_roots<kind, Proven, Twice<Double>>(g, list, sorted, undecided, result);
  } else {
    test_in_doubles<kind>(g, list, all, undecided, result);
  }
  // Only for the few undecided candidates, where it is cheap. It must run on every path, because later tests may use a
  // tolerance: for flying needles, one pair in 700 would otherwise be a false positive.
  leave_out_outside<kind, Double>(g, list, undecided, result.counts);
  report_undecided(list, undecided, result);
}

// Pairs that single precision leaves undecided, such as motions that are coplanar throughout, are tested in double
// precision.
template <Kind kind>
void test_likely(const Geometry& g, const std::uint32_t* first, const std::uint32_t* second, std::uint32_t n,
                 BatchResult& result) {
  result.n_contacts = 0;
  PairList list;
  list_touching<kind>(g, first, second, n, list, result.counts);
  Chosen open, undecided;
  All all{list.n};
  Sorted sorted;
  sort_out<kind, Likely, Single>(g, list, all, sorted, result.counts);
  leave_out_outside<kind, Single>(g, list, sorted.many, result.counts);
  seek_roots<kind, Likely, Single>(g, list, sorted, open, result);
  test_in_doubles<kind>(g, list, open, undecided, result);
  report_undecided(list, undecided, result);
}

namespace {

void run(const Geometry& g, Kind kind, const std::uint32_t* first, const std::uint32_t* second, std::uint32_t n,
         BatchResult& result) {
  kind == Kind::vertex_face ? test_proven<Kind::vertex_face>(g, first, second, n, result)
                            : test_proven<Kind::edge_edge>(g, first, second, n, result);
}

void run_fast(const Geometry& g, Kind kind, const std::uint32_t* first, const std::uint32_t* second, std::uint32_t n,
              BatchResult& result) {
  kind == Kind::vertex_face ? test_likely<Kind::vertex_face>(g, first, second, n, result)
                            : test_likely<Kind::edge_edge>(g, first, second, n, result);
}

}  // namespace

BatchTest batch_test(Accuracy accuracy) { return accuracy == Accuracy::fast ? run_fast : run; }

}  // namespace hpccd::HPCCD_ISA
