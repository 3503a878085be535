// SPDX-License-Identifier: Apache-2.0
// The planes of a scene. The host tests all vertices against them, after any backend has found the other contacts.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "backends/shortening.h"
#include "base/parallel.h"
#include "contacts/outputs.h"
#include "elementary/half_space.h"
#include "hpccd/hpccd.h"
#include "scene/feature_filter.h"
#include "scene/separation_table.h"
#include "scene/thickness.h"

namespace hpccd {

class Planes {
 public:
  // accuracy: of pairs without their own.
  Planes(const Scene& scene, Accuracy accuracy, const SeparationTable& separations, const ThicknessTable& thickness,
         const FeatureFilter& filter);

  bool any() const { return !planes_.empty(); }
  // Throws InvalidArgument unless it is the number of a plane in the scene, and the value is valid.
  void set(std::uint32_t mesh, const Plane& value);

  // Positions are those of all worlds, on the host, with valid coordinates. The results are those without planes; rows
  // that the report leaves out are removed. They return the number of rows added.
  std::size_t add_contacts(Contacts& contacts, Positions t0, Positions t1, Report report, Outputs outputs,
                           ThreadPool& pool) const;
  std::size_t add_near(Contacts& near, Positions vertices, double distance, Outputs outputs, ThreadPool& pool) const;
  // By world: lowers times to those of contacts with planes; never above them.
  void limit_steps(std::vector<double>& first, Positions t0, Positions t1, ThreadPool& pool) const;
  // For one world.
  void add_touching(std::vector<Shortening::Touching>& pairs, Positions t0, Positions t1, ThreadPool& pool) const;
  // A gap for each mesh and plane that are tested, in the order of Detector::distances().
  void add_gaps(std::vector<Gap>& gaps, Positions vertices, std::size_t worlds, ThreadPool& pool) const;

  std::size_t bytes() const { return planes_.size() * (sizeof(OfScene) + scene_.meshes().size()); }

 private:
  struct OfScene {
    std::uint32_t mesh;  // its number among the meshes
    Plane plane;
    std::vector<char> tested;  // by mesh
    std::vector<char> early;   // by mesh: whether times must not be later than they are
  };
  struct Hit {
    std::size_t vertex;  // through all worlds
    std::uint32_t plane;
    double value;  // time or distance
  };
  using Hits = std::vector<std::vector<Hit>>;  // in pieces, sorted by vertex, then by plane
  // A motion by the separations, or a snapshot by a distance.
  struct Query {
    Positions t0, t1;
    std::optional<double> distance;
  };

  // How near a vertex of a mesh may come to a plane: the separation of both, or the distance, and its thickness.
  double reach(std::uint32_t plane, std::uint32_t mesh, double thickness, const Query& query) const {
    return (query.distance ? *query.distance : separations_.of(planes_[plane].mesh, mesh)) + thickness;
  }
  double thickness_of_vertex(std::size_t vertex) const {
    const double* all = thickness_.view().of_vertex;
    return all ? all[vertex] : 0;
  }
  template <class F>
  void for_parts(std::size_t begin, std::size_t end, const Query& query, F&& f) const;
  template <class Real>
  void find(const Query& query, std::size_t begin, std::size_t end, std::vector<Hit>& hits) const;
  Hits find(const Query& query, ThreadPool& pool) const;
  std::size_t append(Contacts& contacts, const Hits& hits, const Query& query, Outputs outputs, ThreadPool& pool) const;
  template <class Real>
  void write_places(Contacts& contacts, std::size_t row, const Hit& hit, const Query& query, Outputs outputs) const;
  template <class Real>
  Gap gap(std::uint32_t plane, std::uint32_t mesh, const Real* vertices) const;
  std::uint32_t mesh_of(std::size_t vertex) const;

  const Scene& scene_;
  const SeparationTable& separations_;
  const ThicknessTable& thickness_;
  const FeatureFilter& filter_;
  std::vector<OfScene> planes_;
};

}  // namespace hpccd
