// SPDX-License-Identifier: Apache-2.0
#include "scene/thickness.h"

#include <algorithm>
#include <numeric>
#include <string>

#include "base/coordinate_limits.h"
#include "base/length.h"

namespace hpccd {
namespace {

// What a mesh has a value for, each.
struct Elements {
  const char* name;
  std::uint32_t n;
};

Elements elements_of(const Scene::Mesh& mesh) {
  if (mesh.n_faces > 0) return {"face", mesh.n_faces};
  if (mesh.n_edges > 0) return {"edge", mesh.n_edges};
  return {"vertex", mesh.n_vertices};
}

}  // namespace

void check_thickness(const Scene::Mesh& mesh, std::span<const double> values) {
  if (mesh.plane)
    throw InvalidArgument("thickness: '" + mesh.name + "' is a plane, which has none; set the separation of its pairs");
  const Elements elements = elements_of(mesh);
  if (values.size() != 1 && values.size() != elements.n) {
    const bool of_vertices = mesh.n_faces > 0 && values.size() == mesh.n_vertices;
    throw InvalidArgument("thickness: '" + mesh.name + "' needs one value, or one for each " + elements.name + " (" +
                          std::to_string(elements.n) + "), but " + std::to_string(values.size()) + " were given" +
                          (of_vertices ? "; from one for each vertex: thickness[faces].max(axis=1)" : ""));
  }
  for (const double t : values) {
    check_length("thickness", t);
    // The sum of two must be finite: distances of surfaces are less it.
    if (t > largest_in_snapshot) throw InvalidArgument("thickness: must be at most 1e300; choose a larger unit");
  }
}

ThicknessTable::ThicknessTable(const Scene& scene, const Features& features)
    : scene_(scene),
      features_(features),
      given_(scene.meshes().size()),
      largest_of_mesh_(scene.meshes().size()),
      sum_of_mesh_(scene.meshes().size()),
      thick_(scene.meshes().size()) {
  for (std::uint32_t m = 0; m < given_.size(); ++m)
    if (const auto& values = scene.meshes()[m].thickness; !values.empty()) set(m, values);
}

void ThicknessTable::set(std::uint32_t number, std::span<const double> values) {
  std::vector<double>& given = given_[number];
  if (std::ranges::equal(given, values)) return;
  const double largest = *std::ranges::max_element(values);
  if (given.empty() && !(largest > 0)) return;
  if (of_face_.empty() && of_vertex_.empty() && of_edge_.empty()) {
    std::vector<double> of_vertex(features_.n_vertices), of_edge(features_.edges.size()), of_face(features_.n_faces());
    of_vertex_.swap(of_vertex), of_edge_.swap(of_edge), of_face_.swap(of_face);  // all or, without memory, none
  }
  const Scene::Mesh& mesh = scene_.meshes()[number];
  const bool each = values.size() > 1;
  if (each && mesh.n_faces > 0 && edges_of_face_.empty()) {
    edges_of_face_.reserve(features_.n_faces());
    for (const auto& [a, b, c] : features_.faces)
      edges_of_face_.push_back({edge_number(a, b), edge_number(b, c), edge_number(c, a)});
  }
  given.assign(values.begin(), values.end());
  ++version_;
  const auto first_edge = std::ranges::lower_bound(features_.edges, std::array{mesh.first_vertex, 0u});
  const auto end_edge = std::ranges::lower_bound(features_.edges, std::array{mesh.first_vertex + mesh.n_vertices, 0u});
  const double everywhere = each ? 0 : values[0];
  std::fill_n(of_face_.begin() + mesh.first_face, mesh.n_faces, everywhere);
  std::fill_n(of_vertex_.begin() + mesh.first_vertex, mesh.n_vertices, everywhere);
  std::fill(of_edge_.begin() + (first_edge - features_.edges.begin()),
            of_edge_.begin() + (end_edge - features_.edges.begin()), everywhere);
  if (each && mesh.n_faces > 0)
    set_each_face(mesh, values);
  else if (each && mesh.n_edges > 0)
    set_each_edge(mesh, values);
  else if (each)
    std::ranges::copy(values, of_vertex_.begin() + mesh.first_vertex);
  if (each)  // points are edges from a vertex to itself
    for (auto e = static_cast<std::size_t>(first_edge - features_.edges.begin());
         e < static_cast<std::size_t>(end_edge - features_.edges.begin()); ++e)
      if (const auto [a, b] = features_.edges[e]; a == b) of_edge_[e] = of_vertex_[a];
  largest_of_mesh_[number] = largest;
  const auto positive = [](double t) { return t > 0; };
  const bool all =
      std::all_of(of_face_.begin() + mesh.first_face, of_face_.begin() + mesh.first_face + mesh.n_faces, positive) &&
      std::all_of(of_vertex_.begin() + mesh.first_vertex, of_vertex_.begin() + mesh.first_vertex + mesh.n_vertices,
                  positive) &&
      std::all_of(of_edge_.begin() + (first_edge - features_.edges.begin()),
                  of_edge_.begin() + (end_edge - features_.edges.begin()), positive);
  thick_[number] = all ? Thick::all : largest > 0 ? Thick::some : Thick::none;
  largest_ = std::ranges::max(largest_of_mesh_);
  sum_of_mesh_[number] = std::accumulate(values.begin(), values.end(), 0.0) * (each ? 1 : elements_of(mesh).n);
  const double sum = std::accumulate(sum_of_mesh_.begin(), sum_of_mesh_.end(), 0.0);
  double n = 0;
  for (const Scene::Mesh& m : scene_.meshes()) n += elements_of(m).n;
  uneven_ = sum < 0.5 * largest_ * n;
}

void ThicknessTable::set_each_face(const Scene::Mesh& mesh, std::span<const double> values) {
  for (std::uint32_t i = 0; i < mesh.n_faces; ++i) {
    const std::uint32_t face = mesh.first_face + i;
    const double t = of_face_[face] = values[i];
    for (const std::uint32_t v : features_.faces[face]) of_vertex_[v] = std::max(of_vertex_[v], t);
    for (const std::uint32_t e : edges_of_face_[face])
      if (e != UINT32_MAX) of_edge_[e] = std::max(of_edge_[e], t);
  }
}

void ThicknessTable::set_each_edge(const Scene::Mesh& mesh, std::span<const double> values) {
  for (std::uint32_t i = 0; i < mesh.n_edges; ++i) {
    const auto [a, b] = scene_.edges()[mesh.first_edge + i];
    for (const std::uint32_t v : {a, b}) of_vertex_[v] = std::max(of_vertex_[v], values[i]);
    if (const std::uint32_t e = edge_number(a, b); e != UINT32_MAX) of_edge_[e] = std::max(of_edge_[e], values[i]);
  }
}

// UINT32_MAX for an edge from a vertex to itself, as of a degenerate face.
std::uint32_t ThicknessTable::edge_number(std::uint32_t a, std::uint32_t b) const {
  const std::array edge{std::min(a, b), std::max(a, b)};
  const auto found = std::ranges::lower_bound(features_.edges, edge);
  if (found == features_.edges.end() || *found != edge) return UINT32_MAX;
  return static_cast<std::uint32_t>(found - features_.edges.begin());
}

std::size_t ThicknessTable::bytes() const {
  std::size_t n = (of_vertex_.capacity() + of_edge_.capacity() + of_face_.capacity()) * sizeof(double) +
                  edges_of_face_.capacity() * sizeof(edges_of_face_[0]);
  for (const auto& values : given_) n += values.capacity() * sizeof(double);
  return n;
}

}  // namespace hpccd
