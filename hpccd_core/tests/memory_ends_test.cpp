// SPDX-License-Identifier: Apache-2.0
// Wherever memory ends: std::bad_alloc is thrown, and the next call works as if nothing had happened.
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdlib>
#include <functional>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "grid_scene.h"
#include "hpccd/hpccd.h"
#include "paper/shared_pairs.h"
#include "sheets_and_solids.h"
#include "soup_scene.h"

namespace {

// This many allocations succeed, then one fails; negative: none does.
std::atomic<long> allocations_left{-1};

void* allocate(std::size_t size, std::size_t alignment) {
  if (allocations_left.load(std::memory_order_relaxed) >= 0 && allocations_left.fetch_sub(1) == 0)
    throw std::bad_alloc();
  const std::size_t whole = (size + alignment - 1) / alignment * alignment;
  if (void* p = std::aligned_alloc(alignment, whole ? whole : alignment)) return p;
  throw std::bad_alloc();
}

}  // namespace

void* operator new(std::size_t size) { return allocate(size, alignof(std::max_align_t)); }
void* operator new[](std::size_t size) { return allocate(size, alignof(std::max_align_t)); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  return allocate(size, static_cast<std::size_t>(alignment));
}
void* operator new[](std::size_t size, std::align_val_t alignment) {
  return allocate(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* p) noexcept { std::free(p); }
void operator delete[](void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }
void operator delete[](void* p, std::size_t) noexcept { std::free(p); }
void operator delete(void* p, std::align_val_t) noexcept { std::free(p); }
void operator delete[](void* p, std::align_val_t) noexcept { std::free(p); }
void operator delete(void* p, std::size_t, std::align_val_t) noexcept { std::free(p); }
void operator delete[](void* p, std::size_t, std::align_val_t) noexcept { std::free(p); }

namespace hpccd {
namespace {

using test::view;

// Whether f() ended for want of memory where its nth allocation fails; nothing where it makes fewer.
template <class F>
std::optional<bool> ends(long n, F&& f) {
  allocations_left = n;
  bool ended = false;
  try {
    f();
  } catch (const std::bad_alloc&) {
    ended = true;
  }
  if (allocations_left.exchange(-1) >= 0) return std::nullopt;
  return ended;
}

// At least this many allocations were tried, one after the other: that of a test which tries none says nothing.
constexpr long some = 10;

constexpr std::uint32_t n_triangles = 40;

struct Case {
  std::string name;
  std::shared_ptr<const Scene> scene;
  Options options;
  std::function<std::uint64_t(Detector&)> ask;

  // The allocation to fail after the nth. Searches with long integers make thousands, most of which are alike.
  long after(long n) const {
    const bool with_integers = name.starts_with("translation") || name.starts_with("penetration");
    return n + 1 + (with_integers ? n / 16 : 0);
  }
};

// A number that two results share only if they are alike.
class Digest {
 public:
  template <class T>
  Digest& operator<<(const T& x) {
    if constexpr (std::is_floating_point_v<T>)
      mix(std::bit_cast<std::uint64_t>(x));
    else if constexpr (std::is_integral_v<T>)
      mix(static_cast<std::uint64_t>(x));
    else
      for (const auto& row : x) *this << row;
    return *this;
  }
  operator std::uint64_t() const { return value_; }

 private:
  void mix(std::uint64_t x) {
    value_ = (value_ ^ x) * 0x9E3779B97F4A7C15u;
    value_ ^= value_ >> 32;
  }
  std::uint64_t value_ = 0;
};

// Two spheres with shapes above a plane, with whatever a detector of a scene prepares.
std::shared_ptr<const Scene> solids_scene() {
  const test::Body sphere = test::sphere(2, 1);
  const auto n = static_cast<std::uint32_t>(sphere.positions.size() / 3);
  auto scene = std::make_shared<Scene>();
  scene->add_mesh("first", sphere.faces, n);
  scene->add_mesh("second", sphere.faces, n);
  scene->add_plane("floor", {{0, 0, 1}, -1.05});
  for (const std::uint32_t mesh : {0, 1}) scene->set_shape(mesh, sphere.positions);
  scene->set_thickness(0, std::vector<double>{0.01});
  scene->ignore_within(0, 2);
  scene->ignore_within(1, {sphere.positions, 0.9});
  scene->ignore_faces(1, std::vector<std::uint32_t>{3}, 0);
  scene->ignore_features(std::vector<std::array<std::uint32_t, 2>>{{0, n}}, {});
  return scene;
}

// The second sphere is moved by x, and smaller.
std::vector<double> solid_positions(double x, double size = 0.9) {
  std::vector<double> positions = test::sphere(2, 1).positions;
  const std::vector<double> second = test::moved(test::sphere(2, size), {x, 0.1, 0.05}).positions;
  positions.insert(positions.end(), second.begin(), second.end());
  return positions;
}

std::vector<Case> cases() {
  static const std::vector<double> start = test::soup_positions(n_triangles, 1),
                                   end = test::soup_positions(n_triangles, 2);
  const auto detect = [](Detector& d) { return d.detect(view(start), view(end)).hash; };
  const auto time = [](Detector& d) {
    return static_cast<std::uint64_t>(1e15 * d.collision_free_step(view(start), view(start)));
  };
  const auto short_time = [](Detector& d) {
    std::vector<double> near = start;
    for (double& x : near) x += 1e-3;
    d.collision_free_step(view(start), view(near));
    return static_cast<std::uint64_t>(1e15 * d.collision_free_step(view(start), view(near)));
  };
  const auto soup = test::soup_scene(n_triangles);
  std::vector<Case> all;
  for (const int threads : {1, 2}) {
    auto scene = soup;
    const std::string suffix = ", " + std::to_string(threads) + " threads";
    const auto add = [&](std::string name, auto ask, auto change) {
      Options o;
      o.threads = threads, o.closest = true;
      change(o);
      all.push_back({name + suffix, scene, o, ask});
    };
    const auto as_it_is = [](Options&) {};
    add("all", detect, as_it_is);
    add("first", detect, [](Options& o) { o.report = Report::first; });
    // Each backend finds another one, and the first calls of `automatic` try them in turn.
    add("any", detect, [](Options& o) { o.report = Report::any, o.backend = Backend::cpu; });
    add("separated", detect, [](Options& o) { o.minimum_separation = 0.01; });
    add("published", detect, [](Options& o) { o.method = Method::published; });
    add("naive", detect, [](Options& o) { o.method = Method::naive; });
    add("front", detect, [](Options& o) { o.method = Method::front; });
    add("time", time, as_it_is);
    add("short time", short_time, as_it_is);
    add("proximity", [](Detector& d) { return d.proximity(view(start), 0.3).hash; }, as_it_is);
    add("intersections", [](Detector& d) { return d.intersections(view(start)).hash; }, as_it_is);
    add(
        "distances", [](Detector& d) { return static_cast<std::uint64_t>(1e9 * d.distances(view(start))[0].distance); },
        as_it_is);
    scene = solids_scene();
    static const std::vector<double> apart = solid_positions(1.9), closer = solid_positions(0.7);
    const auto everything = [](Options& o) {
      o.points = o.normals = o.closest = o.weights = true, o.minimum_separation = 0.01;
    };
    add(
        "all outputs",
        [](Detector& d) {
          const Contacts c = d.detect(view(apart), view(closer));
          return Digest() << c.hash << c.points << c.normals << c.weights << c.approach << c.vp_toc;
        },
        everything);
    add(
        "motion", [](Detector& d) { return Digest() << d.collision_free_motion(view(apart), view(closer)).factors; },
        as_it_is);
    add(
        "motion of groups",
        [](Detector& d) {
          const std::vector<std::int64_t> groups(apart.size() / 3, 0);
          return Digest() << d.collision_free_motion(view(apart), view(closer), groups).factors;
        },
        as_it_is);
    add(
        "places of intersections",
        [](Detector& d) {
          const Intersections i = d.intersections(view(closer));
          Digest digest;
          digest << i.hash << i.points << i.directions;
          for (const Contour& c : contours(d.scene(), i)) digest << c.rows;
          for (const EnclosedRegion& r : enclosed_regions(d.scene(), i)) digest << r.vertices_b;
          return digest;
        },
        [](Options& o) { o.points = o.directions = true; });
    add(
        "outputs of proximity",
        [](Detector& d) {
          const Proximity p = d.proximity(view(closer), 0.3);
          return Digest() << p.hash << p.closest << p.normals << p.weights << p.vp_distance;
        },
        [](Options& o) { o.normals = o.closest = o.weights = true; });
    add(
        "inside",
        [](Detector& d) {
          static const std::vector<double> small = solid_positions(0.05, 0.2);
          Digest digest;
          for (const Gap& g : d.distances(view(small))) digest << g.distance << static_cast<int>(g.inside);
          return digest;
        },
        as_it_is);
    add(
        "points",
        [](Detector& d) {
          return Digest() << d.winding_numbers(view(closer), view(apart), 0).on_surface
                          << d.signed_distances(view(closer), view(apart), 1).distance;
        },
        as_it_is);
    add(
        "translation",
        [](Detector& d) { return Digest() << d.separating_translation(view(closer), 0, 1, {1, 0.2, 0}); }, as_it_is);
    add("penetration", [](Detector& d) { return Digest() << d.penetration(view(closer), 0, 1).translation; }, as_it_is);
    add(
        "poses",
        [](Detector& d) {
          const Pose poses[] = {{}, {{0.7, 0.1, 0}, {0, 0, 0.6, 0.8}}};
          return Digest() << d.proximity_at(poses, 0.3).hash << d.intersections_at(poses).hash
                          << d.distances_at(poses)[0].distance << d.positions_at(poses);
        },
        as_it_is);
    add(
        "changes",
        [](Detector& d) {
          d.set_separation(0, 1, 0.2);
          d.set_thickness(1, std::vector<double>{0.05});
          d.set_plane(2, {{0, 0.1, 1}, -2});
          return d.detect(view(apart), view(closer)).hash;
        },
        as_it_is);
  }
  return all;
}

class MemoryEnds : public testing::TestWithParam<Case> {};

TEST_P(MemoryEnds, InACall) {
  const auto& [name, scene, options, ask] = GetParam();
  const std::uint64_t expected = [&] {
    Detector d(scene, options);
    return ask(d);
  }();
  long tried = 0, ended = 0;
  for (long n = 0;; n = GetParam().after(n), ++tried) {
    Detector d(scene, options);
    const std::optional<bool> e = ends(n, [&] { EXPECT_EQ(ask(d), expected); });
    ASSERT_EQ(ask(d), expected) << "after allocation " << n;
    ASSERT_EQ(ask(d), expected) << "after allocation " << n;
    if (!e) break;
    ended += *e;
  }
  EXPECT_GT(tried, some);
  // std::stable_sort does without the memory that it cannot have.
  EXPECT_GE(ended, tried - 2);
}

TEST_P(MemoryEnds, InALaterCall) {
  const auto& [name, scene, options, ask] = GetParam();
  Detector d(scene, options);
  const std::uint64_t expected = ask(d);
  for (long n = 0;; n = GetParam().after(n)) {
    const std::optional<bool> e = ends(n, [&] { EXPECT_EQ(ask(d), expected); });
    ASSERT_EQ(ask(d), expected) << "after allocation " << n;
    if (!e) break;
  }
}

INSTANTIATE_TEST_SUITE_P(Calls, MemoryEnds, testing::ValuesIn(cases()), [](const auto& info) {
  std::string name = info.param.name;
  std::erase_if(name, [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); });
  return name;
});

TEST(MemoryEnds, WhereADetectorIsMade) {
  for (const auto& scene : {test::soup_scene(n_triangles), solids_scene()})
    for (const int threads : {1, 3}) {
      Options options;
      options.threads = threads, options.worlds = 3;
      long n = 0;
      while (ends(n, [&] { Detector(scene, options); })) ++n;
      EXPECT_GT(n, some);
    }
}

TEST(MemoryEnds, InACallOfManyWorlds) {
  constexpr std::size_t worlds = 5;
  std::vector<double> start, end;
  for (unsigned k = 0; k < worlds; ++k) {
    const auto at_start = test::soup_positions(n_triangles, k), at_end = test::soup_positions(n_triangles, k + worlds);
    start.insert(start.end(), at_start.begin(), at_start.end());
    end.insert(end.end(), at_end.begin(), at_end.end());
  }
  const auto scene = test::soup_scene(n_triangles);
  Options options;
  options.worlds = worlds, options.threads = 2;
  Detector d(scene, options);
  const std::uint64_t expected = d.detect(view(start), view(end)).hash;
  const std::vector<double> steps = d.collision_free_steps(view(start), view(end));
  long n = 0;
  for (;; ++n) {
    const std::optional<bool> e = ends(n, [&] { d.detect(view(start), view(end)); });
    ASSERT_EQ(d.detect(view(start), view(end)).hash, expected);
    ends(n, [&] { d.collision_free_steps(view(start), view(end)); });
    ASSERT_EQ(d.collision_free_steps(view(start), view(end)), steps);
    if (!e) break;
  }
  EXPECT_GT(n, some);
}

// A thread takes pairs from all others and has no memory for them: it leaves, and no thread waits for it.
TEST(MemoryEnds, WherePairsAreShared) {
  paper::SharedPairs shared;
  paper::PairQueue given(10000, {0, 1});
  shared.begin(2);
  shared.push_half(given);
  paper::PairQueue first, second;
  EXPECT_EQ(ends(0, [&] { shared.pop(first); }), true);
  shared.leave();
  while (shared.pop(second)) second.clear();
}

// A mesh is there in full or not at all.
TEST(MemoryEnds, InAScene) {
  const std::vector<std::uint32_t> faces = test::sheet_faces(5);
  const std::string name(100, 'x');
  Scene scene;
  scene.add_mesh("first", faces, 25);
  long n = 0;
  while (const auto e = ends(n, [&] { scene.add_mesh(name + std::to_string(n), faces, 25); })) {
    EXPECT_TRUE(*e);
    EXPECT_EQ(scene.meshes().size(), 1u);
    EXPECT_EQ(scene.faces().size(), faces.size() / 3);
    EXPECT_EQ(scene.n_vertices(), 25u);
    ++n;
  }
  EXPECT_GE(n, 3);
  EXPECT_EQ(scene.meshes().size(), 2u);
  EXPECT_EQ(scene.faces().size(), 2 * faces.size() / 3);
}

}  // namespace
}  // namespace hpccd
