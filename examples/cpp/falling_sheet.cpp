// SPDX-License-Identifier: Apache-2.0
// A sheet of cloth falls on a pyramid. Prints the contacts of each step, until one step has brought it through.
#include <hpccd/hpccd.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <memory>
#include <vector>

namespace {

// Positions, x y z one after the other, and three vertices a triangle.
struct Mesh {
  std::vector<double> xyz;
  std::vector<std::uint32_t> faces;
  std::uint32_t n_vertices() const { return static_cast<std::uint32_t>(xyz.size() / 3); }
};

// A square of n by n cells from -1 to 1, at this height.
Mesh sheet(std::uint32_t n, double height) {
  Mesh mesh;
  for (std::uint32_t i = 0; i <= n; ++i)
    for (std::uint32_t j = 0; j <= n; ++j) mesh.xyz.insert(mesh.xyz.end(), {2.0 * i / n - 1, 2.0 * j / n - 1, height});
  for (std::uint32_t i = 0; i < n; ++i)
    for (std::uint32_t j = 0; j < n; ++j) {
      const std::uint32_t a = i * (n + 1) + j, b = a + 1, c = a + n + 1, d = c + 1;
      mesh.faces.insert(mesh.faces.end(), {a, c, b, b, c, d});
    }
  return mesh;
}

Mesh pyramid() {
  return {{-0.5, -0.5, 0, 0.5, -0.5, 0, 0.5, 0.5, 0, -0.5, 0.5, 0, 0.03, 0.02, 0.5},
          {0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4}};
}

void print(const hpccd::Contacts& contacts) {
  for (std::size_t i = 0; i < contacts.vf.size(); ++i)
    std::printf("  vertex %u, face %u at t = %.4f, point (%.3f, %.3f, %.3f)\n", contacts.vf[i][0], contacts.vf[i][1],
                contacts.vf_toc[i], contacts.points[i][0], contacts.points[i][1], contacts.points[i][2]);
  for (std::size_t i = 0; i < contacts.ee.size(); ++i)
    std::printf("  edge %u-%u, edge %u-%u at t = %.4f\n", contacts.ee[i][0], contacts.ee[i][1], contacts.ee[i][2],
                contacts.ee[i][3], contacts.ee_toc[i]);
}

void run() {
  const Mesh cloth = sheet(8, 0.95), ground = pyramid();
  auto scene = std::make_shared<hpccd::Scene>();
  scene->add_mesh("cloth", cloth.faces, cloth.n_vertices());
  scene->add_mesh("pyramid", ground.faces, ground.n_vertices(), {.is_static = true});

  hpccd::Options options;
  options.points = true;
  hpccd::Detector detector(scene, options);

  // The vertices of all meshes, in the order added.
  std::vector<double> start = cloth.xyz;
  start.insert(start.end(), ground.xyz.begin(), ground.xyz.end());
  for (int step = 1; step <= 5; ++step) {
    std::vector<double> end = start;
    for (std::size_t z = 2; z < cloth.xyz.size(); z += 3) end[z] -= 0.2;
    const hpccd::Contacts contacts = detector.detect(hpccd::Positions::of(start), hpccd::Positions::of(end));
    std::printf("step %d: %zu vertex-face, %zu edge-edge\n", step, contacts.vf.size(), contacts.ee.size());
    print(contacts);
    start = end;
  }
}

}  // namespace

int main() {
  std::printf("hpccd %s\n", hpccd::version());
  try {
    run();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "falling_sheet: %s\n", error.what());
    return EXIT_FAILURE;
  }
}
