// SPDX-License-Identifier: Apache-2.0
#include "backends/gpu_worlds.h"

#include <algorithm>
#include <functional>

#include "backends/gpu_contacts.h"
#include "backends/world_positions.h"

namespace hpccd {
namespace {

template <class X>
std::vector<X> copied(const X* from, std::size_t n) {
  return {from, from + n};
}

}  // namespace

Contacts contacts_of(const gpu::FrameResult& f, std::size_t n_worlds, ThreadPool& pool) {
  Contacts c;
  const std::function<void()> parts[] = {
      [&] { c.ee = copied(f.ee, f.n_ee); }, [&] { c.ee_toc = copied(f.toc + f.n_vf, f.n_ee); },
      [&] { c.vf = copied(f.vf, f.n_vf); }, [&] { c.vf_toc = copied(f.toc, f.n_vf); }};
  parallel_for(pool, std::size(parts), 1, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t i = begin; i < end; ++i) parts[i]();
  });
  c.slices.vf = copied(f.vf_offsets, n_worlds + 1), c.slices.ee = copied(f.ee_offsets, n_worlds + 1);
  c.slices.hashes = copied(f.hashes, n_worlds);
  c.hash = f.hash;
  c.first_tocs = copied(f.first_tocs, n_worlds);
  c.first_toc = f.first_toc;
  return c;
}

Intersections intersections_of(const gpu::FrameResult& f, std::size_t n_worlds) {
  Intersections found;
  found.ef = copied(f.ef, f.n_ef);
  found.slices.ef = copied(f.ef_offsets, n_worlds + 1);
  found.slices.hashes = copied(f.hashes, n_worlds);
  found.hash = f.hash;
  return found;
}

void add_places_of_worlds(Contacts& all, Outputs outputs, const Features& features, const Separations& separations,
                          Positions t0, Positions t1, ThreadPool& pool) {
  const std::size_t n = all.vf.size();
  const auto each = [&](auto&& f) {
    if (outputs.points) f(&Contacts::points);
    if (outputs.normals) f(&Contacts::normals);
    if (outputs.closest) f(&Contacts::closest);
  };
  each([&](auto list) { (all.*list).resize(n + all.ee.size()); });
  for (std::size_t k = 0; k + 1 < all.slices.vf.size(); ++k) {
    const std::size_t vf = all.slices.vf[k], ee = all.slices.ee[k];
    const std::size_t n_vf = all.slices.vf[k + 1] - vf, n_ee = all.slices.ee[k + 1] - ee;
    Contacts one;
    one.vf = copied(all.vf.data() + vf, n_vf), one.vf_toc = copied(all.vf_toc.data() + vf, n_vf);
    one.ee = copied(all.ee.data() + ee, n_ee), one.ee_toc = copied(all.ee_toc.data() + ee, n_ee);
    add_places(one, outputs, features, separations, of_world(t0, features.n_vertices, k),
               of_world(t1, features.n_vertices, k), pool);
    each([&](auto list) {
      std::copy_n((one.*list).begin(), n_vf, (all.*list).begin() + static_cast<std::ptrdiff_t>(vf));
      std::copy_n((one.*list).begin() + static_cast<std::ptrdiff_t>(n_vf), n_ee,
                  (all.*list).begin() + static_cast<std::ptrdiff_t>(n + ee));
    });
  }
}

}  // namespace hpccd
