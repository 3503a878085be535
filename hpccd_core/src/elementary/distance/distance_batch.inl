// SPDX-License-Identifier: Apache-2.0
// Included once per instruction set, after its header (base/simd/scalar.h). As batch.inl, uses nothing from the
// standard library at run time.

#include "elementary/distance/distance_batch.h"
#include "elementary/distance/proximity_test.h"
#include "elementary/distance/separation_test.h"

namespace hpccd::HPCCD_ISA {

#include "elementary/kdop_filter.inl"
#include "elementary/pair_lanes.inl"

namespace {

// Of the pairs at `at`, which the batch names by their positions.
template <Kind kind>
HPCCD_HD Double separations_at(const Geometry& g, const std::uint32_t* first, const std::uint32_t* second,
                               const std::uint32_t* at) {
  const bool listed = g.separations.of_candidates;
  if (!listed && !g.separations.of_meshes) return Double(g.separations.uniform);
  alignas(64) double d[double_width];
  for (int lane = 0; lane < double_width; ++lane) {
    if (listed) {
      d[lane] = g.separations.of_candidates[at[lane]];
      continue;
    }
    std::uint32_t v[4];
    pair_vertices<kind>(g, first[at[lane]], second[at[lane]], v);
    d[lane] = g.separations.between(v[0], v[2]);
  }
  Double r;
  __builtin_memcpy(&r, d, sizeof r);
  return r;
}

template <Kind kind>
void test_separation(const Geometry& g, const std::uint32_t* first, const std::uint32_t* second, std::uint32_t n,
                     BatchResult& result) {
  using Lanes = const Motion<Double>&;
  result.n_contacts = result.n_undecided = 0;
  std::uint32_t near[batch_capacity], beside[batch_capacity], open[batch_capacity], n_beside = 0, n_open = 0;
  std::uint64_t none = 0;

  const std::uint32_t n_near = !g.kdops ? n
                               : g.until < 1
                                   ? near_pairs<kind>(until(g), g, first, second, n, near)
                                   : near_pairs<kind>(ApartByMore{load16(g.margin.in)}, g, first, second, n, near);
  const std::uint32_t* const where = g.kdops ? near : nullptr;
  for_lanes<kind, Double>(g, first, second, where, n_near, [&](Lanes m, const std::uint32_t* at, unsigned valid) {
    const Double d = separations_at<kind>(g, first, second, at);
    append(beside, n_beside, at, valid & ~bits(planes_stay_apart(m, d)));
  });
  for_lanes<kind, Double>(g, first, second, beside, n_beside, [&](Lanes m, const std::uint32_t* at, unsigned valid) {
    const Outcome<Double> o = separation_filter<kind>(m, separations_at<kind>(g, first, second, at));
    const unsigned within = bits(o.contact) & valid, apart = bits(o.none) & valid;
    for (unsigned lanes = within; lanes; lanes &= lanes - 1) {
      result.contact[result.n_contacts] = at[__builtin_ctz(lanes)];
      result.toc[result.n_contacts] = result.delta[result.n_contacts] = 0;
      ++result.n_contacts;
    }
    append(open, n_open, at, valid & ~within & ~apart);
    none += static_cast<unsigned>(__builtin_popcount(apart));
  });
  for_lanes<kind, Double>(g, first, second, open, n_open, [&](Lanes m, const std::uint32_t* at, unsigned valid) {
    collect(separation_test<kind>(m, separations_at<kind>(g, first, second, at)), at, valid, result);
  });

  result.counts.tested += n;
  result.counts.kdop += n - n_near;
  result.counts.coplanarity += n_near - n_beside;
  result.counts.separated += none;
  result.counts.contacts += result.n_contacts;
  result.counts.undecided += result.n_undecided;
}

template <Kind kind>
struct FeaturesInSnapshot {
  static constexpr int width = double_width;
  HPCCD_HD static Snapshot<Double> load(const Geometry& g, const std::uint32_t* first, const std::uint32_t* second) {
    using S = Spans<kind>;
    const double* at[4][width];
    for (int lane = 0; lane < width; ++lane) {
      std::uint32_t v[4];
      pair_vertices<kind>(g, first[lane], second[lane], v);
      for (int i = 0; i < 4; ++i) at[i][lane] = g.vertices[v[i]].t0;
    }
    PointRows rows[4];
    for (int i = 0; i < 4; ++i) rows[i] = point_rows(at[i]);
    const auto span = [&](int to, int from) { return transposed(difference(rows[to], rows[from])); };
    return {span(S::p_to, S::p_from), span(S::a_to, S::a_from), span(S::b_to, S::b_from)};
  }
};

template <Kind kind>
void test_proximity(const Geometry& g, const std::uint32_t* first, const std::uint32_t* second, std::uint32_t n,
                    BatchResult& result) {
  result.n_contacts = result.n_undecided = 0;
  std::uint64_t none = 0;
  for_groups<FeaturesInSnapshot<kind>>(
      g, first, second, nullptr, n, [&](const Snapshot<Double>& s, const std::uint32_t* at, unsigned valid) {
        const NearOrFar<Double> found = proximity_test<kind>(s, separations_at<kind>(g, first, second, at));
        const unsigned near = bits(found.near) & valid, far = bits(found.far) & valid;
        alignas(64) double distance[double_width];
        __builtin_memcpy(distance, &found.distance, sizeof distance);
        for (unsigned lanes = near; lanes; lanes &= lanes - 1) {
          const int lane = __builtin_ctz(lanes);
          result.contact[result.n_contacts] = at[lane];
          result.toc[result.n_contacts] = distance[lane];
          result.delta[result.n_contacts++] = 0;
        }
        append(result.undecided, result.n_undecided, at, valid & ~near & ~far);
        none += static_cast<unsigned>(__builtin_popcount(far));
      });
  result.counts.tested += n;
  result.counts.separated += none;
  result.counts.contacts += result.n_contacts;
  result.counts.undecided += result.n_undecided;
}

void run_separation(const Geometry& g, Kind kind, const std::uint32_t* first, const std::uint32_t* second,
                    std::uint32_t n, BatchResult& result) {
  if (kind == Kind::vertex_face)
    test_separation<Kind::vertex_face>(g, first, second, n, result);
  else
    test_separation<Kind::edge_edge>(g, first, second, n, result);
}

void run_proximity(const Geometry& g, Kind kind, const std::uint32_t* first, const std::uint32_t* second,
                   std::uint32_t n, BatchResult& result) {
  if (kind == Kind::vertex_face)
    test_proximity<Kind::vertex_face>(g, first, second, n, result);
  else
    test_proximity<Kind::edge_edge>(g, first, second, n, result);
}

}  // namespace

BatchTest separation_batch() { return run_separation; }
BatchTest proximity_batch() { return run_proximity; }

}  // namespace hpccd::HPCCD_ISA
