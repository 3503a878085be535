// SPDX-License-Identifier: Apache-2.0
// The public C++ interface; the same contacts on any number of threads is also what the sanitizers are run on.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "equal_contacts.h"
#include "grid_scene.h"

namespace hpccd {
namespace {

constexpr std::uint32_t side = 15;

Contacts detect(std::shared_ptr<const Scene> scene, Options options) {
  options.backend = Backend::cpu;
  Detector detector(std::move(scene), options);
  const auto start = test::sheet_positions(side, 0), end = test::sheet_positions(side, 1);
  return detector.detect(test::view(start), test::view(end));
}

// Every pair tested by itself: what the hierarchy and the traversal must find again.
Contacts detect_pair_by_pair(const Scene& scene) {
  const auto start = test::sheet_positions(side, 0), end = test::sheet_positions(side, 1);
  std::vector<Query> queries;
  std::vector<std::array<std::uint32_t, 2>> pairs;
  for (std::uint32_t vertex = 0; vertex < scene.n_vertices(); ++vertex)
    for (std::uint32_t face = 0; face < scene.faces().size(); ++face) {
      const auto& [a, b, c] = scene.faces()[face];
      if (vertex == a || vertex == b || vertex == c) continue;
      Query query;
      auto value = query.begin();
      for (const auto& positions : {start, end})
        for (std::uint32_t corner : {vertex, a, b, c}) value = std::copy_n(positions.begin() + 3 * corner, 3, value);
      queries.push_back(query);
      pairs.push_back({vertex, face});
    }
  const auto hit = std::make_unique<bool[]>(queries.size());
  std::vector<double> toc(queries.size());
  Options options;
  options.simd = Simd::scalar;
  test_vertex_face(queries, options, hit.get(), toc.data());
  Contacts contacts;
  for (std::size_t i = 0; i < pairs.size(); ++i)
    if (hit[i]) contacts.vf.push_back(pairs[i]), contacts.vf_toc.push_back(toc[i]);
  return contacts;
}

TEST(Detector, FindsWhatTestingEachPairFinds) {
  const auto scene = test::two_sheets(side);
  const Contacts found = detect(scene, {}), expected = detect_pair_by_pair(*scene);
  ASSERT_GT(expected.vf.size(), 100u);
  EXPECT_EQ(found.vf, expected.vf);
  ASSERT_EQ(found.vf_toc.size(), expected.vf_toc.size());
  for (std::size_t i = 0; i < expected.vf_toc.size(); ++i) EXPECT_NEAR(found.vf_toc[i], expected.vf_toc[i], 1e-12);
}

TEST(Detector, SameContactsOnAnyNumberOfThreads) {
  for (Accuracy accuracy : {Accuracy::fast, Accuracy::balanced, Accuracy::exact}) {
    const Contacts alone = detect(test::two_sheets(side), {.accuracy = accuracy, .threads = 1});
    ASSERT_GT(alone.vf.size() + alone.ee.size(), 200u);
    for (int threads : {2, 3, 8})
      test::expect_equal(alone, detect(test::two_sheets(side), {.accuracy = accuracy, .threads = threads}));
  }
}

TEST(Detector, DetectorsOfOneSceneWorkSideBySide) {
  const auto scene = test::two_sheets(side);
  const Contacts expected = detect(scene, {.threads = 1});
  std::vector<Contacts> found(3);
  std::vector<std::thread> threads;
  for (Contacts& contacts : found) threads.emplace_back([&] { contacts = detect(scene, {.threads = 2}); });
  for (std::thread& thread : threads) thread.join();
  for (const Contacts& contacts : found) test::expect_equal(expected, contacts);
}

TEST(Detector, CallsOfSeveralThreadsTakeTurns) {
  for (const Method method : {Method::standard, Method::published}) {
    Options options;
    options.backend = Backend::cpu, options.threads = 2, options.method = method, options.points = true;
    const auto scene = test::two_sheets(side);
    const auto start = test::sheet_positions(side, 0), end = test::sheet_positions(side, 1);
    Detector alone(scene, options), shared(scene, options);
    const Contacts there = alone.detect(test::view(start), test::view(end));
    const Contacts back = alone.detect(test::view(end), test::view(start));
    ASSERT_NE(there.hash, back.hash);
    std::atomic<bool> done{false};
    std::thread reader([&] {
      while (!done) {
        const auto stats = shared.stats();
        EXPECT_TRUE(stats.empty() || stats.at("vf_contacts") == there.vf.size() ||
                    stats.at("vf_contacts") == back.vf.size());
        (void)shared.profile();
        EXPECT_EQ(shared.last_backend(), Backend::cpu);
        EXPECT_EQ(shared.last_gpu_error(), "");
      }
    });
    std::vector<std::thread> callers;
    for (int caller = 0; caller < 4; ++caller)
      callers.emplace_back([&, caller] {
        for (int call = 0; call < 10; ++call) {
          const bool forth = (caller + call) % 2 == 0;
          test::expect_equal(shared.detect(test::view(forth ? start : end), test::view(forth ? end : start)),
                             forth ? there : back);
        }
      });
    for (std::thread& caller : callers) caller.join();
    done = true;
    reader.join();
  }
}

TEST(Detector, IsBusyWhileAnotherThreadCalls) {
  Options options;
  options.backend = Backend::cpu, options.threads = 1;
  Detector detector(test::two_sheets(side), options);
  EXPECT_FALSE(detector.busy());
  const auto start = test::sheet_positions(side, 0), end = test::sheet_positions(side, 1);
  std::thread caller([&] { EXPECT_THROW(for (;;) detector.detect(test::view(start), test::view(end)), Cancelled); });
  while (!detector.busy()) std::this_thread::yield();
  detector.cancel();
  caller.join();
  EXPECT_FALSE(detector.busy());
}

TEST(Detector, CancelEndsTheCallUnderWayAndThoseThatWait) {
  for (const Method method : {Method::standard, Method::published, Method::naive, Method::front}) {
    Options options;
    options.backend = Backend::cpu, options.threads = 2, options.method = method;
    Detector detector(test::two_sheets(side), options);
    const auto start = test::sheet_positions(side, 0), end = test::sheet_positions(side, 1);
    std::vector<std::thread> callers;
    for (int caller = 0; caller < 3; ++caller)
      callers.emplace_back(
          [&] { EXPECT_THROW(for (;;) detector.detect(test::view(start), test::view(end)), Cancelled); });
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    detector.cancel();
    for (std::thread& caller : callers) caller.join();
  }
}

TEST(Detector, AnotherThreadMayEndIt) {
  for (int threads : {1, 4})
    for (Report report : {Report::all, Report::any}) {
      Options options;
      options.backend = Backend::cpu, options.threads = threads, options.report = report;
      Detector detector(test::two_sheets(side), options);
      const auto start = test::sheet_positions(side, 0), end = test::sheet_positions(side, 1);
      std::thread other([&] {
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        detector.cancel();
      });
      EXPECT_THROW(for (;;) detector.detect(test::view(start), test::view(end)), Cancelled);
      other.join();
      EXPECT_THROW(detector.detect(test::view(start), test::view(end)), Cancelled);
    }
}

TEST(Detector, RefusesPositionsThatDoNotFitTheScene) {
  Detector detector(test::two_sheets(side), {.backend = Backend::cpu});
  const auto right = test::sheet_positions(side, 0), too_few = std::vector(right.begin(), right.begin() + 6);
  EXPECT_THROW(detector.detect(test::view(right), test::view(too_few)), InvalidArgument);
  auto not_finite = right;
  not_finite[7] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(detector.detect(test::view(right), test::view(not_finite)), InvalidArgument);
  EXPECT_NO_THROW(detector.detect(test::view(right), test::view(right)));
}

TEST(Detector, RefusesSeparationsThatAreNoLengths) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const auto still = test::sheet_positions(side, 0);
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), -1e-300, infinity, -infinity}) {
    const Options options{.backend = Backend::cpu, .minimum_separation = bad};
    EXPECT_THROW(Detector(test::two_sheets(side), options), InvalidArgument) << bad;
    Query query{};
    bool hit;
    double toc;
    EXPECT_THROW(test_vertex_face({&query, 1}, options, &hit, &toc), InvalidArgument) << bad;
    EXPECT_THROW(test_edge_edge({&query, 1}, options, &hit, &toc), InvalidArgument) << bad;
    Scene scene = *test::two_sheets(side);
    EXPECT_THROW(scene.set_separation(0, 1, bad), InvalidArgument) << bad;
    Detector detector(test::two_sheets(side), {.backend = Backend::cpu});
    EXPECT_THROW(detector.set_separation(0, 1, bad), InvalidArgument) << bad;
    std::vector<double> of_pairs(test::sheets * test::sheets);
    of_pairs[1] = of_pairs[test::sheets] = bad;
    EXPECT_THROW(detector.set_separations(of_pairs), InvalidArgument) << bad;
    EXPECT_THROW(detector.proximity(test::view(still), bad), InvalidArgument) << bad;
  }
  Scene scene = *test::two_sheets(side);
  EXPECT_THROW(scene.set_separation(0, test::sheets, 0.1), InvalidArgument);
  EXPECT_THROW(scene.set_separation(test::sheets, 0, 0.1), InvalidArgument);
  EXPECT_NO_THROW(scene.set_separation(0, 1, -0.0));
}

TEST(Detector, TakesAllSeparationsAtOnceAsOneByOne) {
  const auto start = test::sheet_positions(side, 0), end = test::sheet_positions(side, 1);
  constexpr std::uint32_t n = test::sheets;
  Detector at_once(test::two_sheets(side), {.backend = Backend::cpu}),
      one_by_one(test::two_sheets(side), {.backend = Backend::cpu});
  std::vector<double> of_pairs(n * n, 0.01);
  for (const double d : {0.2, 0.0, 0.1}) {
    of_pairs[1] = of_pairs[n] = d;
    at_once.set_separations(of_pairs);
    for (std::uint32_t a = 0; a < n; ++a)
      for (std::uint32_t b = a; b < n; ++b) one_by_one.set_separation(a, b, of_pairs[a * n + b]);
    EXPECT_EQ(at_once.detect(test::view(start), test::view(end)).hash,
              one_by_one.detect(test::view(start), test::view(end)).hash)
        << d;
  }
  const auto hash = at_once.detect(test::view(start), test::view(end)).hash;
  of_pairs[1] = 0.3;
  EXPECT_THROW(at_once.set_separations(of_pairs), InvalidArgument) << "two for one pair";
  of_pairs[n] = 0.3;
  EXPECT_THROW(at_once.set_separations({of_pairs.data(), n * n - 1}), InvalidArgument);
  EXPECT_EQ(at_once.detect(test::view(start), test::view(end)).hash, hash) << "and nothing of it was kept";
}

}  // namespace
}  // namespace hpccd
