// SPDX-License-Identifier: Apache-2.0
// Wherever memory ends: std::bad_alloc is thrown, and the next call works as if nothing had happened.
#include <gtest/gtest.h>

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <functional>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <vector>

#include "grid_scene.h"
#include "hpccd/hpccd.h"
#include "paper/shared_pairs.h"
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
  Options options;
  std::function<std::uint64_t(Detector&)> ask;
};

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
  std::vector<Case> all;
  for (const int threads : {1, 2}) {
    const std::string suffix = ", " + std::to_string(threads) + " threads";
    const auto add = [&](std::string name, auto ask, auto change) {
      Options o;
      o.threads = threads, o.closest = true;
      change(o);
      all.push_back({name + suffix, o, ask});
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
  }
  return all;
}

class MemoryEnds : public testing::TestWithParam<Case> {};

TEST_P(MemoryEnds, InACall) {
  const auto& [name, options, ask] = GetParam();
  const auto scene = test::soup_scene(n_triangles);
  const std::uint64_t expected = [&] {
    Detector d(scene, options);
    return ask(d);
  }();
  long n = 0, ended = 0;
  for (;; ++n) {
    Detector d(scene, options);
    const std::optional<bool> e = ends(n, [&] { EXPECT_EQ(ask(d), expected); });
    ASSERT_EQ(ask(d), expected) << "after allocation " << n;
    ASSERT_EQ(ask(d), expected) << "after allocation " << n;
    if (!e) break;
    ended += *e;
  }
  EXPECT_GT(n, some);
  EXPECT_EQ(ended, n);
}

TEST_P(MemoryEnds, InALaterCall) {
  const auto& [name, options, ask] = GetParam();
  Detector d(test::soup_scene(n_triangles), options);
  const std::uint64_t expected = ask(d);
  for (long n = 0;; ++n) {
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
  const auto scene = test::soup_scene(n_triangles);
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
