// SPDX-License-Identifier: Apache-2.0
// Tests of a frame in which some pairs have a separation (elementary/distance/separation_test.h), one thread per pair.
#include "elementary/distance/separation_test.h"
#include "gpu/candidates.cuh"
#include "gpu/elementary.cuh"
#include "gpu/stages.cuh"

namespace hpccd::gpu {

// Tests both ends of the step, for pairs with a separation; the others go to their root tests.
template <Kind kind, class T>
__global__ __launch_bounds__(128) void separation_filter_kernel(const __grid_constant__ LaunchParams<T> params) {
  constexpr u32 k = kind == Kind::edge_edge;
  u32 n_within = 0, n_apart = 0;
  for_pairs(params.survivors[k], params.counters->survivors[k], [&](bool valid, uint2 pair) {
    bool within = false, open = false;
    RootTests without{false, false};
    if (valid) {
      const uint4 v = vertices_of<kind>(params, pair.x, pair.y);
      const double d = separation_of(params, kind, pair, v.x, v.z);
      if (d > 0) {
        const Outcome<double> o = separation_filter<kind>(load_motion<kind>(params.vertices, v), d);
        within = o.contact;
        open = !o.contact && !o.none;
        n_within += o.contact;
        n_apart += o.none;
      } else {
        without = root_tests<kind>(params, pair);
      }
    }
    append_found(params, kind, within, pair, 0);
    append_pair(params.separated[k], &params.counters->separated[k], open, pair);
    append_to_root_tests(params, k, pair, without);
  });
  add_up(&params.counters->found[k], n_within);
  add_up(&params.counters->proven_near[k], n_within);
  add_up(&params.counters->apart[k], n_apart);
}

template <Kind kind, class T>
__global__ __launch_bounds__(128) void separation_kernel(const __grid_constant__ LaunchParams<T> params) {
  constexpr u32 k = kind == Kind::edge_edge;
  u32 n_contacts = 0, n_apart = 0, n_undecided = 0;
  for_pairs(params.separated[k], params.counters->separated[k], [&](bool valid, uint2 pair) {
    bool contact = false, undecided = false;
    double toc = 0;
    if (valid) {
      const uint4 v = vertices_of<kind>(params, pair.x, pair.y);
      const Outcome<double> o =
          separation_test<kind>(load_motion<kind>(params.vertices, v), separation_of(params, kind, pair, v.x, v.z));
      contact = o.contact;
      undecided = !o.contact && !o.none;
      toc = reported_time(reported_as(params, v), o.toc, o.delta);
      n_apart += o.none;
    }
    append_found(params, kind, contact, pair, toc);
    append_undecided(params, kind, undecided, pair);
    n_contacts += contact;
    n_undecided += undecided;
  });
  add_up(&params.counters->found[k], n_contacts);
  add_up(&params.counters->proven_near[k], n_contacts);
  add_up(&params.counters->apart[k], n_apart);
  add_up(&params.counters->undecided_near[k], n_undecided);
}

template <class T>
void launch_separation_candidates(const LaunchParams<T>& params, const Stages& stages) {
  stages.persistent(params.filtered ? candidates_kernel<Query::separations, true, T>
                                    : candidates_kernel<Query::separations, false, T>,
                    32 * candidate_warps, params, "candidates_kernel");
  stages.mark("candidates");
}

template <class T>
void launch_separations(const LaunchParams<T>& params, const Stages& stages) {
  stages.persistent(separation_filter_kernel<Kind::vertex_face, T>, 128, params, "separation_filter_kernel");
  stages.persistent(separation_filter_kernel<Kind::edge_edge, T>, 128, params, "separation_filter_kernel");
  stages.mark("separation_filter");
  stages.persistent(separation_kernel<Kind::vertex_face, T>, 128, params, "separation_kernel");
  stages.persistent(separation_kernel<Kind::edge_edge, T>, 128, params, "separation_kernel");
  stages.mark("separation");
}

template void launch_separation_candidates(const LaunchParams<float>&, const Stages&);
template void launch_separation_candidates(const LaunchParams<double>&, const Stages&);
template void launch_separations(const LaunchParams<float>&, const Stages&);
template void launch_separations(const LaunchParams<double>&, const Stages&);

}  // namespace hpccd::gpu
