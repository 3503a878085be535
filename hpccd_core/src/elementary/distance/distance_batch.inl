// SPDX-License-Identifier: Apache-2.0
// Included once per instruction set, after its header (base/simd/scalar.h). Like batch.inl, must not use the standard
// library at run time.

#include "base/simd/twice.h"
#include "elementary/distance/distance_batch.h"
#include "elementary/distance/proximity_test.h"
#include "elementary/distance/separation_test.h"

namespace hpccd::HPCCD_ISA {

#include "elementary/kdop_filter.inl"
#include "elementary/lane_groups.inl"
#include "elementary/pair_lanes.inl"

namespace {

#include "elementary/distance/search_lanes.inl"

// The separation of a pair, by its position in the batch, its features and their vertices.
HPCCD_HD double separation_at(const Geometry& g, std::uint32_t at, Kind kind, std::uint32_t first, std::uint32_t second,
                              const std::uint32_t* v) {
  if (g.separations.of_candidates) return g.separations.of_candidates[at];
  return g.separations.between(v[0], v[2]) + g.separations.thickness_of(kind, first, second);
}

// A margin for each pair: with that of the largest separation, few pairs are rejected where a few faces are much
// thicker than most. Where they are not, looking up the thickness takes longer than it saves. Rounding to floats, here
// of three values and a sum, is within the 1e-6 that KdopMargin adds.
template <Kind kind>
struct OwnMargin {
  const Geometry& g;
  const std::uint32_t *first, *second;
  HPCCD_HD Floats16 operator()(const PairAt& pair) const {
    const double d = separation_at(g, pair.at, kind, first[pair.at], second[pair.at], pair.v);
    return load16(g.margin_of_none.in) + load16(g.margin_of_one.in) * all16(static_cast<float>(d * g.kdop_scale));
  }
};

// Lanes filled by of_lane(lane), for separations that differ between pairs.
template <class OfLane>
HPCCD_HD Double separations(const Geometry& g, OfLane&& of_lane) {
  if (!g.separations.of_candidates && !g.separations.of_meshes && !g.separations.thick())
    return Double(g.separations.uniform);
  alignas(64) double d[double_width];
  for (int lane = 0; lane < double_width; ++lane) d[lane] = of_lane(lane);
  Double r;
  __builtin_memcpy(&r, d, sizeof r);
  return r;
}

template <Kind kind>
void test_separation(const Geometry& g, const std::uint32_t* first, const std::uint32_t* second, std::uint32_t n,
                     BatchResult& result) {
  result.n_contacts = result.n_undecided = 0;
  PairList list;
  const bool uneven = g.kdop_scale > 0;
  if (uneven)
    list_pairs<kind>(ApartByMore<OwnMargin<kind>>{{g, first, second}}, g, g.vertices, first, second, n, list);
  else
    list_pairs<kind>(ApartByMore<OneMargin>{{load16(g.margin.in)}}, g, g.vertices, first, second, n, list);
  const auto separations_of = [&](const auto& of) {
    return separations(g, [&](int lane) {
      const std::uint32_t at = list.at[of[lane]];
      return separation_at(g, at, kind, first[at], second[at], list.vertices[of[lane]]);
    });
  };

  std::uint64_t none = 0;
  std::uint32_t n_near = 0;
  const auto within_at_start = [&](unsigned lanes, const auto& of) {
    for (; lanes; lanes &= lanes - 1) {
      result.contact[result.n_contacts] = list.at[of[__builtin_ctz(lanes)]];
      result.toc[result.n_contacts] = result.delta[result.n_contacts] = 0;
      ++result.n_contacts;
    }
  };
  All all{list.n};
  Chosen beside;
  SearchLanes<kind, decltype(separations_of)> searches(g, list, separations_of, result);
  using Lanes = const Motion<Double>&;
  for_lanes<kind, Double>(g, list, all, [&](Lanes m, const LaneNumbers<All>& of) {
    const Double d = separations_of(of);
    unsigned near = 0;
    if (uneven && any(Double(9.0) * (d * d) > dot(m.a0, m.a0))) near = bits(corners_within<kind>(m, d)) & of.valid;
    within_at_start(near, of);
    n_near += static_cast<unsigned>(__builtin_popcount(near));
    if (near != of.valid) append(beside, of, of.valid & ~near & ~bits(planes_stay_apart(m, d)));
  });
  for_lanes<kind, Double>(g, list, beside, [&](Lanes m, const LaneNumbers<Chosen>& of) {
    const Double d = separations_of(of), s = extent(magnitudes(m));
    const Look<kind, Double> start = look<kind>(m, s, Double(0.0));
    const Outcome<Double> o = decided_by_ends(m, d, start, look<kind>(m, s, Double(1.0)));
    const unsigned within = bits(o.contact) & of.valid, apart = bits(o.none) & of.valid;
    within_at_start(within, of);
    none += static_cast<unsigned>(__builtin_popcount(apart));
    searches.begin(m, d, start, LaneNumbers<Chosen>{of.numbers, of.begin, of.valid & ~within & ~apart});
  });
  searches.end();

  result.counts.tested += n;
  result.counts.kdop += n - list.n;
  result.counts.coplanarity += list.n - n_near - beside.n;
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
  const auto limits_of = [&](const std::uint32_t* at) {
    return separations(g, [&](int lane) {
      std::uint32_t v[4];
      pair_vertices<kind>(g, first[at[lane]], second[at[lane]], v);
      return separation_at(g, at[lane], kind, first[at[lane]], second[at[lane]], v);
    });
  };
  const auto test = [&](const Snapshot<Double>& s, const std::uint32_t* at, unsigned valid) {
    const NearOrFar<Double> found = proximity_test<kind>(s, limits_of(at));
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
  };
  for_groups<FeaturesInSnapshot<kind>>(g, first, second, nullptr, n, test);
  for (std::uint32_t i = 0; i < result.n_undecided; ++i) result.apart_until[i] = 0;
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
