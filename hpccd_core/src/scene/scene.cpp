// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "base/length.h"
#include "base/names.h"
#include "hpccd/hpccd.h"
#include "scene/tested_features.h"

namespace hpccd {

std::uint32_t Scene::add_mesh(std::string name, std::span<const std::uint32_t> faces, std::uint32_t n_vertices,
                              MeshOptions options) {
  for (const Mesh& m : meshes_)
    if (m.name == name)
      throw InvalidArgument("name: a mesh named '" + name + "' is already in the scene; choose another");
  if (faces.size() % 3 != 0) throw InvalidArgument("faces: must hold three vertex indices a triangle");
  for (std::size_t i = 0; i < faces.size(); ++i)
    if (faces[i] >= n_vertices)
      throw InvalidArgument("faces[" + std::to_string(i / 3) + ", " + std::to_string(i % 3) + "] is " +
                            std::to_string(faces[i]) + ", but mesh '" + name + "' has " + std::to_string(n_vertices) +
                            " vertices; indices count this mesh's own vertices from 0");
  // One index is kept free as "none".
  if (std::uint64_t{n_vertices_} + n_vertices >= 0xFFFFFFFFu)
    throw InvalidArgument("n_vertices: the scene would have more than 2^32 - 2 vertices; divide it");
  const auto first_face = static_cast<std::uint32_t>(faces_.size());
  const auto n_faces = static_cast<std::uint32_t>(faces.size() / 3);
  std::vector<std::array<std::uint32_t, 3>> larger;  // beside the old one: `faces` may be a part of that
  const bool grows = faces_.capacity() < faces_.size() + n_faces;
  if (grows) {
    larger.reserve(std::max(faces_.size() + n_faces, 2 * faces_.size()));
    larger.assign(faces_.begin(), faces_.end());
  }
  meshes_.push_back({std::move(name), options, n_vertices_, n_vertices, first_face, n_faces});
  // From here on nothing throws: a mesh is there in full or not at all.
  auto& all = grows ? larger : faces_;
  for (std::uint32_t f = 0; f < n_faces; ++f)
    all.push_back({n_vertices_ + faces[3 * f], n_vertices_ + faces[3 * f + 1], n_vertices_ + faces[3 * f + 2]});
  if (grows) faces_.swap(larger);
  n_vertices_ += n_vertices;
  return static_cast<std::uint32_t>(meshes_.size() - 1);
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
  const Pair pair = known(mesh_a, mesh_b);
  check_length("separation", separation);
  separation_[pair] = separation;
}

void Scene::set_features(std::uint32_t mesh_a, std::uint32_t mesh_b, TestedFeatures features) {
  const Pair pair = known(mesh_a, mesh_b);
  require_some("features", features);
  features_[pair] = features;
}

bool Scene::pair_enabled(std::uint32_t a, std::uint32_t b) const {
  const MeshOptions &oa = meshes_[a].options, &ob = meshes_[b].options;
  if (a == b && !oa.self_collision) return false;
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
