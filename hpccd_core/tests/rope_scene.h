// SPDX-License-Identifier: Apache-2.0
// A tangled rope about a soup of triangles, between whose corners there are threads too: leaves of edges alone, of
// triangles, and of both.
#pragma once

#include <memory>
#include <vector>

#include "hpccd/hpccd.h"
#include "soup_scene.h"

namespace hpccd::test {

// A rope of 3n edges, and n triangles with as many threads, of which some are sides of triangles. Positions as of
// soup_scene(n): a corner of a triangle and the next one's are apart.
inline std::shared_ptr<const Scene> rope_scene(std::uint32_t n) {
  auto scene = std::make_shared<Scene>();
  std::vector<std::uint32_t> rope, faces, threads;
  for (std::uint32_t i = 0; i + 1 < 3 * n; ++i) rope.insert(rope.end(), {i + 1, i});
  scene->add_mesh("rope", {}, 3 * n, {}, rope);
  for (std::uint32_t i = 0; i < 2 * n; ++i) faces.push_back(i);
  faces.resize(faces.size() / 3 * 3);
  for (std::uint32_t i = 0; i + 7 < 3 * n; i += 3)
    threads.insert(threads.end(), {i, i + 7, i + 1, i + 2, i + 2, i + 1});
  scene->add_mesh("fringed soup", faces, 3 * n, {}, threads);
  return scene;
}

inline std::vector<double> rope_positions(std::uint32_t n, unsigned seed) { return soup_positions(n, seed); }

}  // namespace hpccd::test
