// SPDX-License-Identifier: Apache-2.0
#include "contacts/points.h"

#include <algorithm>
#include <type_traits>

#include "contacts/places.h"

namespace hpccd {
namespace {

// A row of vv or ve, and the row of ee that it was.
struct Moved {
  std::array<std::uint32_t, 3> features;
  std::size_t from;
  bool turned;  // the point was edge b
};

// The output of a pair whose sides are exchanged, so that the point is the first.
template <class Row>
Row turned(const Row& row, bool is_normal) {
  if constexpr (std::is_same_v<Row, std::array<double, 3>>) {
    return is_normal ? Row{-row[0], -row[1], -row[2]} : row;
  } else if constexpr (std::is_same_v<Row, std::array<std::array<double, 3>, 2>>) {
    return {row[1], row[0]};
  } else if constexpr (std::is_same_v<Row, std::array<double, 4>>) {
    return {-row[2], -row[3], -row[0], -row[1]};
  } else if constexpr (std::is_same_v<Row, std::array<std::uint32_t, 4>>) {
    return {row[2], row[3], row[0], row[1]};
  } else {
    return row;
  }
}

}  // namespace

void split_points(Contacts& c) {
  const std::size_t worlds = c.slices.hashes.size(), n = c.vf.size();
  std::vector<std::size_t> edges;  // rows that stay
  std::vector<Moved> vv, ve;
  std::vector<std::uint64_t> of_ee{0}, of_vv{0}, of_ve{0};
  std::size_t begin = 0;
  for (std::size_t k = 0; k < std::max<std::size_t>(1, worlds); ++k) {
    const std::size_t end = worlds ? c.slices.ee[k + 1] : c.ee.size();
    const std::size_t first = ve.size();
    for (std::size_t i = begin; i < end; ++i) {
      const auto& [a0, a1, b0, b1] = c.ee[i];
      if (a0 == a1 && b0 == b1)
        vv.push_back({{a0, b0, 0}, i, false});
      else if (a0 == a1)
        ve.push_back({{a0, b0, b1}, i, false});
      else if (b0 == b1)
        ve.push_back({{b0, a0, a1}, i, true});
      else
        edges.push_back(i);
    }
    std::sort(ve.begin() + static_cast<std::ptrdiff_t>(first), ve.end(),
              [](const Moved& a, const Moved& b) { return a.features < b.features; });
    of_ee.push_back(edges.size()), of_vv.push_back(vv.size()), of_ve.push_back(ve.size());
    begin = end;
  }
  const std::size_t m = c.ee.size(), n_vp = c.vp.size();
  for_each_output(all_outputs, [&](auto list) {
    auto& rows = c.*list;
    if (rows.empty()) return;
    bool is_normal = false;
    if constexpr (std::is_same_v<decltype(list), std::vector<std::array<double, 3>> Contacts::*>)
      is_normal = list == &Contacts::normals;
    std::remove_reference_t<decltype(rows)> all(rows.begin(), rows.begin() + static_cast<std::ptrdiff_t>(n));
    all.reserve(rows.size());
    for (const std::size_t i : edges) all.push_back(rows[n + i]);
    all.insert(all.end(), rows.begin() + static_cast<std::ptrdiff_t>(n + m),
               rows.begin() + static_cast<std::ptrdiff_t>(n + m + n_vp));
    for (const auto* moved : {&vv, &ve})
      for (const Moved& pair : *moved) {
        const auto& row = rows[n + pair.from];
        all.push_back(pair.turned ? turned(row, is_normal) : row);
      }
    rows = std::move(all);
  });
  for (const Moved& pair : vv)
    c.vv.push_back({pair.features[0], pair.features[1]}), c.vv_toc.push_back(c.ee_toc[pair.from]);
  for (const Moved& pair : ve) c.ve.push_back(pair.features), c.ve_toc.push_back(c.ee_toc[pair.from]);
  for (std::size_t i = 0; i < edges.size(); ++i) c.ee[i] = c.ee[edges[i]], c.ee_toc[i] = c.ee_toc[edges[i]];
  c.ee.resize(edges.size()), c.ee_toc.resize(edges.size());
  if (worlds) c.slices.ee = std::move(of_ee), c.slices.vv = std::move(of_vv), c.slices.ve = std::move(of_ve);
}

}  // namespace hpccd
