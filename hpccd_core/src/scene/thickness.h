// SPDX-License-Identifier: Apache-2.0
// The current thickness of each feature: half the width of its offset surface.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "scene/features.h"

namespace hpccd {

// Throws InvalidArgument unless these are values for Scene::set_thickness.
void check_thickness(const Scene::Mesh& mesh, std::span<const double> values);

// Read access without the standard library. Null pointers: all are zero.
struct Thicknesses {
  const double *of_vertex = nullptr, *of_edge = nullptr, *of_face = nullptr;
};

// Which features of a mesh have a thickness.
enum class Thick : unsigned char { none, some, all };

class ThicknessTable {
 public:
  ThicknessTable(const Scene& scene, const Features& features);

  // Values as for Scene::set_thickness, checked.
  void set(std::uint32_t mesh, std::span<const double> values);
  // Differs between any two states that differ.
  std::uint64_t version() const { return version_; }

  bool any() const { return largest_ > 0; }
  // Whether a few elements are much thicker than most: the largest value is more than twice the mean.
  bool uneven() const { return uneven_; }
  // The largest sum of two.
  double most_of_two() const { return 2 * largest_; }
  // By mesh: the largest of its features. Empty if all are zero.
  const std::vector<double>& largest_of_meshes() const { return any() ? largest_of_mesh_ : none_; }
  // By mesh. Empty if all features have none.
  const std::vector<Thick>& meshes() const { return any() ? thick_ : no_mesh_; }
  // Whether all features of a mesh have one thickness.
  bool even(std::uint32_t mesh) const { return given_[mesh].size() <= 1; }
  Thicknesses view() const {
    return any() ? Thicknesses{of_vertex_.data(), of_edge_.data(), of_face_.data()} : Thicknesses{};
  }
  std::size_t bytes() const;

 private:
  void set_each_face(const Scene::Mesh& mesh, std::span<const double> values);
  void set_each_edge(const Scene::Mesh& mesh, std::span<const double> values);
  std::uint32_t edge_number(std::uint32_t a, std::uint32_t b) const;

  const Scene& scene_;
  const Features& features_;
  std::vector<std::vector<double>> given_;                   // by mesh
  std::vector<double> of_vertex_, of_edge_, of_face_;        // empty until a value is not zero
  std::vector<std::array<std::uint32_t, 3>> edges_of_face_;  // found when faces first have a thickness each
  std::vector<double> largest_of_mesh_, sum_of_mesh_, none_;
  std::vector<Thick> thick_, no_mesh_;
  double largest_ = 0;
  bool uneven_ = false;
  std::uint64_t version_ = 1;
};

}  // namespace hpccd
