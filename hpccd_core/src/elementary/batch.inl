// SPDX-License-Identifier: Apache-2.0
// Included once per instruction set, with HPCCD_ISA naming the set and Real its lane type. Uses nothing from the
// standard library at run time: an inline function compiled here could be linked into code for older processors.

#include "elementary/batch.h"
#include "elementary/certified.h"

namespace hpccd::HPCCD_ISA {

inline constexpr int W = RealTraits<Real>::width;

template <Kind kind>
HPCCD_HD void vertex_indices(const Geometry& g, std::uint32_t first, std::uint32_t second, std::uint32_t out[4]) {
  if constexpr (kind == Kind::vertex_face) {
    const std::uint32_t* f = reinterpret_cast<const std::uint32_t*>(g.faces) + 3 * static_cast<std::size_t>(second);
    out[0] = first, out[1] = f[0], out[2] = f[1], out[3] = f[2];
  } else {
    const std::uint32_t* e = reinterpret_cast<const std::uint32_t*>(g.edges);
    const std::uint32_t *a = e + 2 * static_cast<std::size_t>(first), *b = e + 2 * static_cast<std::size_t>(second);
    out[0] = a[0], out[1] = a[1], out[2] = b[0], out[3] = b[1];
  }
}

// Rows of the vectors of motion.h, one pair after the other, turned into lanes.
template <Kind kind>
HPCCD_HD Motion<Real> load(const Geometry& g, const std::uint32_t* first, const std::uint32_t* second) {
  alignas(64) double column[18][W];
  for (int lane = 0; lane < W; ++lane) {
    std::uint32_t v[4];
    vertex_indices<kind>(g, first[lane], second[lane], v);
    const VertexRow &q0 = g.vertices[v[0]], &q1 = g.vertices[v[1]], &q2 = g.vertices[v[2]], &q3 = g.vertices[v[3]];
    for (int k = 0; k < 3; ++k) {
      if constexpr (kind == Kind::vertex_face) {
        column[k][lane] = q0.t0[k] - q1.t0[k], column[9 + k][lane] = q0.t1[k] - q1.t1[k];
        column[3 + k][lane] = q2.t0[k] - q1.t0[k], column[12 + k][lane] = q2.t1[k] - q1.t1[k];
        column[6 + k][lane] = q3.t0[k] - q1.t0[k], column[15 + k][lane] = q3.t1[k] - q1.t1[k];
      } else {
        column[k][lane] = q2.t0[k] - q0.t0[k], column[9 + k][lane] = q2.t1[k] - q0.t1[k];
        column[3 + k][lane] = q1.t0[k] - q0.t0[k], column[12 + k][lane] = q1.t1[k] - q0.t1[k];
        column[6 + k][lane] = q3.t0[k] - q2.t0[k], column[15 + k][lane] = q3.t1[k] - q2.t1[k];
      }
    }
  }
  const auto lanes = [&](int c) {
    Real r;
    __builtin_memcpy(&r, column[c], sizeof r);
    return r;
  };
  return {{lanes(0), lanes(1), lanes(2)},   {lanes(3), lanes(4), lanes(5)},   {lanes(6), lanes(7), lanes(8)},
          {lanes(9), lanes(10), lanes(11)}, {lanes(12), lanes(13), lanes(14)}, {lanes(15), lanes(16), lanes(17)}};
}

// The pairs at `where`, W at a time; the last group is filled up with copies of the last pair.
template <Kind kind, class Function>
HPCCD_HD void for_lanes(const Geometry& g, const std::uint32_t* first, const std::uint32_t* second,
                        const std::uint32_t* where, std::uint32_t n, Function&& function) {
  for (std::uint32_t i = 0; i < n; i += W) {
    std::uint32_t a[W], b[W], at[W];
    for (int lane = 0; lane < W; ++lane) {
      const std::uint32_t j = i + lane < n ? i + lane : n - 1;
      at[lane] = where ? where[j] : j;
      a[lane] = first[at[lane]];
      b[lane] = second[at[lane]];
    }
    const unsigned valid = n - i >= W ? (1u << W) - 1 : (1u << (n - i)) - 1;
    function(load<kind>(g, a, b), at, valid);
  }
}

HPCCD_HD void append(std::uint32_t* list, std::uint32_t& n, const std::uint32_t* at, unsigned lanes) {
  for (; lanes; lanes &= lanes - 1) list[n++] = at[__builtin_ctz(lanes)];
}

HPCCD_HD void collect(const Outcome<Real>& o, const std::uint32_t* at, unsigned valid, BatchResult& result) {
  const unsigned contact = bits(o.contact) & valid, none = bits(o.none) & valid;
  alignas(64) double toc[W], delta[W];
  __builtin_memcpy(toc, &o.toc, sizeof toc);
  __builtin_memcpy(delta, &o.delta, sizeof delta);
  for (unsigned lanes = contact; lanes; lanes &= lanes - 1) {
    const int lane = __builtin_ctz(lanes);
    result.contact[result.n_contacts] = at[lane];
    result.toc[result.n_contacts] = toc[lane];
    result.delta[result.n_contacts++] = delta[lane];
  }
  append(result.undecided, result.n_undecided, at, valid & ~contact & ~none);
  result.counts.roots += static_cast<unsigned>(__builtin_popcount(none));
}

template <Kind kind>
void test(const Geometry& g, const std::uint32_t* first, const std::uint32_t* second, std::uint32_t n,
          BatchResult& result) {
  result.n_contacts = result.n_undecided = 0;
  std::uint32_t survivors[batch_capacity], single[batch_capacity], many[batch_capacity];
  std::uint32_t n_survivors = 0, n_single = 0, n_many = 0;

  for_lanes<kind>(g, first, second, nullptr, n, [&](const Motion<Real>& m, const std::uint32_t* at, unsigned valid) {
    append(survivors, n_survivors, at, valid & ~bits(coplanarity_filter(m).none));
  });

  for_lanes<kind>(g, first, second, survivors, n_survivors,
                  [&](const Motion<Real>& m, const std::uint32_t* at, unsigned valid) {
                    const Magnitudes<Real> size = magnitudes(m);
                    const unsigned usable = bits(in_range(size));
                    const unsigned outside = bits(certainly_outside<kind>(m, size)) & usable;
                    const unsigned one =
                        bits(certainly_one_root(coplanarity(m), coplanarity_error(size).coefficient)) & usable;
                    append(single, n_single, at, valid & ~outside & one);
                    append(many, n_many, at, valid & ~outside & ~one);
                  });

  for_lanes<kind>(g, first, second, single, n_single,
                  [&](const Motion<Real>& m, const std::uint32_t* at, unsigned valid) {
                    collect(single_root_test<kind>(m), at, valid, result);
                  });
  for_lanes<kind>(g, first, second, many, n_many,
                  [&](const Motion<Real>& m, const std::uint32_t* at, unsigned valid) {
                    collect(many_roots_test<kind>(m), at, valid, result);
                  });

  result.counts.tested += n;
  result.counts.coplanarity += n - n_survivors;
  result.counts.projection += n_survivors - n_single - n_many;
  result.counts.contacts += result.n_contacts;
  result.counts.undecided += result.n_undecided;
}

void run(const Geometry& g, Kind kind, const std::uint32_t* first, const std::uint32_t* second, std::uint32_t n,
         BatchResult& result) {
  if (kind == Kind::vertex_face)
    test<Kind::vertex_face>(g, first, second, n, result);
  else
    test<Kind::edge_edge>(g, first, second, n, result);
}

}  // namespace hpccd::HPCCD_ISA
