// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <utility>

#include "base/coordinate_limits.h"
#include "base/length.h"
#include "base/names.h"
#include "base/standard_arithmetic.h"
#include "hpccd/hpccd.h"
#include "scene/plane.h"
#include "scene/tested_features.h"
#include "scene/thickness.h"

namespace hpccd {

namespace {

// Throws InvalidArgument unless `indices` has `corners` indices per feature, each below n_vertices.
template <std::size_t corners>
void check_indices(const char* argument, const char* of_what, std::span<const std::uint32_t> indices,
                   const std::string& mesh, std::uint32_t n_vertices) {
  if (indices.size() % corners != 0) throw InvalidArgument(std::string(argument) + ": must hold " + of_what);
  for (std::size_t i = 0; i < indices.size(); ++i)
    if (indices[i] >= n_vertices)
      throw InvalidArgument(std::string(argument) + "[" + std::to_string(i / corners) + ", " +
                            std::to_string(i % corners) + "] is " + std::to_string(indices[i]) + ", but mesh '" + mesh +
                            "' has " + std::to_string(n_vertices) +
                            " vertices; indices count this mesh's own vertices from 0");
}

// A longer copy of all features, or nothing if the capacity suffices for n more. The old array stays valid, since the
// added features may be part of it.
template <class Feature>
std::vector<Feature> with_room(const std::vector<Feature>& all, std::size_t n) {
  std::vector<Feature> larger;
  if (all.capacity() >= all.size() + n) return larger;
  larger.reserve(std::max(all.size() + n, 2 * all.size()));
  larger.assign(all.begin(), all.end());
  return larger;
}

// Does not throw.
template <std::size_t corners>
void append(std::vector<std::array<std::uint32_t, corners>>& all,
            std::vector<std::array<std::uint32_t, corners>>& larger, std::span<const std::uint32_t> indices,
            std::uint32_t first_vertex) {
  auto& to = larger.capacity() > 0 ? larger : all;
  for (std::size_t i = 0; i < indices.size(); i += corners) {
    std::array<std::uint32_t, corners> feature;
    for (std::size_t k = 0; k < corners; ++k) feature[k] = first_vertex + indices[i + k];
    to.push_back(feature);
  }
  if (larger.capacity() > 0) all.swap(larger);
}

// At least doubles a capacity that does not suffice: many calls with few rows take linear time.
void make_room(auto& rows, std::size_t n) {
  if (rows.capacity() < rows.size() + n) rows.reserve(std::max(rows.size() + n, 2 * rows.size()));
}

// For filters of features.
void require_no_plane(const Scene::Mesh& mesh) {
  if (mesh.plane) throw InvalidArgument("mesh: '" + mesh.name + "' is a plane, which has no faces; use ignore_pair()");
}

}  // namespace

std::uint32_t Scene::add_mesh(std::string name, std::span<const std::uint32_t> faces, std::uint32_t n_vertices,
                              MeshOptions options, std::span<const std::uint32_t> edges) {
  if (names_.contains(name))
    throw InvalidArgument("name: a mesh named '" + name + "' is already in the scene; choose another");
  check_indices<3>("faces", "three vertex indices a triangle", faces, name, n_vertices);
  check_indices<2>("edges", "two vertex indices an edge", edges, name, n_vertices);
  // One index is kept free as "none".
  if (std::uint64_t{n_vertices_} + n_vertices >= 0xFFFFFFFFu)
    throw InvalidArgument("n_vertices: the scene would have more than 2^32 - 2 vertices; divide it");
  Mesh mesh{name,
            options,
            n_vertices_,
            n_vertices,
            static_cast<std::uint32_t>(faces_.size()),
            static_cast<std::uint32_t>(faces.size() / 3),
            static_cast<std::uint32_t>(edges_.size()),
            static_cast<std::uint32_t>(edges.size() / 2)};
  auto more_faces = with_room(faces_, mesh.n_faces);
  auto more_edges = with_room(edges_, mesh.n_edges);
  if (meshes_.size() == meshes_.capacity()) meshes_.reserve(std::max<std::size_t>(4, 2 * meshes_.size()));
  names_.insert(std::move(name));
  // Nothing below throws: a mesh is added completely or not at all.
  meshes_.push_back(std::move(mesh));
  append(faces_, more_faces, faces, n_vertices_);
  append(edges_, more_edges, edges, n_vertices_);
  n_vertices_ += n_vertices;
  return static_cast<std::uint32_t>(meshes_.size() - 1);
}

void Scene::set_thickness(std::uint32_t mesh, std::span<const double> thickness) {
  const StandardArithmetic arithmetic;  // otherwise a negative denormal number might pass as 0
  known(mesh, mesh);
  check_thickness(meshes_[mesh], thickness);
  meshes_[mesh].thickness.assign(thickness.begin(), thickness.end());
}

void Scene::set_shape(std::uint32_t mesh, std::span<const double> vertices) {
  const StandardArithmetic arithmetic;
  Mesh& m = meshes_[known(mesh, mesh).first];
  require_no_plane(m);
  if (vertices.size() != 3 * std::size_t{m.n_vertices})
    throw InvalidArgument("shape: mesh '" + m.name + "' has " + std::to_string(m.n_vertices) + " vertices, but " +
                          std::to_string(vertices.size()) +
                          " coordinates were given; give three for each of its vertices");
  for (std::size_t i = 0; i < vertices.size(); ++i)
    if (!(std::fabs(vertices[i]) <= largest_in_snapshot))
      throw InvalidArgument("shape[" + std::to_string(i / 3) +
                            "]: has a coordinate that is not finite or beyond 1e300; give the positions of the mesh in "
                            "its own frame");
  m.shape.emplace(vertices.begin(), vertices.end());
}

std::uint32_t Scene::add_plane(std::string name, const Plane& plane, bool is_static) {
  const StandardArithmetic arithmetic;  // otherwise a normal of denormal numbers might pass as 0
  check_plane(plane);
  const std::uint32_t number = add_mesh(std::move(name), {}, 0, {.self_collision = false, .is_static = is_static});
  meshes_[number].plane = plane;
  return number;
}

Scene::Pair Scene::known(std::uint32_t mesh_a, std::uint32_t mesh_b) const {
  if (std::max(mesh_a, mesh_b) >= meshes_.size())
    throw InvalidArgument("mesh_a, mesh_b: the scene has " + std::to_string(meshes_.size()) +
                          " meshes; give the numbers that add_mesh() returned");
  return ordered(mesh_a, mesh_b);
}

void Scene::ignore_pair(std::uint32_t mesh_a, std::uint32_t mesh_b) { ignored_[known(mesh_a, mesh_b)] = true; }

void Scene::set_accuracy(std::uint32_t mesh_a, std::uint32_t mesh_b, Accuracy accuracy) {
  const Pair pair = known(mesh_a, mesh_b);
  check_accuracy(accuracy);
  accuracy_[pair] = accuracy;
}

void Scene::set_separation(std::uint32_t mesh_a, std::uint32_t mesh_b, double separation) {
  const StandardArithmetic arithmetic;  // otherwise a negative denormal number might pass as 0
  const Pair pair = known(mesh_a, mesh_b);
  check_length("separation", separation);
  separation_[pair] = separation;
}

void Scene::set_features(std::uint32_t mesh_a, std::uint32_t mesh_b, TestedFeatures features) {
  const Pair pair = known(mesh_a, mesh_b);
  require_some("features", features);
  features_[pair] = features;
}

void Scene::ignore_within(std::uint32_t mesh, std::uint32_t rings) {
  require_no_plane(meshes_[known(mesh, mesh).first]);
  std::uint32_t& most = rings_[mesh];
  most = std::max(most, rings);
}

void Scene::ignore_within(std::uint32_t mesh, RestFilter rest) {
  const StandardArithmetic arithmetic;
  const Mesh& m = meshes_[known(mesh, mesh).first];
  require_no_plane(m);
  if (rest.vertices.size() != 3 * std::size_t{m.n_vertices})
    throw InvalidArgument("rest_vertices: mesh '" + m.name + "' has " + std::to_string(m.n_vertices) +
                          " vertices, but " + std::to_string(rest.vertices.size()) +
                          " coordinates were given; give three for each of its vertices");
  for (std::size_t i = 0; i < rest.vertices.size(); ++i)
    if (!(std::fabs(rest.vertices[i]) <= largest_in_snapshot))
      throw InvalidArgument(
          "rest_vertices[" + std::to_string(i / 3) +
          "]: has a coordinate that is not finite or beyond 1e300; give positions of the mesh at rest");
  check_length("distance", rest.distance);
  rest_[mesh].push_back(std::move(rest));
}

void Scene::ignore_faces(std::uint32_t mesh, std::span<const std::uint32_t> faces, std::uint32_t other) {
  known(mesh, other), require_no_plane(meshes_[mesh]);
  for (std::size_t i = 0; i < faces.size(); ++i)
    if (faces[i] >= meshes_[mesh].n_faces)
      throw InvalidArgument("faces[" + std::to_string(i) + "] is " + std::to_string(faces[i]) + ", but mesh '" +
                            meshes_[mesh].name + "' has " + std::to_string(meshes_[mesh].n_faces) +
                            " faces; give numbers of this mesh's own faces, from 0");
  auto& all = ignored_faces_[{mesh, other}];
  all.insert(all.end(), faces.begin(), faces.end());
}

void Scene::ignore_features(std::span<const std::array<std::uint32_t, 2>> vf,
                            std::span<const std::array<std::uint32_t, 4>> ee,
                            std::span<const std::array<std::uint32_t, 3>> ef) {
  const auto check = [&](const char* name, const auto& rows, std::size_t n_vertices_of_row) {
    for (std::size_t i = 0; i < rows.size(); ++i)
      for (std::size_t k = 0; k < rows[i].size(); ++k) {
        const bool vertex = k < n_vertices_of_row;
        if (rows[i][k] < (vertex ? n_vertices_ : faces_.size())) continue;
        throw InvalidArgument(
            std::string(name) + "[" + std::to_string(i) + ", " + std::to_string(k) + "] is " +
            std::to_string(rows[i][k]) + ", but the scene has " +
            (vertex ? std::to_string(n_vertices_) + " vertices" : std::to_string(faces_.size()) + " faces") +
            "; give scene-wide numbers, as in contacts");
      }
  };
  check("vf", vf, 1), check("ee", ee, 4), check("ef", ef, 2);
  // All or nothing.
  make_room(ignored_vf_, vf.size()), make_room(ignored_ee_, ee.size()), make_room(ignored_ef_, ef.size());
  ignored_vf_.insert(ignored_vf_.end(), vf.begin(), vf.end());
  ignored_ee_.insert(ignored_ee_.end(), ee.begin(), ee.end());
  ignored_ef_.insert(ignored_ef_.end(), ef.begin(), ef.end());
}

bool Scene::pair_enabled(std::uint32_t a, std::uint32_t b) const {
  const MeshOptions &oa = meshes_[a].options, &ob = meshes_[b].options;
  if (a == b && !oa.self_collision) return false;
  if (meshes_[a].plane && meshes_[b].plane) return false;
  if (oa.is_static && ob.is_static) return false;
  return !ignored_.contains(ordered(a, b));
}

Accuracy Scene::pair_accuracy(std::uint32_t a, std::uint32_t b, Accuracy otherwise) const {
  const auto found = accuracy_.find(ordered(a, b));
  return found == accuracy_.end() ? otherwise : found->second;
}

double Scene::pair_separation(std::uint32_t a, std::uint32_t b, double otherwise) const {
  const auto found = separation_.find(ordered(a, b));
  return found == separation_.end() ? otherwise : found->second;
}

TestedFeatures Scene::pair_features(std::uint32_t a, std::uint32_t b, TestedFeatures otherwise) const {
  const auto found = features_.find(ordered(a, b));
  return found == features_.end() ? otherwise : found->second;
}

}  // namespace hpccd
